// SPDX-License-Identifier: Apache-2.0
// Grey values on a grid in space, and the contours of a threshold in its sections: marching squares (Lorensen & Cline 1987 in
// the plane). Between the centres of four voxels values are interpolated bilinearly; where a square's corners lie on both
// sides crosswise, the value in its saddle decides (Nielson & Hamann 1991).
#pragma once

#include <array>
#include <vector>

#include "forest/cortex/contours.h"

namespace forest::cortex {

struct Volume {
  std::array<std::size_t, 3> size{0, 0, 0};          // voxels along x, y, z
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // µm: the centre of the first voxel
  Eigen::Vector3d step = Eigen::Vector3d::Ones();    // µm, > 0: from a centre to the next
  std::vector<float> values;                         // x fastest

  float at(std::size_t x, std::size_t y, std::size_t z) const {
    return values[(z * size[1] + y) * size[0] + x];
  }
};

/// Sections across an axis at `planes` (µm), between the voxels' centres by linear interpolation; beyond the volume nothing
/// lies, so that contours close along its border. What is above the threshold is inside. NaN counts as outside.
ContourStack contours_of(const Volume& volume, const std::string& object, Axis axis,
                         std::span<const double> planes, double threshold);

/// Closed polygons of one picture, inside to the left in its axes (the first to the right, the second upwards); in pixels,
/// (0, 0) the centre of the first one.
std::vector<std::vector<Place>> marching_squares(std::span<const float> values, std::size_t width,
                                                 std::size_t height, double threshold);

}  // namespace forest::cortex
