// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

namespace forest::statistics {
namespace {

using Vector = Eigen::Vector3d;
using Index = std::uint32_t;
constexpr Index none = ~Index(0);

struct Face {
  std::array<Index, 3> corners;                          // counterclockwise seen from outside
  std::array<Index, 3> neighbours = {none, none, none};  // beyond the edge from corner i to corner i + 1
  Vector normal = Vector::Zero();
  double offset = 0.;
  Index outside = none;  // first of the points above this face; they are a list (Quickhull::next_)
  bool alive = true, seen = false;

  double above(const Vector& p) const { return normal.dot(p) - offset; }
};

class Quickhull {
 public:
  Quickhull(std::span<const Vector> points, double tolerance)
      : points_(points), tolerance_(tolerance), next_(points.size(), none) {}

  /// None when rounding has made a hole in the hull; a greater tolerance helps.
  std::optional<Hull> run() {
    if (!begin()) return Hull{everything(), 0.};
    while (!pending_.empty()) {
      const Index face = pending_.back();
      pending_.pop_back();
      if (faces_[face].alive && faces_[face].outside != none && !grow(face)) return std::nullopt;
    }
    return result();
  }

 private:
  std::vector<Index> everything() const {
    std::vector<Index> all(points_.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  Index add(Index a, Index b, Index c) {
    Face face{.corners = {a, b, c}};
    face.normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]);
    if (const double size = face.normal.norm(); size > 0.) face.normal /= size;
    face.offset = face.normal.dot(points_[a]);
    faces_.push_back(face);
    return Index(faces_.size() - 1);
  }

  /// The point that `measure` is greatest of.
  template <class Measure>
  Index furthest(Measure measure) const {
    Index best = 0;
    double most = -1.;
    for (Index i = 0; i < points_.size(); ++i)
      if (const double m = measure(points_[i]); m > most) most = m, best = i;
    return best;
  }

  /// A tetrahedron of points far from one another, and every point below one of its faces or in the list of one. False when
  /// the points lie in one plane.
  bool begin() {
    if (points_.size() < 4) return false;
    Index a = 0, b = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto less = [axis](const Vector& u, const Vector& v) { return u[axis] < v[axis]; };
      const auto [low, high] = std::minmax_element(points_.begin(), points_.end(), less);
      if ((*high)[axis] - (*low)[axis] > (points_[b] - points_[a]).norm())
        a = Index(low - points_.begin()), b = Index(high - points_.begin());
    }
    const Vector line = (points_[b] - points_[a]).normalized();
    Index c = furthest([&](const Vector& p) { return (p - points_[a]).cross(line).squaredNorm(); });
    if ((points_[c] - points_[a]).cross(line).norm() <= tolerance_) return false;
    const Vector normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]).normalized();
    const Index d = furthest([&](const Vector& p) { return std::abs((p - points_[a]).dot(normal)); });
    const double height = (points_[d] - points_[a]).dot(normal);
    if (std::abs(height) <= tolerance_) return false;
    if (height > 0.) std::swap(b, c);

