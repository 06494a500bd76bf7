// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/w_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace forest::cortex {
namespace {

constexpr double step_share = .5;  // of the spacing of the lattice, and half of that where curves turn
// Nearer to a surface curves turn to the line that meets it at right angles, and then follow it, µm. Over half the radius of the
// disc that normals are of a line's own hardly turns.
constexpr double turning = normal_radius, straight = .5 * normal_radius;
constexpr double touching = .1;  // … surfaces are one
constexpr double longest = 3e4;  // µm; no cortex is a third as thick
constexpr double least_slope =
    1e-5;  // 1/µm, a hundredth of that of a thick cortex; below it the tube would be endless

// The direction, outwards, of the line that meets a surface at right angles and leads through a place, as nearly as is found; where
// banks meet, or the floor of a sulcus is sharp, that is not the way to the nearest place. The surface is `distance` beyond the
// place, or below 0 before it; its normal where the line meets it is `normal(met, direction)`.
template <class Normal>
Place across(const TriangleTree& surface, const Place& at, double distance, Place direction,
             Normal&& normal) {
  constexpr int rounds = 4;
  constexpr double enough = .99985;  // one degree off
  Place best = direction;
  double closest = -1.;
  for (int round = 0; round < rounds; ++round) {
    const auto met = surface.nearest(at + distance * direction, turning);
    if (!met) break;
    const Place there = normal(*met, direction);
    if (const double close = there.dot(direction); close > closest) closest = close, best = direction;
    if (closest > enough) break;
    direction = (direction + there).normalized();
  }
  return best;
}

}  // namespace

double WCurve::length() const {
  double sum = 0.;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

Place WCurve::at(double w) const {
  const double wanted = std::clamp(w, 0., 1.) * volume.back();
  const auto above = std::upper_bound(volume.begin() + 1, volume.end() - 1, wanted);
  const auto i = std::size_t(above - volume.begin());
  const double piece = volume[i] - volume[i - 1];
  const double share = piece > 0. ? (wanted - volume[i - 1]) / piece : 0.;
  return points[i - 1] + std::clamp(share, 0., 1.) * (points[i] - points[i - 1]);
}

Place WCurve::at_length(double share) const {
  double left = std::clamp(share, 0., 1.) * length();
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double piece = (points[i] - points[i - 1]).norm();
    if (left <= piece && piece > 0.) return points[i - 1] + left / piece * (points[i] - points[i - 1]);
    left -= piece;
  }
  return points.back();
}

EndAngles end_angles(const WCurve& curve, const SurfaceTrees& surfaces) {
  constexpr double piece = 150.;  // µm
  const auto between = [](const TriangleTree& surface, const Place& end, const Place& outwards) {
    return degrees_between(outwards, normal_around(surface, *surface.nearest(end), outwards));
  };
  const Place &start = curve.points.front(), &end = curve.points.back();
  const double length = curve.length();
  if (length == 0.) return {};
  const double share = length > 2. * piece ? piece / length : .5;
  return {between(surfaces.outer, start, start - curve.at_length(share)),
          between(surfaces.inner, end, curve.at_length(1. - share) - end)};
}

double WCurves::straight_way(const Place& from) const {
  const auto hit = inner_.tree().nearest(from);
  return hit ? hit->distance : longest;
}

// A piece of a curve, as WCurve has it, whose tube grows from its start on.
struct WCurves::Way {
  std::vector<Place> points;
  std::vector<double> volume;
  std::uint32_t triangle = 0;
  bool arrived = false, sloping = false;  // sloping: the field has a slope at the start
};

struct WCurves::Slope {
  Place along;  // where the field grows, and how steeply
  bool turning = false;
};

std::optional<WCurves::Slope> WCurves::slope(const Place& at, const Place& heading) const {
  const auto g = field_.gradient(at, heading);
  if (!g) return std::nullopt;
  const double steep = g->norm();
  Place turned = Place::Zero();
  double rest = 1.;
  for (const Boundary* surface : {&outer_, &inner_})
    if (const auto hit = surface->tree().nearest(at, turning)) {
      const Place normal = across(
          surface->tree(), at, surface == &outer_ ? hit->distance : -hit->distance, surface->normal(*hit),
          [&](const TriangleTree::Hit& met, const Place&) { return surface->normal(met); });
      if (normal.dot(*g) <= .1 * steep) continue;  // another bank's
      const double near = std::clamp((turning - hit->distance) / (turning - straight), 0., 1.);
      const double share = near * near * (3. - 2. * near);
      turned += share * normal, rest *= 1. - share;
    }
  const bool near = rest < 1.;
  return Slope{near ? Place(steep * (turned + rest * *g / steep).normalized()) : *g, near};
}

