// SPDX-License-Identifier: Apache-2.0
// How long a round number of µm or mm is in a picture: in perspective, at the depth of what the camera looks at.
#pragma once

#include <optional>
#include <string>

#include "forest/scene/arrangement.h"

namespace forest::scene {

struct ScaleBar {
  float length = 0.f;  // pixels
  std::string label;   // "50 µm", "2 mm"
};
/// The longest of 1, 2 or 5 × 10ⁿ µm that takes up no more than `most` pixels of a picture `height` pixels high.
ScaleBar scale_bar(const frame::Camera& camera, float height, float most);

/// Usually at the bottom left; none where the picture is too small for it.
std::optional<Block> scale_block(const frame::Camera& camera, const frame::Viewport& picture,
                                 Background background);

}  // namespace forest::scene