    add(a, b, c), add(a, d, b), add(b, d, c), add(c, d, a);
    for (Face& face : faces_)
      for (int edge = 0; edge < 3; ++edge)
        for (Index other = 0; other < 4; ++other)
          if (edge_of(faces_[other], face.corners[(edge + 1) % 3], face.corners[edge]) >= 0)
            face.neighbours[edge] = other;
    const std::array<Index, 4> all{0, 1, 2, 3};
    for (Index p = 0; p < points_.size(); ++p) place(p, all);
    for (const Index face : all) pending_.push_back(face);
    return true;
  }

  static int edge_of(const Face& face, Index from, Index to) {
    for (int edge = 0; edge < 3; ++edge)
      if (face.corners[edge] == from && face.corners[(edge + 1) % 3] == to) return edge;
    return -1;
  }

  /// Into the list of the first of these faces that it is above.
  void place(Index point, std::span<const Index> faces) {
    for (const Index face : faces)
      if (faces_[face].above(points_[point]) > tolerance_) {
        next_[point] = std::exchange(faces_[face].outside, point);
        return;
      }
  }

  /// The furthest point above a face becomes a corner: the faces that it sees are replaced by those between it and their rim.
  bool grow(Index from) {
    Index eye = faces_[from].outside;
    for (Index p = next_[eye]; p != none; p = next_[p])
      if (faces_[from].above(points_[p]) > faces_[from].above(points_[eye])) eye = p;

    visible_.clear(), rim_.clear(), walk_.clear(), fresh_.clear();
    faces_[from].seen = true;
    visible_.push_back(from);
    walk_.push_back({from, 0, 0});
    while (
        !walk_
             .empty()) {  // around each face, from the edge that it was entered by, so that the rim is in order
      auto& [face, entered, turned] = walk_.back();
      if (turned == 3) {
        walk_.pop_back();
        continue;
      }
      const Index here = face;
      const int edge = (entered + turned++) % 3;
      const Index beyond = faces_[here].neighbours[edge];
      if (faces_[beyond].seen) continue;
      if (faces_[beyond].above(points_[eye]) > tolerance_) {
        faces_[beyond].seen = true;
        visible_.push_back(beyond);
        const int back =
            edge_of(faces_[beyond], faces_[here].corners[(edge + 1) % 3], faces_[here].corners[edge]);
        if (back < 0) return false;
        walk_.push_back({beyond, back, 0});
      } else {
        rim_.push_back({here, edge});
      }
    }
    if (rim_.size() < 3) return false;

    for (const auto& [face, edge] : rim_) {
      const Index a = faces_[face].corners[edge], b = faces_[face].corners[(edge + 1) % 3],
                  beyond = faces_[face].neighbours[edge];
      const Index fresh = add(a, b, eye);
      faces_[fresh].neighbours[0] = beyond;
      const int back = edge_of(faces_[beyond], b, a);
      if (back < 0) return false;
      faces_[beyond].neighbours[back] = fresh;
      fresh_.push_back(fresh);
    }
    for (std::size_t i = 0; i < fresh_.size(); ++i) {
      Face &here = faces_[fresh_[i]], &after = faces_[fresh_[(i + 1) % fresh_.size()]];
      if (here.corners[1] != after.corners[0]) return false;
      here.neighbours[1] = fresh_[(i + 1) % fresh_.size()];
      after.neighbours[2] = fresh_[i];
    }
    for (const Index face : visible_) {
      faces_[face].alive = false;
      for (Index p = faces_[face].outside; p != none;) {
        const Index following = next_[p];
        if (p != eye) place(p, fresh_);
        p = following;
      }
    }
    for (const Index face : fresh_)
      if (faces_[face].outside != none) pending_.push_back(face);
    return true;
  }

  Hull result() const {
    Hull hull;
    const Vector& origin = points_[faces_.back().corners[0]];
    for (const Face& face : faces_) {
      if (!face.alive) continue;
      hull.vertices.insert(hull.vertices.end(), face.corners.begin(), face.corners.end());
      const Vector a = points_[face.corners[0]] - origin, b = points_[face.corners[1]] - origin,
                   c = points_[face.corners[2]] - origin;
      hull.volume += a.dot(b.cross(c)) / 6.;
    }
    std::ranges::sort(hull.vertices);
    const auto twice = std::ranges::unique(hull.vertices);
    hull.vertices.erase(twice.begin(), twice.end());
    return hull;
  }

  struct Step {
    Index face;
    int entered, turned;  // edges
  };
  std::span<const Vector> points_;
  double tolerance_;
  std::vector<Index> next_;  // of each point, in the list that it is in
  std::vector<Face> faces_;
  std::vector<Index> pending_, visible_, fresh_;
  std::vector<std::pair<Index, int>> rim_;  // edges of visible faces
  std::vector<Step> walk_;
};

}  // namespace

Hull convex_hull(std::span<const Vector> points) {
  double spread = 0.;
  for (const Vector& p : points) spread = std::max(spread, (p - points[0]).lpNorm<Eigen::Infinity>());
  double tolerance = 16. * std::numeric_limits<double>::epsilon() * spread;
  for (int attempt = 0; attempt < 4; ++attempt, tolerance *= 1e3)
    if (auto hull = Quickhull(points, tolerance).run()) return *std::move(hull);
  Hull all{std::vector<Index>(points.size()), std::numeric_limits<double>::quiet_NaN()};
  std::iota(all.vertices.begin(), all.vertices.end(), 0);
  return all;
}

PlanarHull planar_hull(std::vector<Eigen::Vector2d> points) {
  std::ranges::sort(
      points, [](const auto& a, const auto& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  const auto turn = [](const auto& a, const auto& b, const auto& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  };
  std::vector<Eigen::Vector2d> rim;
  for (int side = 0; side < 2; ++side) {  // below from left to right, then above from right to left
    const std::size_t start = rim.size();
    for (const auto& p : points) {
      while (rim.size() >= start + 2 && turn(rim[rim.size() - 2], rim.back(), p) <= 0.) rim.pop_back();
      rim.push_back(p);
    }
    if (!rim.empty()) rim.pop_back();  // where the other side begins
    std::ranges::reverse(points);
  }
  PlanarHull hull;
  std::size_t across = 1;  // the corner furthest from the edge: the greatest distance is between such pairs
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const auto &a = rim[i], &b = rim[(i + 1) % rim.size()];
    hull.perimeter += (b - a).norm();
    hull.area += 0.5 * turn(rim[0], a, b);
    const auto corner = [&](std::size_t k) { return rim[k % rim.size()]; };
    while (turn(a, b, corner(across + 1)) > turn(a, b, corner(across))) ++across;
    hull.diameter = std::max({hull.diameter, (corner(across) - a).norm(), (corner(across) - b).norm()});
  }
  return hull;
}

}  // namespace forest::statistics
