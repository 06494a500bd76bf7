// SPDX-License-Identifier: Apache-2.0
// What cannot be seen because nearer things stand before it, judged by how far one sees in a picture drawn already.
#pragma once

#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/frame.h"

namespace forest::scene {

/// A picture's depth map as a pyramid, each level the farthest of four of the level below (Greene, Kass & Miller 1993,
/// "Hierarchical Z-buffer visibility").
class Occluders {
 public:
  /// @param map  of a picture of that size, as the camera saw it
  Occluders(const frame::DepthMap& map, const frame::Camera& camera, const frame::Viewport& viewport);

  /// Whether everything within the sphere lies behind what the picture shows. False for what was beside the picture,
  /// too near or in doubt: only true is certain.
  bool hide(const Sphere& sphere) const;

 private:
  struct Level {
    std::uint32_t width = 0, height = 0;
    std::vector<float> depths;
    float at(std::uint32_t x, std::uint32_t y) const { return depths[std::size_t(y) * width + x]; }
  };
  std::vector<Level> levels_;
  Mat3 axes_;
  Vec3 eye_;
  bool orthographic_;
  float near_, focal_, centre_x_, centre_y_;
};

}  // namespace forest::scene
