// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/traced.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "forest/statistics/summary.h"

namespace forest::fitting {

using statistics::Arbors;
using statistics::Branch;

std::vector<lsystem::Trace::Stop> stops_of(std::span<const Point> points) {
  std::vector<lsystem::Trace::Stop> stops;
  for (const Point& p : points.subspan(1))
    stops.push_back({p.position() - points[0].position(), 2.f * p.radius});
  return stops;
}

namespace {

// Where a branch heads at its end, and at its beginning.
Vec3 end_heading(std::span<const Point> points) {
  return lsystem::heading_at_end(Vec3::Zero(), stops_of(points));
}
Vec3 start_heading(std::span<const Point> points) {
  const std::vector<Point> back(points.rbegin(), points.rend());
  return -end_heading(back);
}
// By which angle it turns from one segment to the next.
void add_turns(std::span<const Point> points, std::vector<double>& to) {
  for (std::size_t i = 2; i < points.size(); ++i) {
    const Vec3 before = points[i - 1].position() - points[i - 2].position(),
               after = points[i].position() - points[i - 1].position();
    to.push_back(std::atan2(double(before.cross(after).norm()), double(before.dot(after))));
  }
}

// The angle of each segment to the plane of the slice.
void add_elevations(std::span<const Point> points, std::vector<double>& to) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 step = points[i].position() - points[i - 1].position();
    if (!step.isZero(0.f))
      to.push_back(std::atan2(std::abs(double(step.z())), std::hypot(double(step.x()), double(step.y()))));
  }
}

// Unit; zero for a branch without length.
Vec3 last_step_of(std::span<const Point> points) {
  for (std::size_t i = points.size(); i-- > 1;)
    if (const Vec3 step = points[i].position() - points[i - 1].position(); !step.isZero(0.f))
      return step.stableNormalized();
  return Vec3::Zero();
}

// How far from `middle` the outermost edge of a soma lies towards each of so many sides; 0 where none does.
std::array<double, 72> edges_of(const Soma& soma, const Eigen::Vector2d& middle) {
  std::array<double, 72> far{};
  const auto flat = [&](const Point& p) {
    return Eigen::Vector2d(double(p.x) - middle.x(), double(p.y) - middle.y());
  };
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  for (std::size_t side = 0; side < far.size(); ++side) {
    const double phi = 2. * std::numbers::pi * double(side) / double(far.size());
    const Eigen::Vector2d out(std::cos(phi), std::sin(phi));
    const auto edge = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
      const double a = cross(out, from), b = cross(out, to);
      if ((a <= 0.) == (b <= 0.)) return;  // it does not cross the line through the middle
      far[side] = std::max(far[side], out.dot(from + a / (a - b) * (to - from)));
    };
    const auto disc = [&](const Eigen::Vector2d& at, double radius) {
      const double beside = cross(out, at);
      if (std::abs(beside) < radius)
        far[side] = std::max(far[side], out.dot(at) + std::sqrt(radius * radius - beside * beside));
    };
    for (std::size_t i = 0; i < soma.contour_starts.size(); ++i) {
      const auto contour = soma.contour(i);
      for (std::size_t k = 0; k < contour.size(); ++k)
        edge(flat(contour[k]), flat(contour[(k + 1) % contour.size()]));
    }
    constexpr int discs = 8;  // along a cylinder
    for (std::size_t i = 0; i < soma.parents.size(); ++i) {
      if (soma.parents[i] < 0) continue;
      const Point &from = soma.points[std::size_t(soma.parents[i])], &to = soma.points[i];
      for (int k = 0; k <= discs; ++k) {
        const double t = double(k) / discs;
        disc(flat(from) + t * (flat(to) - flat(from)), std::lerp(double(from.radius), double(to.radius), t));
      }
    }
  }
  return far;
}

Outline outline_of(const Soma& soma) {
  const Point sphere = soma.sphere();
  const auto far = edges_of(soma, {double(sphere.x), double(sphere.y)});
  if (*std::ranges::min_element(far) <= 0.) return {};  // a ball, or its middle is outside
  Outline outline{};
  double mean = 0.;
  for (std::size_t side = 0; side < far.size(); ++side) {
    const double phi = 2. * std::numbers::pi * double(side) / double(far.size());
    const Outline waves{std::cos(2. * phi), std::sin(2. * phi), std::cos(3. * phi), std::sin(3. * phi)};
    for (std::size_t k = 0; k < waves.size(); ++k) outline[k] += 2. * far[side] * waves[k];
    mean += far[side];
  }
  double bent = 0.;
  for (double& one : outline) one /= mean, bent += std::abs(one);
  constexpr double most = .9;  // more, and it would cross itself
  for (double& one : outline) one *= std::min(1., most / bent);
  return outline;
}

