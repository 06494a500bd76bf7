// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/cross_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace forest {
namespace {

// Nodes and weights of Gauss & Legendre on [-1, 1] with 10 points, the positive half.
constexpr std::array<std::array<double, 2>, 5> gauss{{{.1488743389816312, .2955242247147529},
                                                      {.4333953941292472, .2692667193099963},
                                                      {.6794095682990244, .2190863625159820},
                                                      {.8650633666889845, .1494513491505806},
                                                      {.9739065285171717, .0666713443086881}}};

double cross(const Place& a, const Place& b) { return a.x() * b.y() - a.y() * b.x(); }

// The part of the edge p–q inside a convex polygon, as shares of it; empty when first >= second. What runs along one of the
// polygon's own edges in its direction counts as inside when `closed`, against it never: such edges bound both.
std::pair<double, double> inside(const Place& p, const Place& q, const std::vector<Place>& polygon,
                                 bool closed) {
  double from = 0., to = 1.;
  for (std::size_t i = 0; i < polygon.size() && from < to; ++i) {
    const Place& a = polygon[i];
    const Place edge = polygon[(i + 1) % polygon.size()] - a;
    const double at_p = cross(edge, p - a), at_q = cross(edge, q - a);  // positive inside
    if (at_p == at_q) {
      if (at_p < 0. || (at_p == 0. && (!closed || edge.dot(q - p) < 0.))) return {0., 0.};
    } else if (at_p < at_q) {
      from = std::max(from, at_p / (at_p - at_q));
    } else {
      to = std::min(to, at_p / (at_p - at_q));
    }
  }
  return {from, to};
}

struct Box {
  Place low, high;
  Box(const Place& p, const Place& q) : low(p.cwiseMin(q)), high(p.cwiseMax(q)) {}
  explicit Box(const std::vector<Place>& polygon) : low(polygon[0]), high(polygon[0]) {
    for (const Place& p : polygon) low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  bool meets(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

}  // namespace

double CrossSection::Piece::half_width(double x) const {
  return std::sqrt(std::max(0., k0 + x * (k1 + x * k2)));
}

std::optional<CrossSection> CrossSection::of(const RoundConed& cone, const Plane& plane) {
  using Vector = Eigen::Vector3d;
  const Vector origin = plane.origin.cast<double>(), normal = plane.normal.cast<double>().normalized();
  const Vector right = plane.right.cast<double>(), up = plane.up.cast<double>();
  const auto place = [&](const Vector& v) { return Place(right.dot(v), up.dot(v)); };
  RoundConed c = cone;
  double length = (c.b - c.a).norm();
  if (length <= std::abs(c.radius_a - c.radius_b)) {  // one sphere within the other
    if (c.radius_a < c.radius_b) c.a = c.b, c.radius_a = c.radius_b;
    c.b = c.a, c.radius_b = c.radius_a, length = 0.;
  }
  const double height = normal.dot(c.a - origin), rise = normal.dot(c.b - c.a);
  const double radius = c.radius_a, growth = c.radius_b - c.radius_a;
  // The squared radius of the disc at a share s of the axis: A + B s + C s².
  const double A = radius * radius - height * height, B = 2. * (radius * growth - height * rise),
               C = growth * growth - rise * rise;
  const auto squared = [&](double s) { return A + s * (B + s * C); };

  CrossSection section;
  section.origin_ = place(c.a - origin);
  const Place way = place(c.b - c.a);
  const double reach = way.norm();
  const auto disc = [&](double centre, double r2, double from, double to) {
    const double r = std::sqrt(std::max(0., r2));
    from = std::max(from, centre - r), to = std::min(to, centre + r);
    if (to > from) section.pieces_.push_back({from, to, r2 - centre * centre, 2. * centre, -1.});
  };
  if (reach <= 1e-9 * length || length == 0.) {  // seen along the axis: the widest of the discs
    double widest = std::max(A, squared(1.));
    if (C < 0. && -B / (2. * C) > 0. && -B / (2. * C) < 1.) widest = std::max(widest, squared(-B / (2. * C)));
    disc(0., widest, -INFINITY, INFINITY);
  } else {
    section.along_ = way / reach;
    // The disc at s touches its neighbours' envelope at x = reach s - (B + 2 C s) / (2 reach).
    const double step = reach - C / reach, start = -B / (2. * reach);
    disc(0., A, -INFINITY, start);
    // There s = (x - start) / step, and half the width squared is A + B s + C s² - ((B + 2 C s) / (2 reach))².
    const double q0 = A - start * start, q1 = B - B * C / (reach * reach), q2 = C - C * C / (reach * reach);
    std::array<double, 4> ends{0., 1.};
    std::size_t count = 2;
    const double under = q1 * q1 - 4. * q2 * q0;
    if (under > 0.) {
      const double z = -.5 * (q1 + std::copysign(std::sqrt(under), q1));
      for (const double root : {q2 != 0. ? z / q2 : -1., z != 0. ? q0 / z : -1.})
        if (root > 0. && root < 1.) ends[count++] = root;
    }
    std::sort(ends.begin(), ends.begin() + std::ptrdiff_t(count));
    const double k2 = q2 / (step * step), k1 = q1 / step - 2. * k2 * start,
                 k0 = q0 - q1 * start / step + k2 * start * start;
    for (std::size_t i = 1; i < count; ++i) {
      const double middle = .5 * (ends[i - 1] + ends[i]);
      if (ends[i] > ends[i - 1] && q0 + middle * (q1 + middle * q2) > 0.)
        section.pieces_.push_back({start + ends[i - 1] * step, start + ends[i] * step, k0, k1, k2});
    }
    const double stop = start + step;
    disc(reach, squared(1.), stop, INFINITY);
  }
  if (section.pieces_.empty()) return {};
  return section;
}

// With x = middle - half cos t the root at an end becomes a sine, and the integrand smooth.
double CrossSection::area() const {
  constexpr int parts = 4;
  double sum = 0.;
  for (const Piece& p : pieces_) {
    const double middle = .5 * (p.from + p.to), half = .5 * (p.to - p.from);
    for (int k = 0; k < parts; ++k)
      for (const auto& [node, weight] : gauss)
        for (const double sign : {-1., 1.}) {
          const double t = std::numbers::pi / parts * (k + .5 + .5 * sign * node);
          sum += weight * .5 * std::numbers::pi / parts * 2. * half * std::sin(t) *
                 p.half_width(middle - half * std::cos(t));
        }
  }
  return sum;
}

std::vector<Place> CrossSection::outline(double tolerance, double share) const {
  const double width = pieces_.back().to - pieces_.front().from;
  double high = 0.;
  for (const Piece& p : pieces_)
    for (const double x : {p.from, p.to, std::clamp(p.k2 != 0. ? -p.k1 / (2. * p.k2) : p.from, p.from, p.to)})
      high = std::max(high, p.half_width(x));
  const double near = std::max(std::min(tolerance, share * std::min(width, 2. * high)), 1e-9);
  // The lower half from left to right; the upper one mirrors it.
  std::vector<Place> lower;
  for (const Piece& p : pieces_) {
    const double middle = .5 * (p.from + p.to), half = .5 * (p.to - p.from);
    const auto at = [&](double t) {
      const double x = middle - half * std::cos(t);
      return Place(x, -p.half_width(x));
    };
    // How far the contour bulges over chords of a first number of steps; it falls with the square of their number.
    constexpr int first = 12;
    double worst = 0.;
    for (int i = 0; i < first; ++i) {
      const Place a = at(std::numbers::pi * i / first), b = at(std::numbers::pi * (i + 1) / first),
                  between = at(std::numbers::pi * (i + .5) / first);
      worst = std::max(worst, std::abs(cross(b - a, between - a)) / std::max((b - a).norm(), 1e-300));
    }
    const int steps = int(std::clamp(std::ceil(1.1 * first * std::sqrt(worst / near)), 2., 1024.));
    for (int i = lower.empty() ? 0 : 1; i <= steps; ++i) lower.push_back(at(std::numbers::pi * i / steps));
  }
  std::vector<Place> outline;
  const Place across(-along_.y(), along_.x());
  const auto add = [&](const Place& p) {
    const Place here = origin_ + p.x() * along_ + p.y() * across;
    if (outline.empty() || (here - outline.back()).squaredNorm() > 1e-24) outline.push_back(here);
  };
  for (const Place& p : lower) add(p);
  for (auto p = lower.rbegin(); p != lower.rend(); ++p) add({p->x(), -p->y()});
  while (outline.size() > 3 && (outline.front() - outline.back()).squaredNorm() <= 1e-24) outline.pop_back();
  return outline;
}

std::vector<std::pair<Place, Place>> boundary_of_union(std::span<const std::vector<Place>> polygons) {
  std::vector<Box> boxes;
  for (const auto& polygon : polygons) boxes.emplace_back(polygon);
  std::vector<std::pair<Place, Place>> boundary;
  std::vector<std::pair<double, double>> hidden;
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    near.clear();
    for (std::size_t j = 0; j < polygons.size(); ++j)
      if (j != i && boxes[i].meets(boxes[j])) near.push_back(j);
    for (std::size_t k = 0; k < polygons[i].size(); ++k) {
      const Place &p = polygons[i][k], &q = polygons[i][(k + 1) % polygons[i].size()];
      hidden.clear();
      const Box edge(p, q);
      for (const std::size_t j : near) {  // of two edges that lie upon one another the first bounds
        if (!edge.meets(boxes[j])) continue;
        if (const auto part = inside(p, q, polygons[j], j < i); part.first < part.second)
          hidden.push_back(part);
      }
      std::ranges::sort(hidden);
      double from = 0.;
      for (const auto& [begin, end] : hidden) {
        if (begin > from) boundary.emplace_back(p + from * (q - p), p + begin * (q - p));
        from = std::max(from, end);
      }
      if (from < 1.) boundary.emplace_back(p + from * (q - p), q);
    }
  }
  return boundary;
}

double area_of_union(std::span<const std::vector<Place>> polygons) {
  if (polygons.empty()) return 0.;
  const Place origin = polygons[0][0];  // near by: areas are small, and places far from zero
  double sum = 0.;
  for (const auto& [p, q] : boundary_of_union(polygons)) sum += .5 * cross(p - origin, q - origin);
  return sum;
}

}  // namespace forest
