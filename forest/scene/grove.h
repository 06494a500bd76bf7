// SPDX-License-Identifier: Apache-2.0
// Neighbours together: things in the order of a space-filling curve (Morton 1966), and a tree of spheres around runs of
// them, so that what is out of sight is passed over by the hundred.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/bounds.h"

namespace forest::scene {

/// Interleaved bits of a place within `bounds`, 21 a coordinate: places that follow one another lie close together.
std::uint64_t morton_code(const Vec3& place, const Bounds& bounds);

/// The smallest sphere around the middle of a box that holds all of it.
Sphere around(const Bounds& box);

/// A tree over some spheres: a leaf is a run of 32 of them in Morton's order, an inner node has eight children that follow one
/// another.
class Groves {
 public:
  static constexpr std::uint32_t in_leaf = 32, children = 8;

  struct Node {
    Sphere sphere;                                   // around all below
    std::uint32_t first = 0, count = 0;              // of members() below; 0 for none
    std::uint32_t first_child = 0, child_count = 0;  // nodes; 0 for a leaf
  };

  Groves() = default;
  explicit Groves(std::span<const Sphere> spheres);

  std::span<const Node> nodes() const { return nodes_; }  // the root first; children come later
  std::span<const std::uint32_t> members() const {
    return members_;
  }  // numbers of spheres, in Morton's order
  /// The nodes with about so many members each, that hold all of them once, in order.
  std::vector<std::uint32_t> parts(std::size_t about) const;

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> members_;
};

}  // namespace forest::scene