double diameter_of(const Point& p) { return std::max(least_diameter, 2. * double(p.radius)); }

// Of one neuron.
struct Learner {
  Traced& traced;
  const Arbors& arbors;
  const Vec3 soma = arbors.origin().position();
  std::span<const Branch> all = arbors.sections();
  std::vector<double> beyond =
      std::vector<double>(all.size(), 0.);  // path from a section's end to its farthest tip
  std::vector<int> fork_at = std::vector<int>(all.size(), none);           // its number among all forks
  std::vector<Vec3> middle = std::vector<Vec3>(all.size(), Vec3::Zero());  // of all its tips
  std::vector<std::vector<std::uint32_t>> daughters = std::vector<std::vector<std::uint32_t>>(all.size());
  std::vector<std::uint32_t> stems = std::vector<std::uint32_t>(all.size());  // that sections grow from
  std::vector<double> tips = std::vector<double>(all.size(), 0.);

  Learner(Traced& into, const Arbors& of) : traced(into), arbors(of) {}

  int kind_of(const Branch& b) const { return int(arbors.neuron().section(b.id).kind); }
  std::span<const Point> points(std::uint32_t i) const { return arbors.points(all[i]); }
  // A root of one point, from which others leave: of an insect's neuron no branch, else a stem that forks where it leaves.
  bool single(std::uint32_t i) const { return all[i].parent < 0 && points(i).size() < 2; }
  bool begins(std::uint32_t i) const { return single(i) && arbors.neuron().soma().kind == SomaKind::none; }
  bool bud(std::uint32_t i) const { return single(i) && learned(i); }
  // The section that this one goes on: none (-1) for a stem, which leaves the soma, a section of another kind, or the
  // point where a fibre begins.
  std::int32_t above(std::size_t i) const {
    const std::int32_t parent = all[i].parent;
    return parent < 0 || begins(std::uint32_t(parent)) || kind_of(all[std::size_t(parent)]) != kind_of(all[i])
               ? -1
               : parent;
  }
  bool drawn(std::uint32_t i) const { return points(i).size() >= 2 && all[i].length > 0.; }
  bool learned(std::uint32_t i) const {  // the fork at the end of this section
    return !daughters[i].empty() && daughters[i].size() <= most_daughters &&
           std::ranges::all_of(daughters[i], [&](std::uint32_t d) { return drawn(d); });
  }
  // From its end to the middle of its tips.
  Vec3 ahead_of(std::uint32_t i) const { return (middle[i] - points(i).back().position()).normalized(); }
  std::vector<Point> copy(std::uint32_t i) const { return {points(i).begin(), points(i).end()}; }

  void learn() {
    for (std::size_t i = all.size(); i-- > 0;)
      if (above(i) >= 0) {
        double& before = beyond[std::size_t(above(i))];
        before = std::max(before, all[i].length + beyond[i]);
      }
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (above(i) >= 0) daughters[std::size_t(above(i))].push_back(i);
    for (std::uint32_t i = 0, row = std::uint32_t(traced.forks.size()); i < all.size(); ++i)
      if (learned(i)) fork_at[i] = int(row++);
    for (std::uint32_t i = 0; i < all.size(); ++i) stems[i] = above(i) < 0 ? i : stems[std::size_t(above(i))];
    for (std::size_t i = all.size(); i-- > 0;) {
      if (daughters[i].empty()) tips[i] = 1., middle[i] = points(std::uint32_t(i)).back().position();
      if (above(i) >= 0) {
        const auto before = std::size_t(above(i));
        tips[before] += tips[i];
        middle[before] += float(tips[i] / tips[before]) * (middle[i] - middle[before]);
      }
    }
    Cell cell{.soma = 2. * double(arbors.origin().radius),
              .outline = outline_of(arbors.neuron().soma()),
              .kinds = manners(),
              .stems = {}};
    if (arbors.neuron().soma().kind == SomaKind::none) cell.fibre = cell.soma;
    for (std::uint32_t i = 0; i < all.size(); ++i)
      for (const Point& p : points(i)) {
        cell.low = std::min(cell.low, double(p.z - soma.z()));
        cell.high = std::max(cell.high, double(p.z - soma.z()));
        // Where a branch leaves another, the point is that one's.
        cell.diameters[kind_of(all[i])][std::round(2e3 * double(p.radius)) / 1e3] +=
            above(i) < 0 || &p != points(i).data();
      }
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (above(i) < 0 && (drawn(i) || bud(i))) cell.stems.push_back(stem(i));
    if (cell.stems.empty()) return;
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (learned(i)) traced.forks.push_back(fork(i));
    traced.cells.push_back(std::move(cell));
  }

