// SPDX-License-Identifier: Apache-2.0
// How far one surface is from another: places on it, and the nearest point of the other to each.
#pragma once

#include <span>
#include <vector>

#include "forest/geometry/mesh.h"
#include "forest/geometry/triangle_tree.h"

namespace forest {

inline constexpr double usual_area_each = 2.5e5;  // µm², of a place
/// More than that for a surface larger than any cortex, so that it has no more than 10⁷ places.
double area_each(const Mesh& mesh);
/// A place for every so many µm² of a surface, in the triangle that it falls in: none of its parts says more than another.
std::vector<TriangleTree::Place> evenly_on(const Mesh& mesh, double each = usual_area_each);
/// Its vertices. Of surfaces that were brought over from a template they crowd in sulci, so that these say more of sulci.
std::vector<TriangleTree::Place> at_vertices(const Mesh& mesh);

/// Distances of places from a surface, µm; 0 where there are no places.
struct Distances {
  std::vector<double> each;  // of every place
  double mean = 0., median = 0., p95 = 0., greatest = 0.;
  TriangleTree::Place farthest = TriangleTree::Place::Zero();
};

/// On all cores. The surface must have triangles.
Distances distances(std::span<const TriangleTree::Place> places, const TriangleTree& surface);

}  // namespace forest
