// SPDX-License-Identifier: Apache-2.0
// One of the two surfaces of a cortex, and which way it faces. A triangulated surface has no direction at its edges, and real
// ones are crumpled on a smaller scale than neurons are: its normal is the mean over a disc around a place.
#pragma once

#include <vector>

#include "forest/core/progress.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {

using Place = Eigen::Vector3d;  // µm

/// The angle between two directions.
double degrees_between(const Place& a, const Place& b);

inline constexpr double normal_radius = 300.;  // µm, of the disc

/// The mean normal of a disc around a place of a surface, at right angles to `outwards`; not a unit. Of the nearest triangles to 19
/// places of the disc, those that face the other way left out.
Place normal_around(const TriangleTree& surface, const TriangleTree::Hit& hit, const Place& outwards);

class Boundary {
 public:
  /// Looks at normals all over the surface, .4 mm apart or less: seconds for the 20,000 triangles of a hemisphere, half a minute for
  /// 330,000.
  explicit Boundary(const Mesh& mesh, Progress& progress = Progress::none());

  const TriangleTree& tree() const { return tree_; }
  /// As normal_around, a unit, read between those looked at; zero where the surface is no surface.
  Place normal(const TriangleTree::Hit& hit) const;

 private:
  TriangleTree tree_;
  std::vector<std::uint32_t> first_;  // of every triangle's normals, and how many there are
  std::vector<Eigen::Vector3f>
      normals_;  // rows of sides + 1, sides, … 1 places, from the first edge to the third corner
};

}  // namespace forest::cortex
