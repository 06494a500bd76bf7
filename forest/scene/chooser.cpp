// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/chooser.h"

namespace forest::scene {

const Cut& Chooser::choose(const Eye& eye, const frame::Viewport& viewport, const Shown& shown,
                           Painter painter) {
  Chooser* one[] = {this};
  choose(one, {&eye, 1}, {&viewport, 1}, shown, painter);
  return cut_;
}

void Chooser::choose(std::span<Chooser* const> choosers, std::span<const Eye> eyes,
                     std::span<const frame::Viewport> viewports, const Shown& shown, const Painter& painter) {
  const auto& first = choosers.front()->eye_;
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < choosers.size(); ++i) {
    const Chooser& c = *choosers[i];
    // One that was not asked for a while knows what another camera saw.
    const bool knows = c.before_ && first && c.eye_->camera() == first->camera();
    sights.push_back({eyes[i], knows ? &*c.before_ : nullptr});
  }
  std::vector<Cut> cuts = scene::choose(choosers.front()->forest_, sights, shown);
  for (std::size_t i = 0; i < choosers.size(); ++i) {
    Chooser& c = *choosers[i];
    c.eye_ = eyes[i], c.viewport_ = viewports[i], c.shown_ = shown, c.painter_ = painter;
    c.revealed_segments_ = c.drawings_ = 0;
    c.cut_ = std::move(cuts[i]);
    if (painter) painter(c.cut_, eyes[i]);
  }
}

void Chooser::complete(frame::Frame& frame) {
  frame.rest = [this](const frame::DepthMap& seen) {
    revealed_ = revealed(forest_, *eye_, viewport_, cut_.left_out, Occluders(seen, eye_->camera(), viewport_),
                         shown_);
    if (painter_) painter_(revealed_, *eye_);
    revealed_segments_ += revealed_.segments, ++drawings_;
    return revealed_.lists();
  };
}

void Chooser::remember(const frame::DepthMap& seen) { before_.emplace(seen, eye_->camera(), viewport_); }

}  // namespace forest::scene
