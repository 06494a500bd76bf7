// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/cpu_renderer.h"

#include <chrono>

#include "forest/frame/constants.h"
#include "forest/render/cpu/resolve.h"
#include "forest/render/cpu/splat.h"
#include "forest/render/cpu/triangles.h"

namespace forest::render {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

struct CpuRenderer::State {
  cpu::Picture picture;
  cpu::Canvas canvas;
  frame::DepthMap seen;
  std::vector<float> sums;
  frame::Image image;

  // Returns how many segments there were to draw.
  std::uint64_t draw(const frame::Lists& lists) {
    std::uint64_t drawn = 0;
    const frame::Band whole{std::uint32_t(lists.dots.size()), std::uint32_t(lists.lines.size()),
                            std::uint32_t(lists.capsules.size())};
    frame::Band from;
    for (const frame::Band& to : lists.bands.empty() ? std::span(&whole, 1) : lists.bands) {
      if (from.dots || from.lines || from.capsules) canvas.look();
      const auto draw = [&](std::span<const frame::Item> list, std::span<const std::uint8_t> entries,
                            std::size_t begin, std::size_t end, cpu::Kind kind) {
        const std::size_t each = kind == cpu::Kind::dots ? 1 : frame::cluster_size;
        if (!entries.empty()) entries = entries.subspan(begin * each, (end - begin) * each);
        drawn += cpu::splat(picture, list.subspan(begin, end - begin), entries, kind, canvas);
      };
      draw(lists.capsules, lists.entries.capsules, from.capsules, to.capsules, cpu::Kind::capsules);
      draw(lists.dots, lists.entries.dots, from.dots, to.dots, cpu::Kind::dots);
      draw(lists.lines, lists.entries.lines, from.lines, to.lines, cpu::Kind::lines);
      from = to;
    }
    return drawn;
  }
};

CpuRenderer::CpuRenderer() : state_(std::make_unique<State>()) {}
CpuRenderer::~CpuRenderer() = default;

void CpuRenderer::load(const frame::Geometry& geometry) { state_->picture.geometry = geometry; }

frame::Timing CpuRenderer::draw(const frame::Frame& f) {
  State& s = *state_;
  frame::check(f, s.picture.geometry);
  s.seen = {};
  s.picture.states = f.states, s.picture.opacities = f.opacities;
  s.picture.transparent = frame::transparent(f);
  const frame::Area area = f.area.value_or(frame::Area{0, 0, f.width, f.height});
  frame::Timing timing;
  for (std::uint32_t subframe = f.first_subframe; subframe < std::min(f.last_subframe, f.subframes);
       ++subframe) {
    auto start = Clock::now();
    const frame::Constants c = s.picture.constants = frame::constants_of(f, subframe);
    s.picture.to_camera << c.right_x, c.right_y, c.right_z, c.up_x, c.up_y, c.up_z, c.forward_x, c.forward_y,
        c.forward_z;
    s.picture.eye = {c.eye_x, c.eye_y, c.eye_z};
    s.picture.light = {c.light_x, c.light_y, c.light_z};
    s.canvas.clear(f.width, f.height, area, f.hole.value_or(frame::Area{}), f.gaps);
    if (!f.surfaces.empty()) {  // they hide much
      cpu::splat(s.picture, f.surfaces, s.canvas);
      s.canvas.look();
    }
    timing.drawn = s.draw(f);
    if (f.rest) {
      s.canvas.look();
      s.seen = s.canvas.depth_map();
      const frame::Lists more = f.rest(s.seen);
      frame::check(more, s.picture.geometry);
      timing.drawn += s.draw(more);
    }
    cpu::splat(s.picture, f.overlays, s.canvas);
    timing.draw += milliseconds_since(start);
    start = Clock::now();
    cpu::resolve(s.canvas, c, f.palette, area, s.sums, s.image);
    timing.resolve += milliseconds_since(start);
  }
  return timing;
}

frame::Image CpuRenderer::read() {
  frame::Image image = state_->image;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}

const frame::Image* CpuRenderer::image() const { return &state_->image; }

const frame::DepthMap& CpuRenderer::seen() const { return state_->seen; }

std::string CpuRenderer::name() const { return "the processor"; }

}  // namespace forest::render
