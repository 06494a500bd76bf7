// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/drawing.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

namespace forest::lsystem {

std::uint32_t Drawing::add_gauge(std::span<const Trace::Stop> stops, double even) {
  const auto same = std::ranges::find_if(
      gauges_, [&](const Gauge& g) { return g.stops.data() == stops.data() && g.even == even; });
  if (same != gauges_.end()) return std::uint32_t(same - gauges_.begin());
  gauges_.emplace_back(stops, even);
  return std::uint32_t(gauges_.size() - 1);
}

std::uint32_t Drawing::add_spines(const Spines& spines) {
  spines_.push_back(spines);
  return std::uint32_t(spines_.size() - 1);
}

Drawing::Node Drawing::begin(const Eigen::Vector3d& place, float radius, const Pen& pen) {
  points_.push_back({place, radius, radius, none, 0, pen});
  return next() - 1;
}

Drawing::Node Drawing::line(Node from, const Eigen::Vector3d& to, float start_radius, float radius,
                            const Pen& pen) {
  // What differs by rounding alone is the same: else a file of points has the place of a fork once for each daughter.
  if (const float there = points_[from].radius; std::abs(start_radius - there) <= 1e-5f * there)
    start_radius = there;
  ++points_[from].children;
  points_.push_back({to, radius, start_radius, from, 0, pen});
  return next() - 1;
}

// Thicker ones stay thicker, and equal ones equal: what is as thick as a share of all points under a gauge becomes as thick as that
// share of its own.
void Drawing::even_out() {
  for (std::uint32_t g = 1; g < gauges_.size(); ++g) {
    const Gauge& gauge = gauges_[g];
    if (gauge.even == 0. || !(gauge.points > 0.)) continue;
    std::vector<float> radii;
    for (const Drawn& d : points_)
      if (d.pen.gauge == g) radii.push_back(d.radius);
    std::ranges::sort(radii);
    std::vector<std::pair<float, float>> became;  // each once
    const auto evened = [&](float radius) {
      const auto known = std::ranges::lower_bound(became, radius, {}, &std::pair<float, float>::first);
      if (known != became.end() && known->first == radius) return known->second;
      const auto [from, to] = std::ranges::equal_range(radii, radius);
      const double share = .5 * double((from - radii.begin()) + (to - radii.begin())) / double(radii.size()),
                   wanted = .5 * gauge.at_share(share);
      const double mixed = radius > 0.f && wanted > 0.
                               ? double(radius) * std::pow(wanted / double(radius), gauge.even)
                               : double(radius);
      return became.insert(known, {radius, float(.5 * gauge.nearest(2. * mixed))})->second;
    };
    for (Drawn& d : points_)
      if (d.pen.gauge == g) d.radius = evened(d.radius), d.start_radius = evened(d.start_radius);
  }
}

void Drawing::approach(Node begun, Node last, const Eigen::Vector3d& direction) {
  constexpr double reach = 10.;  // µm
  const Eigen::Vector3d end = points_[last].position;
  Node node = points_[last].parent;
  // How the branch itself left the fork before it belongs to that one.
  const auto first = [&](Node n) { return n == begun || points_[n].parent == begun; };
  if (node == none || first(node)) return;
  const Eigen::Vector3d step = end - points_[node].position;
  if (step.isZero(0.)) return;
  // Turned about z; as steep as it should be then, as far as steps before it that are not level can make up for that.
  std::vector<Node> nodes;
  std::vector<double> ways, sloping;  // back to each, and how long the step to it is unless that is level
  const double length = step.norm();
  for (double way = 0.;
       !first(node) && points_[node].parent != none && points_[node].children == 1 && way < reach;) {
    nodes.push_back(node), ways.push_back(way);
    const Eigen::Vector3d back = points_[node].position - points_[points_[node].parent].position;
    sloping.push_back(std::abs(back.z()) > as_high ? back.norm() : 0.);
    way += back.norm(), node = points_[node].parent;
  }
  const double along = std::reduce(sloping.begin(), sloping.end()), level = direction.head<2>().norm(),
               was = step.head<2>().norm();
  const double angle = level > 0. && was > 0.
                           ? std::atan2(step.x() * direction.y() - step.y() * direction.x(),
                                        step.head<2>().dot(direction.head<2>()))
                           : 0.;
  const double lower = std::clamp(step.z() - length * direction.z(), -along / 2., along / 2.);
  const double wide = std::sqrt(std::max(0., length * length - std::pow(step.z() - lower, 2)));
  const Eigen::Vector2d out =
      level > 0. ? Eigen::Vector2d((was - wide) / level * direction.head<2>()) : Eigen::Vector2d::Zero();
  double left = lower;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Eigen::Vector3d& place = points_[nodes[i]].position;
    const double share = 1. - ways[i] / reach;
    place.head<2>() =
        (end + Eigen::AngleAxisd(share * angle, Eigen::Vector3d::UnitZ()) * (place - end)).head<2>() +
        share * out;
    place.z() += left;
    if (along > 0.) left -= lower * sloping[i] / along;
  }
}

Morphology Drawing::build(const std::optional<Soma>& soma, const Annotations& annotations) {
  MorphologyBuilder builder;
  if (soma) builder.set_soma(*soma);
  const auto point = [](const Drawn& d, float radius) {
    return Point{float(d.position.x()), float(d.position.y()), float(d.position.z()), radius};
  };
  builder.reserve(points_.size() / 4, points_.size() + points_.size() / 4);
  std::vector<SectionId> section_of(points_.size());
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < points_.size();) {
    points.clear();
    SectionId parent;
    const std::uint32_t begin = i;
    if (const Drawn& first = points_[i]; first.parent != none) {
      parent = section_of[first.parent];
      points.push_back(point(points_[first.parent], first.start_radius));
    }
    for (;; ++i) {
      points.push_back(point(points_[i], points_[i].radius));
      const bool goes_on = i + 1 < points_.size() && points_[i + 1].parent == i && points_[i].children == 1 &&
                           points_[i + 1].pen.kind == points_[i].pen.kind &&
                           points_[i + 1].pen.tag == points_[i].pen.tag;
      if (!goes_on) break;
    }
    const SectionId id = builder.add_section(parent, points_[begin].pen.kind, points, points_[begin].pen.tag,
                                             parent.valid() || !soma ? -1 : 0);
    for (std::uint32_t k = begin; k <= i; ++k) section_of[k] = id;
    double along = 0.;
    for (std::size_t k = 1; spines_.size() > 1 && k < points.size(); ++k) {
      const Drawn& end = points_[i - (points.size() - 1 - k)];
      if (end.pen.spines != 0) spines_[end.pen.spines].stand(builder, id, points[k - 1], points[k], along);
      along += double((points[k].position() - points[k - 1].position()).norm());
    }
    ++i;
  }
  for (const auto& [key, value] : annotations) builder.annotate(key, value);
  return builder.build();
}

}  // namespace forest::lsystem
