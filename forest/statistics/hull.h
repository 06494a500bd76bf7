// SPDX-License-Identifier: Apache-2.0
// Convex hulls in space (quickhull: Barber, Dobkin & Huhdanpaa 1996, ACM Trans Math Softw 22:469) and in the plane
// (monotone chain: Andrew 1979, Inf Process Lett 9:216).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace forest::statistics {

struct Hull {
  /// Indices of points whose hull is that of all; of points that lie in one plane all of them.
  std::vector<std::uint32_t> vertices;
  double volume =
      0.;  // 0 when the points lie in one plane; exact to a few units in the 12th place of their spread
};

Hull convex_hull(std::span<const Eigen::Vector3d> points);

struct PlanarHull {
  double area = 0., perimeter = 0.;
  double diameter = 0.;  // the greatest distance between two of the points
};

PlanarHull planar_hull(std::vector<Eigen::Vector2d> points);

}  // namespace forest::statistics
