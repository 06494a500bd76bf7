// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/self_intersection.h"

#include <algorithm>
#include <array>

#include "forest/core/parallel.h"
#include "forest/geometry/triangle_tree.h"

namespace forest {
namespace {

using Point = Eigen::Vector3d;

std::array<Point, 3> corners(const Mesh& mesh, std::uint32_t t) {
  std::array<Point, 3> result;
  for (std::size_t k = 0; k < 3; ++k) result[k] = mesh.positions[mesh.triangles[t][k]].cast<double>();
  return result;
}

// Six times the volume of a tetrahedron: on which side of a triangle a point lies.
double side(const Point& a, const Point& b, const Point& c, const Point& d) {
  return (b - a).cross(c - a).dot(d - a);
}

// Where the edge p–q goes through the inner of a triangle.
std::optional<Point> pierced(const Point& p, const Point& q, const std::array<Point, 3>& t) {
  const double below = side(t[0], t[1], t[2], p), above = side(t[0], t[1], t[2], q);
  if (!((below < 0. && above > 0.) || (below > 0. && above < 0.))) return {};
  const double u = side(p, q, t[0], t[1]), v = side(p, q, t[1], t[2]), w = side(p, q, t[2], t[0]);
  if (!((u > 0. && v > 0. && w > 0.) || (u < 0. && v < 0. && w < 0.))) return {};
  return p + below / (below - above) * (q - p);
}

std::optional<Point> cut(const Mesh& mesh, std::uint32_t a, std::uint32_t b) {
  for (const std::uint32_t i : mesh.triangles[a])
    for (const std::uint32_t j : mesh.triangles[b])
      if (i == j) return {};
  const auto s = corners(mesh, a), t = corners(mesh, b);
  for (std::size_t k = 0; k < 3; ++k) {
    if (const auto point = pierced(s[k], s[(k + 1) % 3], t)) return point;
    if (const auto point = pierced(t[k], t[(k + 1) % 3], s)) return point;
  }
  return {};
}

// Those whose boxes may touch that of triangle t, in ascending order.
std::vector<std::uint32_t> around(const TriangleTree& tree, const Mesh& mesh, std::uint32_t t) {
  const auto corner = corners(mesh, t);
  std::vector<std::uint32_t> found;
  tree.for_overlapping(corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]),
                       corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]),
                       [&](std::uint32_t other) { found.push_back(other); });
  std::ranges::sort(found);
  return found;
}

}  // namespace

std::optional<SelfIntersection> self_intersection(const Mesh& mesh) {
  const TriangleTree tree(mesh);
  const std::size_t count = mesh.triangles.size();
  constexpr std::size_t block = 1024;  // looked at in turn, so that the first pair is found soon
  for (std::size_t begin = 0; begin < count; begin += 64 * block) {
    const std::size_t blocks = (std::min(count - begin, 64 * block) + block - 1) / block;
    std::vector<std::optional<SelfIntersection>> found(blocks);
    parallel_for(blocks, 1, [&](std::size_t b) {
      const std::size_t from = begin + b * block, to = std::min(count, from + block);
      for (std::size_t t = from; t < to && !found[b]; ++t) {
        const auto a = std::uint32_t(t);
        for (const std::uint32_t other : around(tree, mesh, a))
          if (other > a)
            if (const auto point = cut(mesh, a, other)) {
              found[b] = SelfIntersection{a, other, *point};
              break;
            }
      }
    });
    for (const auto& one : found)
      if (one) return one;
  }
  return {};
}

std::size_t count_cut_triangles(const Mesh& mesh) {
  const TriangleTree tree(mesh);
  std::vector<std::uint8_t> is_cut(mesh.triangles.size(), 0);
  parallel_for(mesh.triangles.size(), 256, [&](std::size_t t) {
    const auto a = std::uint32_t(t);
    for (const std::uint32_t other : around(tree, mesh, a))
      if (other != a && cut(mesh, a, other)) {
        is_cut[t] = 1;
        break;
      }
  });
  return std::size_t(std::ranges::count(is_cut, 1));
}

}  // namespace forest
