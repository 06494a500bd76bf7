// SPDX-License-Identifier: Apache-2.0
// A tree of boxes around the triangles of a mesh: the nearest of them, those within a box, and whether any two cut each other.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/geometry/mesh.h"

namespace forest {

class TriangleTree {
 public:
  /// The mesh must outlive the tree and stay as it is.
  explicit TriangleTree(const Mesh& mesh);

  struct Nearest {
    std::uint32_t triangle;
    Eigen::Vector3d point;  // on it
    double distance;        // µm
  };
  /// None when all are farther away than `limit` (µm).
  std::optional<Nearest> nearest(const Eigen::Vector3d& point, double limit = HUGE_VAL) const;

  /// Triangles whose boxes touch `box`, in ascending order.
  std::vector<std::uint32_t> within(const Bounds& box) const;

  const Mesh& mesh() const { return mesh_; }

 private:
  struct Node {
    Bounds box;
    std::uint32_t first = 0, count = 0;  // a leaf: into order_; count 0: children at first and first + 1
  };
  void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end, std::vector<Bounds>& boxes,
             std::vector<Vec3>& centres);

  const Mesh& mesh_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

/// The point of a triangle that is nearest to another (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Two triangles that share no vertex and cut each other, the first pair in their order, and a point of both: an edge of one
/// goes through the other. Triangles that touch in one plane do not count. On all cores.
struct SelfIntersection {
  std::uint32_t first, second;
  Eigen::Vector3d point;  // µm
};
std::optional<SelfIntersection> self_intersection(const Mesh& mesh);
/// Of all triangles, how many are cut by others.
std::size_t count_cut_triangles(const Mesh& mesh);

}  // namespace forest
