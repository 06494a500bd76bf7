// SPDX-License-Identifier: Apache-2.0
#include "apps/foveated.h"

#include <chrono>

#include "forest/core/parallel.h"

namespace forest {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

const frame::Image& Foveated::draw(const scene::View& view, std::uint32_t width, std::uint32_t height,
                                   const scene::Colouring& colouring,
                                   std::span<const frame::Overlay> overlays,
                                   const std::optional<frame::Glass>& glass, std::uint32_t first,
                                   std::uint32_t last, const scene::Chooser::Painter& painter,
                                   const Dresser& dress) {
  const std::vector<scene::Layer> plan = scene::layers_of(view, width, height);
  while (layers_.size() < plan.size()) {
    layers_.push_back(std::make_unique<Drawn>(Drawn{scene::Chooser(forest_), make_(), {}}));
    layers_.back()->renderer->load(forest_.geometry());
  }
  figures_ = {};
  auto start = Clock::now();
  std::vector<scene::Eye> eyes;
  std::vector<scene::Chooser*> choosers;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    eyes.emplace_back(view.camera, frame::Viewport{float(plan[i].width), float(plan[i].height)},
                      scene::detail_for(view, plan[i], width, height));
    choosers.push_back(&layers_[i]->chooser);
  }
  if (first == 0) scene::Chooser::choose(choosers, eyes, colouring.shown(), painter);
  // Outlines are drawn over the picture, but for what the finest layer shows of them.
  std::vector<frame::Overlay> outlines, others;
  for (const frame::Overlay& overlay : overlays)
    (plan.size() > 1 && overlay.colour == scene::outline_entry ? outlines : others).push_back(overlay);
  std::vector<frame::Frame> frames;
  scene::View whole = view;  // branches are as wide in all layers
  if (!view.least_width) whole.least_width = scene::least_width_of(forest_, view.camera, width, height);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const scene::Layer& layer = plan[i];
    const scene::View shown = scene::view_for(whole, layer);
    frame::Frame& frame = frames.emplace_back(
        scene::compose(forest_, shown, colouring, choosers[i]->cut(), layer.width, layer.height,
                       i == 0 ? overlays : std::span<const frame::Overlay>(others)));
    frame.area = layer.area, frame.unwanted = layer.unwanted, frame.gaps = layer.gaps;
    frame.glass = glass;
    if (view.samples > 1) frame.first_subframe = first, frame.last_subframe = last;
    choosers[i]->complete(frame);
  }
  figures_.cull = milliseconds_since(start);

  start = Clock::now();
  std::vector<frame::Timing> timings(plan.size());
  const auto draw_layer = [&](std::size_t i) {
    render::Renderer& renderer = *layers_[i]->renderer;
    if (dress) dress(frames[i], choosers[i]->cut(), eyes[i]);
    timings[i] = renderer.draw(frames[i]);
    choosers[i]->remember(renderer.seen(), renderer.reached());
    if (!renderer.image()) layers_[i]->image = renderer.read();
  };
  if (!painter && !dress && layers_.front()->renderer->concurrent())
    parallel_for(plan.size(), 1, draw_layer);
  else
    for (std::size_t i = 0; i < plan.size(); ++i) draw_layer(i);
  figures_.draw = milliseconds_since(start);

  start = Clock::now();
  std::vector<const frame::Image*> pictures;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    figures_.drawn += timings[i].drawn;
    figures_.segments += choosers[i]->segments();
    figures_.layer_segments.push_back(choosers[i]->segments());
    figures_.neurons = std::max(figures_.neurons, choosers[i]->neurons());
    const frame::Image* image = layers_[i]->renderer->image();
    pictures.push_back(image ? image : &layers_[i]->image);
  }
  scene::unite(view, plan, pictures, width, height, whole_);
  const frame::Camera& camera = view.camera;
  const Bounds& somata = forest_.soma_bounds();
  const Vec3 middle = somata.empty() ? camera.target : somata.centre();
  scene::trace_lines(view, plan, outlines, frames.front(), -(middle - camera.eye).dot(camera.axes().col(2)),
                     whole_);
  figures_.unite = milliseconds_since(start);
  return whole_;
}

}  // namespace forest
