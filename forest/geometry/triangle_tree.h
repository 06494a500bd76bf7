// SPDX-License-Identifier: Apache-2.0
// The triangles of a mesh by place: the nearest point of the surface, and where a straight piece meets it. A binary tree of
// boxes, split at the median of the centres along the widest side.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "forest/geometry/mesh.h"

namespace forest {

/// How much each corner of a triangle counts at a place on it: 0 or more, in sum 1.
Eigen::Vector3d barycentric(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                            const Eigen::Vector3d& at);

class TriangleTree {
 public:
  using Place = Eigen::Vector3d;  // µm

  /// Keeps a copy of what it needs of the mesh. Corners must be in range, coordinates finite.
  explicit TriangleTree(const Mesh& mesh);

  struct Hit {
    std::uint32_t triangle = 0;
    Place at = Place::Zero();
    double distance = 0.;  // µm: to the asked place; along the piece from its start
  };
  /// The nearest point that is nearer than `within`.
  std::optional<Hit> nearest(const Place& to, double within = 1e300) const;
  /// Where the piece from `from` to `to` meets the surface first.
  std::optional<Hit> first(const Place& from, const Place& to) const;

  /// Whether a closed surface encloses the place: a ray from there leaves it once more than it enters.
  bool encloses(const Place& place) const;

  /// Unit, of a triangle; zero where it has no area.
  Place normal(std::uint32_t triangle) const;
  std::array<Place, 3> corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {positions_[t[0]], positions_[t[1]], positions_[t[2]]};
  }
  std::size_t size() const { return triangles_.size(); }

  /// Calls visit(triangle) for all whose boxes touch the box from `low` to `high`.
  template <class Visit>
  void for_overlapping(const Place& low, const Place& high, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const Node& node = nodes_[stack.back()];
      stack.pop_back();
      if ((node.low.array() > high.array()).any() || (node.high.array() < low.array()).any()) continue;
      if (node.count == 0) {
        stack.push_back(node.first), stack.push_back(node.first + 1);
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(order_[i]);
    }
  }

 private:
  struct Node {
    Place low, high;
    std::uint32_t first = 0;  // its first triangle in order_, or the first of its two children
    std::uint32_t count = 0;  // of triangles; 0: it has children
  };
  void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end, const std::vector<Place>& centres);

  std::vector<Place> positions_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace forest
