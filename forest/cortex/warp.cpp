// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/warp.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

constexpr std::array side_faces{Face::u0, Face::u1, Face::v0, Face::v1};

// The corners of a side face: at the pia where its parameter is 0 and 1, then at the white matter.
std::array<const Place*, 4> corners_of(const Hexahedron& h, Face face) {
  const int across = axis(face), base = is_far(face) ? 1 << across : 0, along = 1 << (1 - across);
  return {&h.corner(base), &h.corner(base | along), &h.corner(base | 4), &h.corner(base | along | 4)};
}

bool before(const Place& a, const Place& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

// Where a branch is: in which element, at which parameters, and which change of parameters a µm along each of the neuron's axes is.
struct Chart {
  std::uint32_t element = 0;
  Place uvw = Place::Zero();
  Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();
  bool outside = false;  // it left the sheet at its rim
};

double speed(const Hexahedron& h, const Place& uvw, int axis) {
  return linear(h, uvw).jacobian.col(axis).norm();
}

// Through a side face into the neighbour.
void cross(const Sheet& sheet, Chart& chart, Face face, const Junction& junction) {
  const int from = axis(face), to = axis(junction.face);
  Place at = chart.uvw;
  at[from] = is_far(face) ? 1. : 0.;
  const auto inside = [](const Place& t) { return Place(t.cwiseMax(0.).cwiseMin(1.)); };
  Place there;
  const double along = at[1 - from];
  there[to] = is_far(junction.face) ? 1. : 0.;
  there[1 - to] = junction.reversed ? 1. - along : along;
  there[2] = at[2];
  const double here_speed = speed(sheet.elements[chart.element], inside(at), from);
  const double there_speed = speed(sheet.elements[junction.element], inside(there), to);
  // Outwards here is inwards there.
  const double ratio = (is_far(face) != is_far(junction.face) ? 1. : -1.) * here_speed / there_speed;
  Eigen::Matrix3d slope;
  slope.row(to) = ratio * chart.slope.row(from);
  slope.row(1 - to) = (junction.reversed ? -1. : 1.) * chart.slope.row(1 - from);
  slope.row(2) = chart.slope.row(2);
  chart = {junction.element, there, slope, false};
}

// Goes on by a step in µm along the neuron's axes.
void walk(const Sheet& sheet, Chart& chart, Place step) {
  constexpr int most_crossings = 64;
  for (int crossing = 0;; ++crossing) {
    const Place move = chart.slope * step;
    double first = 1.;  // the share of the step until it leaves
    int out = -1;
    if (!chart.outside && crossing < most_crossings)
      for (const Face face : side_faces) {
        const int a = axis(face);
        const double way = is_far(face) ? 1. - chart.uvw[a] : chart.uvw[a],
                     pace = is_far(face) ? move[a] : -move[a];
        if (pace > 0. && way < first * pace) first = std::max(0., way / pace), out = int(face);
      }
    chart.uvw += first * move;
    if (out < 0) return;
    step *= 1. - first;
    const Junction junction =
        sheet.junctions.empty() ? Junction{} : sheet.junctions[chart.element][std::size_t(out)];
    if (junction.element == Junction::nothing)
      chart.outside = true;
    else
      cross(sheet, chart, Face(out), junction);
  }
}

Place place_of(const Sheet& sheet, const Chart& chart, bool below_pia) {
  const Hexahedron& h = sheet.elements[chart.element];
  Place inside = chart.uvw.cwiseMax(0.).cwiseMin(1.), beyond = chart.uvw - inside;
  if (below_pia) beyond[2] = std::max(beyond[2], 0.);
  if (beyond.isZero(0.)) return h.at(inside);
  const Linear here = linear(h, inside);
  return here.at + here.jacobian * beyond;
}

}  // namespace

std::vector<Junctions> junctions(std::span<const Hexahedron> elements) {
  // Faces with the same corners come to stand side by side: sorted by the corner at the pia that is first, then by the others.
  struct Side {
    std::array<const Place*, 4> corners;
    std::uint32_t element;
    std::uint8_t face;
    bool swapped;
  };
  std::vector<Side> sides;
  sides.reserve(4 * elements.size());
  for (std::size_t n = 0; n < elements.size(); ++n)
    for (const Face face : side_faces) {
      auto c = corners_of(elements[n], face);
      const bool swapped = before(*c[1], *c[0]);
      if (swapped) c = {c[1], c[0], c[3], c[2]};
      sides.push_back({c, std::uint32_t(n), std::uint8_t(face), swapped});
    }
  const auto same = [](const Side& a, const Side& b) {
    for (std::size_t i = 0; i < 4; ++i)
      if (*a.corners[i] != *b.corners[i]) return false;
    return true;
  };
  std::ranges::sort(sides, [](const Side& a, const Side& b) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (before(*a.corners[i], *b.corners[i])) return true;
      if (before(*b.corners[i], *a.corners[i])) return false;
    }
    return std::pair(a.element, a.face) < std::pair(b.element, b.face);
  });
  std::vector<Junctions> result(elements.size());
  for (std::size_t n = 0; n + 1 < sides.size(); ++n) {
    const Side &a = sides[n], &b = sides[n + 1];
    if (!same(a, b)) continue;
    if (n + 2 < sides.size() && same(b, sides[n + 2]))
      throw Error(fmt::format(
          "a side face of element {} belongs to more than two elements; build the elements anew", a.element));
    const bool reversed = a.swapped != b.swapped;
    result[a.element][a.face] = {b.element, Face(b.face), reversed};
    result[b.element][b.face] = {a.element, Face(a.face), reversed};
  }
  return result;
}