  Stem stem(std::uint32_t i) const {
    const Branch& b = all[i];
    return {.cell = traced.cells.size(),
            .kind = kind_of(b),
            .tips = tips[i],
            .ahead = b.length + beyond[i],
            .length = b.length,
            .end_diameter = diameter_of(points(i).back()),
            .place = points(i).front().position() - soma,
            .heading = bud(i) ? ahead_of(i) : start_heading(points(i)),
            .aim = middle[i] - soma,
            .points = bud(i) ? std::vector<Point>(2, points(i).front()) : copy(i),
            .next = fork_at[i]};
  }

  Fork fork(std::uint32_t i) const {
    const Branch& b = all[i];
    const Vec3 place = points(i).back().position() - soma;
    Fork fork{.cell = traced.cells.size(),
              .kind = kind_of(b),
              .tips = tips[i],
              .ahead = beyond[i],
              .path = b.path_distance - (all[stems[i]].path_distance - all[stems[i]].length),
              .order = double(arbors.neuron().order(b.id) - arbors.neuron().order(all[stems[i]].id)),
              .diameter = diameter_of(points(i).back()),
              .side = double(place.x()),
              .height = double(place.y()),
              .depth = double(place.z()),
              .heading = bud(i) ? ahead_of(i) : end_heading(points(i)),
              .aim = ahead_of(i),
              .last_step = last_step_of(points(i)),
              .daughters = {}};
    for (const std::uint32_t d : daughters[i])
      fork.daughters.push_back({.tips = tips[d],
                                .ahead = beyond[d],
                                .length = all[d].length,
                                .end_diameter = diameter_of(points(d).back()),
                                .aim = middle[d] - points(i).back().position(),
                                .points = copy(d),
                                .next = fork_at[d]});
    fork.turned = fork.daughters.front().tips > fork.daughters.back().tips;
    std::ranges::stable_sort(fork.daughters, {}, &Fork::Daughter::tips);
    return fork;
  }

