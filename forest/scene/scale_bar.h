// SPDX-License-Identifier: Apache-2.0
// How long a round number of µm or mm is in a picture: in perspective, at the depth of what the camera looks at.
#pragma once

#include <string>

#include "forest/frame/frame.h"
#include "forest/scene/view.h"

namespace forest::scene {

struct ScaleBar {
  float length = 0.f;  // pixels
  std::string label;   // "50 µm", "2 mm"
};
/// The longest of 1, 2 or 5 × 10ⁿ µm that takes up no more than `most` pixels of a picture `height` pixels high.
ScaleBar scale_bar(const frame::Camera& camera, float height, float most);

/// At the bottom left. Returns false where the picture is too small for it, and leaves it as it is.
bool paint_scale(frame::Image& image, const frame::Camera& camera, Background background);

}  // namespace forest::scene
