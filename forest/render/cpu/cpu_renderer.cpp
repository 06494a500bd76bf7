// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/cpu_renderer.h"

#include <chrono>

#include "forest/core/parallel.h"
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
  cpu::Splatter splatter;
  cpu::SurfaceDrawer surfaces;
  frame::DepthMap seen;
  std::vector<std::uint8_t> reached;
  cpu::Sums sums;
  frame::Image image;
};

CpuRenderer::CpuRenderer() : state_(std::make_unique<State>()) {}
CpuRenderer::~CpuRenderer() = default;

void CpuRenderer::load(const frame::Geometry& geometry) { state_->picture.geometry = geometry; }

frame::Timing CpuRenderer::draw(const frame::Frame& f) {
  State& s = *state_;
  frame::check(f, s.picture.geometry);
  s.seen = {};
  s.reached.assign(s.picture.geometry.instances.size(), 0);
  s.picture.states = f.states, s.picture.opacities = f.opacities;
  s.picture.transparent = frame::transparent(f);
  const frame::Area area = f.area.value_or(frame::Area{0, 0, f.width, f.height});
  frame::Timing timing;
  const std::uint32_t end = std::min(f.last_subframe, f.subframes),
                      at_once = frame::drawn_together(f.subframes);
  for (std::uint32_t next = f.first_subframe; next < end;) {
    auto start = Clock::now();
    const std::uint32_t begin = next / at_once * at_once, until = std::min(begin + at_once, end);
    const std::uint32_t wanted = ((1u << (until - begin)) - 1u) & ~((1u << (next - begin)) - 1u);
    next = until;
    frame::Constants& c = s.picture.constants;
    c = frame::constants_of(f, begin);
    c.centre_x = .5f * float(f.width), c.centre_y = .5f * float(f.height);
    s.picture.spread = f.subframes > 1 ? .5f : 0.f;
    s.picture.to_camera << c.right_x, c.right_y, c.right_z, c.up_x, c.up_y, c.up_z, c.forward_x, c.forward_y,
        c.forward_z;
    s.picture.eye = {c.eye_x, c.eye_y, c.eye_z};
    s.picture.light = {c.light_x, c.light_y, c.light_z};
    s.canvas.resize(f.width, f.height, int(at_once), wanted, area, f.unwanted, f.gaps);
    if (!f.surfaces.empty()) {  // first, for they hide much
      parallel_for(s.canvas.squares(), 1, [&](std::size_t n) { s.canvas.clear(s.canvas.square(n)); });
      s.surfaces.draw(s.picture, f.surfaces, s.canvas);
    }
    timing.drawn = s.splatter.draw(s.picture, f, s.canvas, f.surfaces.empty(), s.reached);
    for (std::uint32_t round = 0; f.rest; ++round) {
      s.seen = s.canvas.depth_map();
      const frame::Lists more = f.rest(s.seen, round);
      if (more.empty()) break;
      frame::check(more, s.picture.geometry);
      timing.drawn += s.splatter.draw(s.picture, more, s.canvas, false, s.reached);
    }
    s.splatter.draw(s.picture, f.balls, s.canvas);
    s.splatter.draw(s.picture, f.overlays, s.canvas);
    timing.draw += milliseconds_since(start);
    start = Clock::now();
    cpu::resolve(s.canvas, s.picture, f.palette, area, until, until == end, s.sums, s.image);
    timing.resolve += milliseconds_since(start);
  }
  return timing;
}

frame::Image CpuRenderer::read() {
  const frame::Image& from = state_->image;
  frame::Image image{from.width, from.height, std::vector<std::uint8_t>(from.pixels.size()), from.covered};
  const std::size_t row = 4 * std::size_t(from.width);
  parallel_for(from.height, 32, [&](std::size_t y) {
    std::copy_n(&from.pixels[y * row], row, &image.pixels[y * row]);
    for (std::size_t i = 3; i < row; i += 4) image.pixels[y * row + i] = 255;
  });
  return image;
}

double CpuRenderer::covered() { return state_->image.covered; }

const frame::Image* CpuRenderer::image() const { return &state_->image; }

const frame::DepthMap& CpuRenderer::seen() const { return state_->seen; }

std::span<const std::uint8_t> CpuRenderer::reached() const { return state_->reached; }

std::string CpuRenderer::name() const { return "the processor"; }

}  // namespace forest::render