  std::map<int, Manner> manners() const {
    struct Sums {
      std::array<std::vector<double>, trait::count> values;
      double farthest = 0., sections = 0., thinnest = INFINITY, widest = 0.;
    };
    std::map<int, Sums> by_kind;
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      if (begins(i)) continue;
      Sums& of = by_kind[kind_of(all[i])];
      of.sections += 1.;
      of.farthest = std::max(of.farthest, double((points(i).back().position() - soma).norm()));
      for (const Point& p : points(i))
        of.thinnest = std::min(of.thinnest, diameter_of(p)),
        of.widest = std::max(of.widest, double(p.radius));
      if (drawn(i)) measure(i, of.values);
    }
    std::map<int, Manner> manners;
    for (auto& [kind, of] : by_kind) {
      Manner& manner = manners[kind];
      const auto mean_of = [&](std::size_t s) {
        return of.values[s].empty() ? 0. : statistics::mean(of.values[s]);
      };
      std::vector<double> elevations = of.values[trait::stairs];
      constexpr double as_level = 1e-4, flat = .02;  // radians
      const auto level = std::ranges::remove_if(elevations, [](double e) { return e < as_level; });
      if (!elevations.empty()) manner.level = double(level.size()) / double(elevations.size());
      elevations.erase(level.begin(), level.end());
      if (elevations.size() > 1) {
        const statistics::Summary climbs = statistics::summarize(elevations);
        manner.stairs = std::max(manner.stairs, climbs.sd / std::max(flat, climbs.mean));
      }
      if (of.values[trait::slope].size() > 1) {
        const statistics::Summary slopes = statistics::summarize(of.values[trait::slope]);
        manner.uneven = std::max(manner.uneven, slopes.sd / std::max(flat, slopes.mean));
      }
      const double turn = std::max(manner.turn, mean_of(trait::kinks));
      for (const std::size_t s : {trait::stairs, trait::kinks})  // not their mean: how much they differ
        of.values[s] = {of.values[s].size() > 1 ? statistics::summarize(of.values[s]).sd : 0.};
      of.values[trait::extent] = {std::log(1. + of.farthest)},
      of.values[trait::forks] = {std::log(of.sections)};
      for (std::size_t s = 0; s < trait::count; ++s) manner.style[s] = mean_of(s);
      manner.thinnest = of.widest > 0. ? of.thinnest : 0.;  // without diameters: none
      manner.farthest = of.farthest;
      manner.winding = std::max(.01, manner.style[trait::wander]);
      manner.turn = turn;
      manner.kinks = std::max(manner.kinks, manner.style[trait::kinks] / turn);
      manner.spines = spines_of(kind);
    }
    return manners;
  }

  Spininess spines_of(int kind) const {
    const Morphology& neuron = arbors.neuron();
    std::vector<double> reach, head, neck, logarithms;
    for (const Spine& spine : neuron.spines()) {
      if (int(neuron.section(spine.section).kind) != kind) continue;
      reach.push_back(double(spine.head.norm()));
      head.push_back(double(spine.head_diameter)), neck.push_back(double(spine.neck_diameter));
      if (reach.back() > 0.) logarithms.push_back(std::log(reach.back()));
    }
    if (reach.empty()) return {};
    double length = 0.;
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (!begins(i) && kind_of(all[i]) == kind) length += all[i].length;
    if (!(length > 0.)) return {};
    return {.density = double(reach.size()) / length,
            .reach = statistics::mean(reach),
            .head = statistics::mean(head),
            .neck = statistics::mean(neck),
            .spread = logarithms.size() > 1 ? statistics::summarize(logarithms).sd : 0.};
  }

  void measure(std::uint32_t i, std::array<std::vector<double>, trait::count>& values) const {
    constexpr double straight = 10.;  // µm: shorter ones tell nothing of how they wind
    const Branch& b = all[i];
    const Vec3 chord = points(i).back().position() - points(i).front().position();
    const double across = double(chord.norm());
    values[trait::reach].push_back(std::log(b.length));
    if (b.length > straight && across > 0.) values[trait::wander].push_back(std::log(b.length / across));
    values[trait::girth].push_back(std::log(diameter_of(points(i)[points(i).size() / 2])));
    values[trait::grain].push_back(std::log(b.length / double(points(i).size() - 1)));
    values[trait::slope].push_back(slope_of(points(i)));
    add_elevations(points(i), values[trait::stairs]);
    const std::size_t known = values[trait::kinks].size();
    add_turns(points(i), values[trait::kinks]);
    if (const auto turns = std::span(values[trait::kinks]).subspan(known); !turns.empty())
      values[trait::kink].push_back(statistics::mean(turns));
    values[trait::depth].push_back(std::log(1. + std::abs(double(points(i).back().z - soma.z()))));
    if (above(i) < 0) return;
    const auto before = points(std::uint32_t(above(i)));
    if (across > 0.)
      values[trait::spread].push_back(
          std::acos(std::clamp(double(end_heading(before).dot(chord)) / across, -1., 1.)));
    values[trait::thinning].push_back(std::log(diameter_of(points(i)[1]) / diameter_of(before.back())));
  }
};
// In standard deviations from the mean of all neurons.
void standardise(Traced& traced) {
  std::map<int, std::vector<Style*>> by_kind;
  for (Cell& c : traced.cells)
    for (auto& [kind, of] : c.kinds) by_kind[kind].push_back(&of.style);
  for (const auto& [kind, of] : by_kind)
    for (std::size_t s = 0; s < trait::count; ++s) {
      std::vector<double> values;
      for (const Style* style : of) values.push_back((*style)[s]);
      const double mean = statistics::mean(values), measured = statistics::summarize(values).sd;
      const double sd =
          measured > 1e-9 * std::abs(mean) ? measured : 0.;  // what is the same in all may be rounded
      traced.means[kind][s] = mean, traced.deviations[kind][s] = sd;
      for (Style* style : of) (*style)[s] = sd > 0. ? ((*style)[s] - mean) / sd : 0.;
    }
}

}  // namespace

double slope_of(std::span<const Point> points) {
  double along = 0., length = 0.;
  for (std::size_t i = 1; i < points.size(); ++i) {
    along += std::abs(double(points[i].z) - double(points[i - 1].z));
    length += double((points[i].position() - points[i - 1].position()).norm());
  }
  return length > 0. ? along / length : 0.;
}

Traced learn(std::span<const Morphology> neurons, statistics::KindSet kinds) {
  Traced traced;
  for (const Morphology& neuron : neurons)
    if (!neuron.roots().empty()) Learner(traced, Arbors(neuron, kinds)).learn();
  standardise(traced);
  return traced;
}

}  // namespace forest::fitting