Eigen::Matrix3d axes(const Sheet& sheet, const Seat& seat) {
  return axes(sheet.elements[seat.element].jacobian(seat.uvw), seat.turn);
}

Eigen::Matrix3d axes(const Eigen::Matrix3d& j, double turn) {
  const Place up = -j.col(2).normalized(), along = j.col(0) - j.col(0).dot(up) * up;
  Eigen::Matrix3d r;
  r.col(1) = up;
  r.col(0) = Eigen::AngleAxisd(turn, up) * along.normalized();
  r.col(2) = r.col(0).cross(up);
  return r;
}

Warped warp(const Sheet& sheet, const Seat& seat, std::span<const Place> points,
            std::span<const std::int32_t> parents, const WarpOptions& options) {
  if (seat.element >= sheet.elements.size())
    throw Error(fmt::format("a soma is to sit in element {}, of which there are {}", seat.element,
                            sheet.elements.size()));
  if (!(seat.uvw.minCoeff() >= 0. && seat.uvw.maxCoeff() <= 1.))
    throw Error(fmt::format("a soma is to sit at (u, v, w) = ({:g}, {:g}, {:g}); give numbers from 0 to 1",
                            seat.uvw[0], seat.uvw[1], seat.uvw[2]));
  if (!sheet.junctions.empty() && sheet.junctions.size() != sheet.elements.size())
    throw Error(fmt::format("{} elements were given the junctions of {}", sheet.elements.size(),
                            sheet.junctions.size()));
  if (parents.size() != points.size())
    throw Error(fmt::format("{} points were given {} parents; give one each", points.size(), parents.size()));
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (!points[n].allFinite())
      throw Error(fmt::format("point {} of a neuron is not a number; correct it", n));
    if (parents[n] < -1 || parents[n] >= std::int64_t(n))
      throw Error(fmt::format("point {} of a neuron has the parent {}; parents come before their children", n,
                              parents[n]));
  }
  const Linear soma = linear(sheet.elements[seat.element], seat.uvw);
  const Eigen::Matrix3d r = axes(sheet, seat);
  const Chart root{seat.element, seat.uvw, soma.jacobian.inverse() * r, false};
  if (!root.slope.allFinite())
    throw Error(
        fmt::format("element {} is flat where a soma is to sit; certify the elements first", seat.element));

  Warped result;
  result.points.resize(points.size());
  std::vector<Chart> charts(points.size());
  Distortion& d = result.distortion;
  double turns = 0.;
  std::size_t turned = 0;
  const auto angle = [](const Place& a, const Place& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180. / std::numbers::pi;
  };
  for (std::size_t n = 0; n < points.size(); ++n) {
    const bool stem = parents[n] < 0;
    const auto parent = std::size_t(std::max(parents[n], 0));
    charts[n] = stem ? root : charts[parent];
    const Place step = points[n] - (stem ? Place(Place::Zero()) : points[parent]);
    walk(sheet, charts[n], step);
    result.points[n] =
        options.rigid ? Place(soma.at + r * points[n]) : place_of(sheet, charts[n], options.below_pia);
    if (stem) continue;  // from the soma's middle to its surface there is no branch
    const Place bent = result.points[n] - result.points[parent];
    const double before = step.norm(), after = bent.norm();
    d.straight_length += before;
    d.length += after;
    if (before > 0.) {
      d.shortest = std::min(d.shortest, after / before);
      d.longest = std::max(d.longest, after / before);
    }
    if (charts[n].uvw[2] < 0. && !options.below_pia) d.beyond_pia += after;
    if (charts[n].uvw[2] > 1.) d.beyond_white += after;
    if (charts[n].outside) d.beside += after;
    if (parents[parent] < 0) continue;
    const auto grandparent = std::size_t(parents[parent]);
    const Place step_before = points[parent] - points[grandparent],
                bent_before = result.points[parent] - result.points[grandparent];
    if (!(before > 0.) || step_before.isZero(0.)) continue;
    const double change = std::abs(angle(bent_before, bent) - angle(step_before, step));
    turns += change;
    ++turned;
    d.largest_turn = std::max(d.largest_turn, change);
  }
  if (turned) d.mean_turn = turns / double(turned);
  return result;
}

}  // namespace forest::cortex
