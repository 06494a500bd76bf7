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
#include "forest/cortex/locate.h"

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

enum class Left : std::uint8_t { no, by_pia, by_white, by_rim };

// Where a branch is.
struct Chart {
  Linear here;           // its place, and the element there
  Eigen::Matrix3d turn;  // how the neuron's axes stand
  Left left = Left::no;
  std::uint32_t element = 0;
  Place uvw;
  Eigen::RowVector3d inwards;  // by how much w grows by a µm along each of the neuron's axes
};

// Where the tissue is as it is in its element at (u, v, w).
Chart settled(const Linear& here, const Eigen::Matrix3d& turn, std::uint32_t element, const Place& uvw) {
  return {here, turn, Left::no, element, uvw, (here.jacobian.inverse() * turn).row(2)};
}

Linear at(const Sheet& sheet, std::uint32_t element, const Place& uvw) {
  return linear(sheet.elements[element], uvw.cwiseMax(0.).cwiseMin(1.));
}

Place up(const Linear& here) { return -here.jacobian.col(2).normalized(); }

// The neuron's axes, carried from one place to the next with the least turn that holds the tissue's axis.
Eigen::Matrix3d carried(const Eigen::Matrix3d& turn, const Linear& from, const Linear& to) {
  return Eigen::Quaterniond::FromTwoVectors(up(from), up(to)).toRotationMatrix() * turn;
}

// The change of parameters of a short way along the neuron's axes: to the sides as far as the tissue is wide there, in w as at the soma.
Place change(const Linear& here, const Eigen::Matrix3d& turn, const Eigen::RowVector3d& inwards,
             const Place& way) {
  Place result = here.jacobian.partialPivLu().solve(turn * way);
  result[2] = inwards.dot(way);
  return result;
}

// Through a side face into the neighbour.
void cross(const Sheet& sheet, Chart& chart, Face face, const Junction& junction) {
  const int from = axis(face), to = axis(junction.face);
  const double along = chart.uvw[1 - from];
  chart.element = junction.element;
  chart.uvw[to] = is_far(junction.face) ? 1. : 0.;
  chart.uvw[1 - to] = junction.reversed ? 1. - along : along;
  chart.here = at(sheet, chart.element, chart.uvw);
}

void come_back(const Sheet& sheet, Chart& chart) {
  const Location found = sheet.locator ? sheet.locator->find(chart.here.at) : Location{};
  if (!found.found()) return;
  const Linear here = linear(sheet.elements[found.element], found.uvw);
  const Chart back = settled(here, chart.turn, found.element, found.uvw);
  if (back.inwards.allFinite()) chart = back;
}

// Goes on by a step in µm along the neuron's axes.
void walk(const Sheet& sheet, Chart& chart, const Place& step, bool below_pia) {
  constexpr double longest = 20.;  // µm at once
  constexpr double slant = 200.;   // µm after which a branch follows the layers
  constexpr int most_crossings = 64;
  double rest = step.norm();
  if (!(rest > 0.)) return;
  const Place heading = step / rest;
  for (int crossing = 0; rest > 0. && chart.left == Left::no;) {
    const double way = std::min(rest, longest);
    const Place half = change(chart.here, chart.turn, chart.inwards, .5 * way * heading);
    const Linear middle = at(sheet, chart.element, chart.uvw + half);
    const Place move = change(middle, carried(chart.turn, chart.here, middle), chart.inwards, way * heading);
    double first = 1.;  // the share of it until it leaves
    int out = -1;
    for (int face = 0; face < 6; ++face) {
      if (below_pia && Face(face) == Face::w0) continue;
      const int a = axis(Face(face));
      const double room = is_far(Face(face)) ? 1. - chart.uvw[a] : chart.uvw[a],
                   pace = is_far(Face(face)) ? move[a] : -move[a];
      if (pace > 0. && room < first * pace) first = std::max(0., room / pace), out = face;
    }
    chart.uvw += first * move;
    rest -= first * way;
    const Linear there = at(sheet, chart.element, chart.uvw);
    chart.turn = carried(chart.turn, chart.here, there), chart.here = there;
    const Eigen::RowVector3d axis_there = up(there).transpose() * chart.turn,
                             upright = chart.inwards.dot(axis_there) * axis_there;
    chart.inwards = upright + std::exp(-first * way / slant) * (chart.inwards - upright);
    if (out < 0) continue;
    const bool side = axis(Face(out)) < 2;
    const Junction junction = side && ++crossing < most_crossings && !sheet.junctions.empty()
                                  ? sheet.junctions[chart.element][std::size_t(out)]
                                  : Junction{};
    if (junction.element != Junction::nothing)
      cross(sheet, chart, Face(out), junction);
    else
      chart.left = side ? Left::by_rim : is_far(Face(out)) ? Left::by_white : Left::by_pia;
  }
  if (chart.left == Left::no) return;
  chart.here.at += rest * (chart.turn * heading);
  come_back(sheet, chart);
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
  const std::span<const Place> traced = options.traced.empty() ? points : options.traced;
  if (traced.size() != points.size())
    throw Error(fmt::format("{} points are told against {}; give one each", points.size(), traced.size()));
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (!points[n].allFinite())
      throw Error(fmt::format("point {} of a neuron is not a number; correct it", n));
    if (parents[n] < -1 || parents[n] >= std::int64_t(n))
      throw Error(fmt::format("point {} of a neuron has the parent {}; parents come before their children", n,
                              parents[n]));
  }
  const Linear soma = linear(sheet.elements[seat.element], seat.uvw);
  const Eigen::Matrix3d r = axes(sheet, seat);
  const Chart root = settled(soma, r, seat.element, seat.uvw);
  if (!root.inwards.allFinite())
    throw Error(
        fmt::format("element {} is flat where a soma is to sit; certify the elements first", seat.element));

  Warped result;
  result.points.resize(points.size());
  std::vector<Chart> charts(points.size(), root);
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
    walk(sheet, charts[n], step, options.below_pia);
    result.points[n] = options.rigid ? Place(soma.at + r * points[n]) : charts[n].here.at;
    if (stem) continue;  // from the soma's middle to its surface there is no branch
    const Place straight = traced[n] - traced[parent], bent = result.points[n] - result.points[parent];
    const double before = straight.norm(), after = bent.norm();
    d.straight_length += before;
    d.length += after;
    if (before > 0.) {
      d.shortest = std::min(d.shortest, after / before);
      d.longest = std::max(d.longest, after / before);
    }
    const Left left = charts[n].left;
    if (left != Left::no)
      (left == Left::by_pia ? d.beyond_pia : left == Left::by_white ? d.beyond_white : d.beside) += after;
    if (parents[parent] < 0) continue;
    const auto grandparent = std::size_t(parents[parent]);
    const Place straight_before = traced[parent] - traced[grandparent],
                bent_before = result.points[parent] - result.points[grandparent];
    if (!(before > 0.) || straight_before.isZero(0.)) continue;
    const double change = std::abs(angle(bent_before, bent) - angle(straight_before, straight));
    turns += change;
    ++turned;
    d.largest_turn = std::max(d.largest_turn, change);
  }
  if (turned) d.mean_turn = turns / double(turned);
  return result;
}

}  // namespace forest::cortex