WCurves::Way WCurves::follow(const Place& start, const Place& towards, bool upwards) const {
  const TriangleTree& aim = (upwards ? outer_ : inner_).tree();
  bool turns = false;
  const auto slope_at = [&](const Place& place, const Place& towards_aim) -> std::optional<Place> {
    const auto g = slope(place, upwards ? towards_aim : Place(-towards_aim));
    turns = g && g->turning;
    return g ? std::optional<Place>(upwards ? g->along : Place(-g->along)) : std::nullopt;
  };
  const auto width_of = [](const Place& g) { return 1. / std::max(g.norm(), least_slope); };
  Way way{{start}, {0.}};
  Place at = start, heading = towards.normalized();
  double width = 0.;  // 1/slope at `at`
  if (const auto g = slope_at(at, heading))
    heading = g->normalized(), width = width_of(*g), way.sloping = true;
  const auto add = [&](const Place& place, double width_there) {
    const double ds = (place - way.points.back()).norm();
    way.volume.push_back(way.volume.back() + ds * .5 * (width + width_there));
    way.points.push_back(place);
    width = width_there;
  };
  const auto arrive = [&](const TriangleTree::Hit& hit, double width_there) {
    add(hit.at, width_there);
    way.triangle = hit.triangle, way.arrived = true;
  };
  // At right angles to the surface, as nearly as it can be told.
  const auto last_way = [&](const Place& from, double distance, const Place& now) -> Place {
    const double sign = upwards ? 1. : -1.;
    return sign * across(aim, from, sign * distance, sign * now,
                         [&](const TriangleTree::Hit& met, const Place& outwards) -> Place {
                           return normal_around(aim, met, outwards).normalized();
                         });
  };
  for (double gone = 0., step = 0.; gone < longest; gone += step) {
    step = (turns ? .5 : 1.) * step_share * field_.spacing();
    if (const auto near = aim.nearest(at, straight))
      if (const auto hit = aim.first(at, at + 2. * straight * last_way(at, near->distance, heading))) {
        arrive(*hit, width);
        return way;
      }
    // Midpoint rule.
    Place middle = heading;
    if (const auto g = slope_at(at + .5 * step * heading, heading)) middle = g->normalized();
    const Place next = at + step * middle;
    // The surface may be met in either half; the way there is straight within a step.
    if (const auto hit = aim.first(at, next)) {
      double width_there = width;
      if (const auto g = slope_at(hit->at, middle)) width_there = width_of(*g);
      arrive(*hit, width_there);
      return way;
    }
    const auto g = slope_at(next, middle);
    if (!g && gone > 0. && !aim.nearest(next, 2. * field_.spacing())) break;  // it left the tissue
    add(next, g ? width_of(*g) : width);
    at = next, heading = g ? g->normalized() : middle;
  }
  if (const auto hit = aim.nearest(at)) {
    add(hit->at, width);
    way.triangle = hit->triangle;
  }
  return way;
}

WCurve WCurves::drop(const Place& start, const Place& inward) const {
  if (const auto hit = inner_.tree().nearest(start, touching * field_.spacing()))  // there is no tissue here
    return {{start, hit->at}, {0., 0.}, hit->triangle, true};
  Way way = follow(start, inward, false);
  return {std::move(way.points), std::move(way.volume), way.triangle, way.arrived};
}

std::optional<WCurve> WCurves::through(const Place& place, const Place& inward) const {
  const Way up = follow(place, -inward, true), down = follow(place, inward, false);
  if (!up.sloping || !down.sloping) return std::nullopt;
  WCurve curve{{up.points.rbegin(), up.points.rend()}, {}, down.triangle, up.arrived && down.arrived};
  for (auto v = up.volume.rbegin(); v != up.volume.rend(); ++v) curve.volume.push_back(up.volume.back() - *v);
  for (std::size_t i = 1; i < down.points.size(); ++i) {
    curve.points.push_back(down.points[i]);
    curve.volume.push_back(up.volume.back() + down.volume[i]);
  }
  return curve;
}

}  // namespace forest::cortex
