// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/body.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <Eigen/Geometry>

namespace forest::lsystem {

Gauge::Gauge(std::span<const Trace::Stop> of, double share) : stops(of), even(share) {
  for (const auto& s : stops) points += double(s.at.x());
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const double step = double(stops[i].diameter) - double(stops[i - 1].diameter);
    gap = i == 1 ? step : std::min(gap, step);
  }
}

double Gauge::nearest(double diameter) const {
  if (stops.empty()) return diameter;
  const double thickest = double(stops.back().diameter);
  if (diameter >= thickest)
    return gap > 0. ? thickest + std::round((diameter - thickest) / gap) * gap : thickest;
  const auto above = std::ranges::upper_bound(stops, float(diameter), {}, &Trace::Stop::diameter);
  const double more = above == stops.end() ? thickest : double(above->diameter);
  if (above == stops.begin()) return more;
  const double less = double(std::prev(above)->diameter);
  return more - diameter < diameter - less ? more : less;
}

double Gauge::at_share(double share) const {
  double left = share * points;
  for (const auto& s : stops)
    if ((left -= double(s.at.x())) < 0.) return double(s.diameter);
  return double(stops.back().diameter);
}

void Spines::stand(MorphologyBuilder& builder, SectionId section, const Point& from, const Point& to,
                   double along) {
  const Eigen::Vector3d way = to.position().cast<double>() - from.position().cast<double>();
  const double length = way.norm();
  for (; left < length; left += gap()) {
    const Eigen::Vector3d side = way.unitOrthogonal();
    const Eigen::Vector3d out =
        Eigen::AngleAxisd(random.uniform(0., 2. * std::numbers::pi), way / length) * side;
    const double far = reach * std::exp(random.normal(-.5 * spread * spread, spread));
    builder.add_spine({.section = section,
                       .position = float(along + left),
                       .head = (far * out).cast<float>(),
                       .head_diameter = float(head),
                       .neck_diameter = float(neck)});
  }
  left -= length;
}

Soma outlined_soma(const Point& middle, const std::array<double, 4>& outline) {
  constexpr int places = 24;
  Soma result{.kind = SomaKind::contours, .points = {}, .parents = {}, .contour_starts = {0}};
  const auto to_nm = [](double um) { return float(std::round(1e3 * um) / 1e3); };
  for (int i = 0; i < places; ++i) {
    const double phi = 2. * std::numbers::pi * i / places;
    const double r =
        double(middle.radius) * (1. + outline[0] * std::cos(2. * phi) + outline[1] * std::sin(2. * phi) +
                                 outline[2] * std::cos(3. * phi) + outline[3] * std::sin(3. * phi));
    result.points.push_back({to_nm(double(middle.x) + r * std::cos(phi)),
                             to_nm(double(middle.y) + r * std::sin(phi)), to_nm(double(middle.z)), 0.f});
  }
  return result;
}

}  // namespace forest::lsystem
