// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/w_curve.h"

#include <algorithm>
#include <cmath>

namespace forest::cortex {
namespace {

constexpr double step_share = .5;  // of the spacing of the lattice
constexpr double touching = .1;    // … surfaces are one
constexpr double longest = 3e4;    // µm; no cortex is a third as thick
constexpr double least_slope =
    1e-5;  // 1/µm, a hundredth of that of a thick cortex; below it the tube would be endless

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

WCurve WCurves::drop(const Place& start, const Place& inward) const {
  WCurve curve;
  curve.points.push_back(start);
  curve.volume.push_back(0.);
  const double step = step_share * field_.spacing();
  Place at = start, heading = inward.normalized();
  const auto slope = [&](const Place& place, const Place& down) { return field_.gradient(place, -down); };
  if (const auto hit = inner_.nearest(start, touching * field_.spacing())) {  // there is no tissue here
    curve.points.push_back(hit->at), curve.volume.push_back(0.);
    curve.triangle = hit->triangle, curve.arrived = true;
    return curve;
  }
  double width = 0.;  // 1/slope at `at`
  if (const auto g = slope(at, heading))
    heading = -g->normalized(), width = 1. / std::max(g->norm(), least_slope);
  const auto add = [&](const Place& place, double width_there) {
    const double ds = (place - curve.points.back()).norm();
    curve.volume.push_back(curve.volume.back() + ds * .5 * (width + width_there));
    curve.points.push_back(place);
    width = width_there;
  };
  for (double way = 0.; way < longest; way += step) {
    // Midpoint rule.
    Place middle = heading;
    if (const auto g = slope(at + .5 * step * heading, heading)) middle = -g->normalized();
    const Place next = at + step * middle;
    // The surface may be met in either half; the way there is straight within a step.
    if (const auto hit = inner_.first(at, next)) {
      double width_there = width;
      if (const auto g = slope(hit->at, middle)) width_there = 1. / std::max(g->norm(), least_slope);
      add(hit->at, width_there);
      curve.triangle = hit->triangle, curve.arrived = true;
      return curve;
    }
    const auto g = slope(next, middle);
    if (!g && way > 0. && !inner_.nearest(next, 2. * field_.spacing())) break;  // it left the tissue
    add(next, g ? 1. / std::max(g->norm(), least_slope) : width);
    at = next, heading = g ? Place(-g->normalized()) : middle;
  }
  if (const auto hit = inner_.nearest(at)) {
    add(hit->at, width);
    curve.triangle = hit->triangle;
  }
  return curve;
}

}  // namespace forest::cortex
