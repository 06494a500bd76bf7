// SPDX-License-Identifier: Apache-2.0
// What cannot be seen because nearer things stand before it, judged by how far one sees in a picture drawn already.
#pragma once

#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/seen.h"

namespace forest::scene {

/// A picture's depth map (Greene, Kass & Miller 1993, "Hierarchical Z-buffer visibility") with, of each square of 1, 2, 4, 8 …
/// tiles, the farthest, wherever the square begins: the farthest of any rectangle is that of a few squares that cover it.
class Occluders {
 public:
  /// @param map  of a picture of that size, as the camera saw it
  Occluders(const frame::DepthMap& map, const frame::Camera& camera, const frame::Viewport& viewport);

  /// As that camera saw spheres.
  const Viewer& viewer() const { return viewer_; }
  /// Whether everything within a sphere, seen by viewer(), lies behind what the picture shows. False for what was beside the picture,
  /// too near or in doubt: only true is certain.
  bool hide(const Glimpse& seen) const;

 private:
  float farthest(std::uint32_t left, std::uint32_t top, std::uint32_t right, std::uint32_t bottom) const;

  std::uint32_t width_ = 0, height_ = 0;  // tiles
  std::vector<std::vector<float>>
      squares_;  // of side 2^k, by their upper left tile; cut at the picture's edge
  Viewer viewer_;
  float focal_, centre_x_, centre_y_;  // the middle from the map's upper left corner, pixels
};

}  // namespace forest::scene
