// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace forest {
namespace {

using Place = TriangleTree::Place;
constexpr std::uint32_t leaf = 4;

// Ericson (2005), "Real-time collision detection", 5.1.5: by the region of the plane that the place lies over.
Place nearest_on(const Place& p, const Place& a, const Place& b, const Place& c) {
  const Place ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0. && d2 <= 0.) return a;
  const Place bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0. && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0. && d1 >= 0. && d3 <= 0.) return a + ab * (d1 / (d1 - d3));
  const Place cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0. && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0. && d2 >= 0. && d6 <= 0.) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0. && d4 - d3 >= 0. && d5 - d6 >= 0.) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double all = va + vb + vc;
  return all > 0. ? Place(a + ab * (vb / all) + ac * (vc / all)) : a;
}

// Möller & Trumbore (1997), both sides: the share of the way, or above 1.
double share_to(const Place& from, const Place& way, const Place& a, const Place& b, const Place& c) {
  constexpr double none = 2.;
  const Place e1 = b - a, e2 = c - a, h = way.cross(e2);
  const double det = e1.dot(h);
  if (det == 0.) return none;
  const Place s = from - a;
  const double u = s.dot(h) / det;
  if (!(u >= 0. && u <= 1.)) return none;
  const Place q = s.cross(e1);
  const double v = way.dot(q) / det;
  if (!(v >= 0. && u + v <= 1.)) return none;
  const double t = e2.dot(q) / det;
  return t >= 0. ? t : none;
}

double square_to_box(const Place& p, const Place& low, const Place& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.).squaredNorm();
}

}  // namespace

Eigen::Vector3d barycentric(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                            const Eigen::Vector3d& at) {
  const Eigen::Vector3d across = (b - a).cross(c - a);
  const double square = across.squaredNorm();
  if (!(square > 0.)) return {1., 0., 0.};
  Eigen::Vector3d w((b - at).cross(c - at).dot(across) / square, (c - at).cross(a - at).dot(across) / square,
                    0.);
  w = w.cwiseMax(0.), w[2] = std::max(0., 1. - w[0] - w[1]);
  return w / w.sum();
}

TriangleTree::TriangleTree(const Mesh& mesh) : triangles_(mesh.triangles), order_(mesh.triangles.size()) {
  positions_.reserve(mesh.positions.size());
  for (const Vec3& p : mesh.positions) positions_.push_back(p.cast<double>());
  std::iota(order_.begin(), order_.end(), 0u);
  if (order_.empty()) return;
  std::vector<Place> centres;
  centres.reserve(triangles_.size());
  for (const Triangle& t : triangles_)
    centres.push_back((positions_[t[0]] + positions_[t[1]] + positions_[t[2]]) / 3.);
  nodes_.reserve(order_.size());
  nodes_.emplace_back();
  build(0, 0, std::uint32_t(order_.size()), centres);
}

void TriangleTree::build(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
                         const std::vector<Place>& centres) {
  Place low = Place::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Place centre_low = low, centre_high = high;
  for (std::uint32_t i = begin; i < end; ++i) {
    for (const std::uint32_t corner : triangles_[order_[i]])
      low = low.cwiseMin(positions_[corner]), high = high.cwiseMax(positions_[corner]);
    centre_low = centre_low.cwiseMin(centres[order_[i]]),
    centre_high = centre_high.cwiseMax(centres[order_[i]]);
  }
  nodes_[node].low = low, nodes_[node].high = high;
  if (end - begin <= leaf) {
    nodes_[node].first = begin, nodes_[node].count = end - begin;
    return;
  }
  int axis = 0;
  (centre_high - centre_low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
                   });
  const auto children = std::uint32_t(nodes_.size());
  nodes_[node].first = children;
  nodes_.emplace_back(), nodes_.emplace_back();
  build(children, begin, middle, centres);
  build(children + 1, middle, end, centres);
}

std::optional<TriangleTree::Hit> TriangleTree::nearest(const Place& to, double within) const {
  std::optional<Hit> best;
  if (nodes_.empty()) return best;
  double square = within * within;
  std::array<std::pair<double, std::uint32_t>, 96> stack;
  std::size_t depth = 0;
  stack[depth++] = {square_to_box(to, nodes_[0].low, nodes_[0].high), 0};
  while (depth > 0) {
    const auto [least, index] = stack[--depth];
    if (least >= square) continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      std::pair<double, std::uint32_t> near{
          square_to_box(to, nodes_[node.first].low, nodes_[node.first].high), node.first};
      std::pair<double, std::uint32_t> far{
          square_to_box(to, nodes_[node.first + 1].low, nodes_[node.first + 1].high), node.first + 1};
      if (far.first < near.first) std::swap(near, far);
      stack[depth++] = far, stack[depth++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[order_[i]];
      const Place at = nearest_on(to, positions_[t[0]], positions_[t[1]], positions_[t[2]]);
      const double d = (at - to).squaredNorm();
      if (d < square) square = d, best = Hit{order_[i], at, std::sqrt(d)};
    }
  }
  return best;
}

std::optional<TriangleTree::Hit> TriangleTree::first(const Place& from, const Place& to) const {
  std::optional<Hit> best;
  if (nodes_.empty()) return best;
  const Place way = to - from, inverse = way.cwiseInverse();
  double share = 1.;
  const auto enters =
      [&](const Node& node) {  // the share of the way at which it enters the box, or above `share`
        double in = 0., out = share;
        for (int k = 0; k < 3; ++k) {
          if (way[k] == 0.) {
            if (from[k] < node.low[k] || from[k] > node.high[k]) return 2.;
            continue;
          }
          double a = (node.low[k] - from[k]) * inverse[k], b = (node.high[k] - from[k]) * inverse[k];
          if (a > b) std::swap(a, b);
          in = std::max(in, a), out = std::min(out, b);
        }
        return in <= out * (1. + 1e-12) ? in : 2.;
      };
  std::array<std::uint32_t, 96> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (enters(node) > share) continue;
    if (node.count == 0) {
      stack[depth++] = node.first, stack[depth++] = node.first + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[order_[i]];
      const double at = share_to(from, way, positions_[t[0]], positions_[t[1]], positions_[t[2]]);
      if (at < share || (at == share && !best))
        share = at, best = Hit{order_[i], from + at * way, at * way.norm()};
    }
  }
  return best;
}

bool TriangleTree::encloses(const Place& place) const {
  if (nodes_.empty()) return false;
  const Place across = nodes_[0].high - nodes_[0].low;
  // In no special direction, so that it meets no edge.
  const Place far =
      place + 2. * (across.norm() + (place - nodes_[0].low).norm()) * Place(.5377, .3141, .7823).normalized();
  const double step = 1e-9 * across.norm();
  int inside = 0;
  Place from = place;
  while (const auto hit = first(from, far)) {
    inside += normal(hit->triangle).dot(far - place) > 0. ? 1 : -1;
    from = hit->at + step * (far - place).normalized();
  }
  return inside > 0;
}

Place TriangleTree::normal(std::uint32_t triangle) const {
  const Triangle& t = triangles_[triangle];
  const Place across = (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
  const double length = across.norm();
  return length > 0. ? Place(across / length) : Place::Zero();
}

}  // namespace forest
