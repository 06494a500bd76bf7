// SPDX-License-Identifier: Apache-2.0
#include "apps/foveated.h"

#include <chrono>

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
  std::vector<const frame::Image*> pictures;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const scene::Layer& layer = plan[i];
    Drawn& drawn = *layers_[i];
    auto start = Clock::now();
    const frame::Viewport viewport{float(layer.width), float(layer.height)};
    const scene::Eye eye(view.camera, viewport, scene::detail_for(view, layer, width, height));
    if (first == 0) drawn.chooser.choose(eye, viewport, colouring.shown(), painter);
    figures_.cull += milliseconds_since(start);
    frame::Frame frame =
        scene::compose(forest_, view, colouring, drawn.chooser.cut(), layer.width, layer.height, overlays);
    frame.area = layer.area, frame.hole = layer.hole, frame.gaps = layer.gaps;
    frame.glass = glass;
    frame.first_subframe = first, frame.last_subframe = last;
    drawn.chooser.complete(frame);
    if (dress) dress(frame, drawn.chooser.cut(), eye);
    const frame::Timing timing = drawn.renderer->draw(frame);
    drawn.chooser.remember(drawn.renderer->seen());
    figures_.draw += timing.draw, figures_.resolve += timing.resolve;
    figures_.drawn += timing.drawn;
    figures_.segments += drawn.chooser.segments();
    figures_.layer_segments.push_back(drawn.chooser.segments());
    figures_.neurons = std::max(figures_.neurons, drawn.chooser.cut().neurons);
    start = Clock::now();
    if (const frame::Image* image = drawn.renderer->image()) {
      pictures.push_back(image);
    } else {
      drawn.image = drawn.renderer->read();
      pictures.push_back(&drawn.image);
    }
    figures_.unite += milliseconds_since(start);
  }
  const auto start = Clock::now();
  scene::unite(view, plan, pictures, width, height, whole_);
  figures_.unite += milliseconds_since(start);
  return whole_;
}

}  // namespace forest
