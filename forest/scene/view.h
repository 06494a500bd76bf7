// SPDX-License-Identifier: Apache-2.0
// A view as text: where the eye is, where it looks, what colours mean. One line of JSON can be pasted to a colleague.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/colouring.h"
#include "forest/scene/cut.h"

namespace forest::scene {

struct View {
  frame::Camera camera;
  Detail detail;  // gaze in shares of the width and height here, so that a view fits every picture size
  ColourBy colour_by = ColourBy::type;
  Background background = Background::dark;
  std::uint32_t samples = 16;       // subframes of a still picture
  float fog = 1.f;                  // strength of the depth cue; 0 for none
  float halo = 1.f;                 // strength of the rim around nearer branches; 0 for none
  std::vector<Appearance> targets;  // how they are shown; later ones win
};

/// {"eye":[x,y,z],"target":[x,y,z],"up":[0,1,0],"field_of_view":40,"projection":"perspective","gaze":[.5,.5],"error":1,
///  "colour_by":"type","background":"dark","samples":16,"fog":1,"halo":1,"targets":[{"name":"L5","opacity":.4}]}; only eye
///  and target are needed.
/// Throws InputError naming the wrong key. Unknown keys are errors too, so that a typing slip is noticed.
View parse_view(std::string_view json, const std::string& name = "view");
std::string to_json(const View& view);

/// The view that shows the whole forest from outside, a little from above.
View overview(const Forest& forest);

/// A picture to hang on a wall: near enough to follow single dendrites, far enough to see the layers.
View portrait(const Forest& forest);

/// The picture of a view. The spans of the frame point into `cut`, `colouring` and `overlays`, which must outlive it.
frame::Frame compose(const Forest& forest, const View& view, const Colouring& colouring, const Cut& cut,
                     std::uint32_t width, std::uint32_t height,
                     std::span<const frame::Overlay> overlays = {});

/// `view.detail` with the gaze in pixels of a picture of that size.
Detail detail_for(const View& view, std::uint32_t width, std::uint32_t height);

/// The outline of the column: circles at the limits of the layers and a few verticals. Empty when it is no column.
std::vector<frame::Overlay> outline(const Forest& forest);

}  // namespace forest::scene
