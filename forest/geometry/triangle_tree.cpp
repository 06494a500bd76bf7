// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"

namespace forest {
namespace {

using Point = Eigen::Vector3d;

constexpr std::uint32_t leaf_size = 4;

double squared_distance(const Bounds& box, const Point& point) {
  const Point low = box.low.cast<double>(), high = box.high.cast<double>();
  return (point - point.cwiseMax(low).cwiseMin(high)).squaredNorm();
}

bool touch(const Bounds& a, const Bounds& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

std::array<Point, 3> corners(const Mesh& mesh, std::uint32_t t) {
  std::array<Point, 3> result;
  for (std::size_t k = 0; k < 3; ++k) result[k] = mesh.positions[mesh.triangles[t][k]].cast<double>();
  return result;
}

Bounds bounds_of(const Mesh& mesh, std::uint32_t t) {
  Bounds box;
  for (const std::uint32_t corner : mesh.triangles[t]) box.add(mesh.positions[corner]);
  return box;
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

}  // namespace

Point nearest_on_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  const Point ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0. && d2 <= 0.) return a;
  const Point bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0. && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0. && d1 >= 0. && d3 <= 0.) return a + d1 / (d1 - d3) * ab;
  const Point cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0. && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0. && d2 >= 0. && d6 <= 0.) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0. && d4 - d3 >= 0. && d5 - d6 >= 0.) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double sum = va + vb + vc;
  if (!(sum > 0.)) return a;  // the triangle is a line or a point
  return a + vb / sum * ab + vc / sum * ac;
}

TriangleTree::TriangleTree(const Mesh& mesh) : mesh_(mesh) {
  const auto count = std::uint32_t(mesh.triangles.size());
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<Bounds> boxes(count);
  std::vector<Vec3> centres(count);
  for (std::uint32_t t = 0; t < count; ++t) boxes[t] = bounds_of(mesh, t), centres[t] = boxes[t].centre();
  nodes_.reserve(2 * (count / 2 + 1));
  nodes_.emplace_back();
  build(0, 0, count, boxes, centres);
}

void TriangleTree::build(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
                         std::vector<Bounds>& boxes, std::vector<Vec3>& centres) {
  Bounds box, middles;
  for (std::uint32_t i = begin; i < end; ++i) box.add(boxes[order_[i]]), middles.add(centres[order_[i]]);
  nodes_[node].box = box;
  if (end - begin <= leaf_size) {
    nodes_[node].first = begin, nodes_[node].count = end - begin;
    return;
  }
  Eigen::Index axis = 0;
  middles.extent().maxCoeff(&axis);
  const std::uint32_t middle = (begin + end) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
                   });
  const auto children = std::uint32_t(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = children;
  build(children, begin, middle, boxes, centres);
  build(children + 1, middle, end, boxes, centres);
}

std::optional<TriangleTree::Nearest> TriangleTree::nearest(const Point& point, double limit) const {
  if (order_.empty()) return {};
  std::optional<Nearest> best;
  double least = limit * limit;
  std::array<std::pair<double, std::uint32_t>, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = {squared_distance(nodes_[0].box, point), 0};
  while (depth > 0) {
    const auto [distance, index] = stack[--depth];
    if (distance > least) continue;
    const Node& node = nodes_[index];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const auto t = corners(mesh_, order_[i]);
        const Point on = nearest_on_triangle(point, t[0], t[1], t[2]);
        const double squared = (on - point).squaredNorm();
        if (squared < least || (squared == least && (!best || order_[i] < best->triangle)))
          least = squared, best = Nearest{order_[i], on, 0.};
      }
      continue;
    }
    const double a = squared_distance(nodes_[node.first].box, point),
                 b = squared_distance(nodes_[node.first + 1].box, point);
    const bool a_first = a <= b;
    stack[depth++] = {a_first ? b : a, node.first + (a_first ? 1 : 0)};
    stack[depth++] = {a_first ? a : b, node.first + (a_first ? 0 : 1)};
  }
  if (best) best->distance = std::sqrt(least);
  return best;
}

std::vector<std::uint32_t> TriangleTree::within(const Bounds& box) const {
  std::vector<std::uint32_t> found, open;
  if (!order_.empty()) open.push_back(0);
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!touch(node.box, box)) continue;
    if (node.count == 0) {
      open.push_back(node.first), open.push_back(node.first + 1);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (touch(bounds_of(mesh_, order_[i]), box)) found.push_back(order_[i]);
  }
  std::ranges::sort(found);
  return found;
}

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
        for (const std::uint32_t other : tree.within(bounds_of(mesh, a)))
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
    for (const std::uint32_t other : tree.within(bounds_of(mesh, a)))
      if (other != a && cut(mesh, a, other)) {
        is_cut[t] = 1;
        break;
      }
  });
  return std::size_t(std::ranges::count(is_cut, 1));
}

}  // namespace forest
