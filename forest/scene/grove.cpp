// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/grove.h"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

// Bit i goes to bit 3 i.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

// Around the middle of the box around some spheres, as tight as that allows.
Sphere enclosing(auto&& spheres) {
  Bounds box;
  for (const Sphere& s : spheres) box.add(s.centre, s.radius);
  Sphere all{box.centre()};
  for (const Sphere& s : spheres)
    all.radius = std::max(all.radius, 1.0001f * (s.centre - all.centre).norm() + s.radius);
  return all;
}

}  // namespace

std::uint64_t morton_code(const Vec3& place, const Bounds& bounds) {
  const float scale = 2097151.f / std::max(bounds.extent().maxCoeff(), 1e-6f);
  std::uint64_t code = 0;
  for (int i = 0; i < 3; ++i)
    code |= spread(std::uint64_t(std::clamp((place[i] - bounds.low[i]) * scale, 0.f, 2097151.f))) << i;
  return code;
}

Sphere around(const Bounds& box) { return {box.centre(), .5001f * box.extent().norm()}; }

Groves::Groves(std::span<const Sphere> spheres) : members_(spheres.size()) {
  if (spheres.empty()) return;
  Bounds middles;
  for (const Sphere& s : spheres) middles.add(s.centre);
  std::vector<Keyed> order(spheres.size());
  parallel_for(order.size(), 4096, [&](std::size_t i) {
    order[i] = {morton_code(spheres[i].centre, middles), i};
  });
  parallel_sort(order);
  parallel_for(order.size(), 4096, [&](std::size_t i) { members_[i] = std::uint32_t(order[i].second); });

  // Levels from the leaves up, then turned around.
  std::vector<std::vector<Node>> levels;
  std::vector<Node> leaves((spheres.size() + in_leaf - 1) / in_leaf);
  parallel_for(leaves.size(), 64, [&](std::size_t n) {
    Node& leaf = leaves[n];
    leaf.first = std::uint32_t(n) * in_leaf;
    leaf.count = std::min(in_leaf, std::uint32_t(spheres.size()) - leaf.first);
    leaf.sphere =
        enclosing(std::span(members_).subspan(leaf.first, leaf.count) |
                  std::views::transform([&](std::uint32_t i) -> const Sphere& { return spheres[i]; }));
  });
  levels.push_back(std::move(leaves));
  while (levels.back().size() > 1) {
    const std::vector<Node>& below = levels.back();
    std::vector<Node> above((below.size() + children - 1) / children);
    for (std::size_t n = 0; n < above.size(); ++n) {
      Node& node = above[n];
      node.first_child = std::uint32_t(n) * children;
      node.child_count = std::min(children, std::uint32_t(below.size()) - node.first_child);
      const std::span<const Node> own = std::span(below).subspan(node.first_child, node.child_count);
      node.first = own.front().first, node.count = own.back().first + own.back().count - node.first;
      node.sphere = enclosing(own | std::views::transform(&Node::sphere));
    }
    levels.push_back(std::move(above));
  }
  for (std::size_t level = levels.size(); level-- > 0;) {
    const auto below = std::uint32_t(nodes_.size() + levels[level].size());
    for (Node node : levels[level]) {
      if (node.child_count) node.first_child += below;
      nodes_.push_back(node);
    }
  }
}

std::vector<std::uint32_t> Groves::parts(std::size_t about) const {
  std::vector<std::uint32_t> parts;
  std::vector<std::uint32_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    open.pop_back();
    const Node& node = nodes_[at];
    if (node.count <= about || !node.child_count)
      parts.push_back(at);
    else
      for (std::uint32_t c = node.child_count; c-- > 0;) open.push_back(node.first_child + c);
  }
  return parts;
}

}  // namespace forest::scene
