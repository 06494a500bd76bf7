// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/chooser.h"

namespace forest::scene {

const Cut& Chooser::choose(const Eye& eye, const frame::Viewport& viewport, const Shown& shown,
                           Painter painter) {
  eye_ = eye, viewport_ = viewport, shown_ = shown, painter_ = std::move(painter);
  revealed_segments_ = drawings_ = 0;
  cut_ = scene::choose(forest_, eye, viewport, before_ ? &*before_ : nullptr, shown);
  if (painter_) painter_(cut_, eye);
  return cut_;
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
