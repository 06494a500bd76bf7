// SPDX-License-Identifier: Apache-2.0
// Whether a surface cuts itself, and where.
#pragma once

#include <cstdint>
#include <optional>

#include "forest/geometry/mesh.h"

namespace forest {

/// Two triangles that share no vertex, and a point of both: an edge of one goes through the other. Triangles that touch in
/// one plane do not count.
struct SelfIntersection {
  std::uint32_t first, second;
  Eigen::Vector3d point;  // µm
};

/// The first pair in the order of the triangles. On all cores.
std::optional<SelfIntersection> self_intersection(const Mesh& mesh);

/// How many triangles are cut by others.
std::size_t count_cut_triangles(const Mesh& mesh);

}  // namespace forest
