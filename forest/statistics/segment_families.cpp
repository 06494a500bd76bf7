// SPDX-License-Identifier: Apache-2.0
// Families after N++ (McCormick et al., 1990s), calibre after Hillman 1979 and Donohue & Ascoli 2008. Directions are
// those over `reach` µm, so that they do not depend on how densely a branch was traced.
#include "forest/statistics/segment_families.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "forest/morphology/measure.h"

namespace forest::statistics {
namespace {

using Vector = Eigen::Vector3d;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double reach = 10.;    // µm
constexpr double longest = 1e5;  // µm that a section is followed: a stray point must not fill the memory

constexpr std::array<std::string_view, 5> given_names{"nothing", "order", "path", "radius", "height"};
constexpr std::array<std::string_view, 5> given_units{"", "", "µm", "µm", "µm"};

struct Row {
  Quantity::Family family;
  std::string_view name, unit, meaning;
  bool angles = false;
  std::optional<double> least = {}, most = {};
};
enum : std::size_t {
  nonterminal_length,
  terminal_length,
  contraction,
  turn,
  thick_angle,
  thin_angle,
  amplitude,
  torque,
  stem_diameter,
  taper,
  daughter_ratio,
  parent_daughter_ratio
};
constexpr Row rows[] = {
    {Quantity::trajectory, "length_of_nonterminal_segments", "µm",
     "path length of sections that fork, and have one", false, 0.},
    {Quantity::trajectory, "length_of_terminal_segments", "µm",
     "path length of sections that end, and have one", false, 0.},
    {Quantity::trajectory, "contraction", "",
     "straight distance between the ends of a section over its path length", false, 0., 1.},
    {Quantity::trajectory, "turn", "°", "angle between one piece of 10 µm of a section and the next", false,
     0.},
    {Quantity::rotations, "angle_of_thicker_daughter", "°",
     "from the direction of the parent; over 10 µm, as all of these", false, 0.},
    {Quantity::rotations, "angle_of_thinner_daughter", "°", "from the direction of the parent", false, 0.},
    {Quantity::rotations, "amplitude", "°", "angle between the two daughters", false, 0.},
    {Quantity::rotations, "torque", "°",
     "turn of the plane of a bifurcation about the parent, from that of the bifurcation before", true},
    {Quantity::calibre, "stem_diameter", "µm", "diameter at the beginning of a stem", false, 0.},
    {Quantity::calibre, "taper", "", "loss of diameter along a section over its length"},
    {Quantity::calibre, "daughter_ratio", "", "diameter of the thicker daughter over that of the thinner",
     false, 1.},
    {Quantity::calibre, "parent_daughter_ratio", "",
     "diameter of a daughter over that of its parent, where they meet", false, 0.},
};

Vector place(const Point& p) { return p.position().cast<double>(); }

/// The place `distance` µm along a line of points, or its end.
Vector along(std::span<const Point> points, double distance) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double length = segment_length(points[i - 1], points[i]);
    if (length >= distance && length > 0.)
      return place(points[i - 1]) + distance / length * (place(points[i]) - place(points[i - 1]));
    distance -= length;
  }
  return place(points.back());
}

Vector away(std::span<const Point> points) { return along(points, reach) - place(points.front()); }
Vector arriving(std::span<const Point> points, double length) {
  return place(points.back()) - along(points, std::max(0., length - reach));
}

double degrees_between(const Vector& u, const Vector& v) {
  if (u.isZero(0.) || v.isZero(0.)) return nan;
  return std::atan2(u.cross(v).norm(), u.dot(v)) * (180. / std::numbers::pi);
}

double ratio(double above, double below) { return below > 0. ? above / below : nan; }

/// Of one neuron, added to what is there.
class Reader {
 public:
  Reader(const Arbors& arbors, SegmentValues& out) : arbors_(arbors), out_(out) {}

  void read() {
    for (const Branch& b : arbors_.sections()) section(b);
    for (const Bifurcation& b : arbors_.bifurcations()) bifurcation(b);
  }

 private:
  using Place = std::array<double, 4>;

  double first_diameter(const Branch& b) const {  // the first point of a daughter repeats the branch point
    return 2. * arbors_.points(b)[b.parent >= 0 ? 1 : 0].radius;
  }
  double last_diameter(const Branch& b) const { return 2. * arbors_.points(b).back().radius; }
  Place beginning(const Branch& b) const {
    const auto points = arbors_.points(b);
    return {double(arbors_.neuron().order(b.id)), b.path_distance - b.length, 0.5 * first_diameter(b),
            double(points.front().y) - arbors_.origin().y};
  }
  Place end(const Branch& b) const {
    const auto points = arbors_.points(b);
    return {double(arbors_.neuron().order(b.id)), b.path_distance, double(points.back().radius),
            double(points.back().y) - arbors_.origin().y};
  }
  void add(std::size_t row, double value, const Place& where) {
    if (std::isnan(value)) return;
    out_.quantities[row].values.push_back(value);
    out_.quantities[row].places.push_back(where);
  }

  void section(const Branch& b) {
    const auto points = arbors_.points(b);
    const Place from = beginning(b);
    out_.forks.push_back(b.daughters > 0);
    out_.places.push_back(end(b));
    add(b.daughters > 0 ? nonterminal_length : terminal_length, b.length > 0. ? b.length : nan, from);
    if (b.length > reach)
      add(contraction, std::min(1., segment_length(points.front(), points.back()) / b.length), from);
    if (b.length >= 2. * reach) {
      Vector before = place(points.front()), heading = Vector::Zero();
      const double far = std::min(b.length, longest);
      for (double at = reach; at <= far; at += reach) {
        const Vector here = along(points, at), now = here - before;
        if (at > reach) add(turn, degrees_between(heading, now), from);
        before = here, heading = now;
      }
    }
    if (b.parent < 0) {
      add(stem_diameter, 2. * points.front().radius, from);
    } else {
      add(parent_daughter_ratio,
          ratio(first_diameter(b), last_diameter(arbors_.section(std::size_t(b.parent)))), from);
    }
    if (b.length > reach) add(taper, (first_diameter(b) - last_diameter(b)) / b.length, from);
  }

  /// The thicker daughter first; where they are equal the one with more tips, then the first.
  std::pair<std::uint32_t, std::uint32_t> ordered(const Bifurcation& b) const {
    const Branch &l = arbors_.section(b.left), &r = arbors_.section(b.right);
    const double thick_l = first_diameter(l), thick_r = first_diameter(r);
    const bool swap = thick_r > thick_l || (thick_r == thick_l && r.degree > l.degree);
    return swap ? std::pair{b.right, b.left} : std::pair{b.left, b.right};
  }
  Vector plane(const Bifurcation& b) const {
    const auto [thick, thin] = ordered(b);
    return away(arbors_.points(arbors_.section(thick))).cross(away(arbors_.points(arbors_.section(thin))));
  }

  void bifurcation(const Bifurcation& b) {
    const Branch& parent = arbors_.section(b.parent);
    const Place where = end(parent);
    const auto [thick, thin] = ordered(b);
    const Branch &big = arbors_.section(thick), &small = arbors_.section(thin);
    const Vector heading = arriving(arbors_.points(parent), parent.length);
    const Vector first = away(arbors_.points(big)), second = away(arbors_.points(small));
    add(thick_angle, degrees_between(heading, first), where);
    add(thin_angle, degrees_between(heading, second), where);
    add(amplitude, degrees_between(first, second), where);
    add(daughter_ratio, ratio(first_diameter(big), first_diameter(small)), where);
    if (parent.parent < 0) return;
    // They stand in the order of their parents.
    const auto above = std::ranges::lower_bound(arbors_.bifurcations(), std::uint32_t(parent.parent), {},
                                                &Bifurcation::parent);
    if (above == arbors_.bifurcations().end() || above->parent != std::uint32_t(parent.parent)) return;
    const Vector chord = place(arbors_.points(parent).back()) - place(arbors_.points(parent).front());
    if (chord.isZero(0.)) return;
    const Vector axis = chord.normalized();
    const auto across = [&](const Vector& v) { return Vector(v - v.dot(axis) * axis); };
    const Vector was = across(plane(*above)), is = across(plane(b));
    if (was.isZero(0.) || is.isZero(0.)) return;
    add(torque, std::atan2(was.cross(is).dot(axis), was.dot(is)) * (180. / std::numbers::pi), where);
  }

  const Arbors& arbors_;
  SegmentValues& out_;
};

std::vector<double> column(std::span<const std::array<double, 4>> places, Given given) {
  std::vector<double> out;
  out.reserve(places.size());
  for (const auto& p : places) out.push_back(p[std::size_t(given) - 1]);
  return out;
}

/// Of how many values, in whose words, so that a text tells it by itself.
std::string remark(const Quantity& q, std::size_t count, std::string_view how) {
  return fmt::format("# {}{}{}: {}; {} values{}\n", q.name, q.unit.empty() ? "" : ", ", q.unit, q.meaning,
                     count, how);
}

}  // namespace

std::string_view name_of(Given given) { return given_names[std::size_t(given)]; }
std::string_view unit_of(Given given) { return given_units[std::size_t(given)]; }
std::optional<Given> given_of(std::string_view word) {
  const auto found = std::ranges::find(given_names, word);
  if (found == given_names.end()) return std::nullopt;
  return Given(found - given_names.begin());
}

std::string_view name_of(Quantity::Family family) {
  constexpr std::array<std::string_view, 3> names{"segment trajectory and length",
                                                  "rotations at bifurcations", "calibre"};
  return names[family];
}

SegmentValues segment_values(std::span<const Morphology> cells, KindSet kinds) {
  SegmentValues out;
  out.cells = cells.size();
  for (const Row& r : rows)
    out.quantities.push_back({r.family, r.name, r.unit, r.meaning, r.angles, r.least, r.most, {}, {}});
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, kinds);
    Reader(arbors, out).read();
  }
  return out;
}

SegmentFamilies segment_families(std::span<const Morphology> cells, const FamilyOptions& options,
                                 Progress& progress) {
  const SegmentValues values = segment_values(cells, options.kinds);
  SegmentFamilies out;
  out.cells = cells.size(), out.sections = values.forks.size();
  out.nontermination = chance_of("nontermination", std::size_t(std::ranges::count(values.forks, 1)),
                                 values.forks.size(), options.fit.confidence);
  for (const Given given : {Given::order, Given::path, Given::radius, Given::height})
    out.tables.push_back({given, chance_by(values.forks, column(values.places, given), options.binning)});

  progress.begin("fitting", values.quantities.size());
  for (const Quantity& q : values.quantities) {
    FitOptions how = options.fit;
    how.angles = q.angles, how.least = q.least, how.most = q.most;
    FittedQuantity fitted{q.family, q.name, q.unit, q.meaning, fit_distribution(q.values, how), {}, {}};
    if (options.given == Given::nothing || q.values.empty()) {
      const DistributionFit& f = fitted.fit;
      if (f.count)
        fitted.distribution = remark(q, f.count, f.name == "values" ? "" : fmt::format(", best {}", f.name)) +
                              f.distribution.declaration(q.name) + '\n';
    } else {
      const std::vector<double> given = column(q.places, options.given),
                                edges = bin_edges(given, options.binning);
      std::vector<std::vector<double>> held(edges.size());
      for (std::size_t i = 0; i < given.size(); ++i)
        if (!std::isnan(given[i])) held[bin_of(edges, given[i])].push_back(q.values[i]);
      how.mixtures = false;  // in a bin there are too few
      for (std::size_t b = 0; b < edges.size(); ++b)
        fitted.bins.push_back({edges[b], fit_distribution(held[b], how)});
      fitted.distribution =
          remark(q, q.values.size(), fmt::format(" by {}, as they were", name_of(options.given))) +
          conditional(q.values, given, options.binning).text(q.name, name_of(options.given));
    }
    out.quantities.push_back(std::move(fitted));
    progress.advance();
  }
  progress.end();
  return out;
}

std::vector<std::pair<std::string, std::string>> SegmentFamilies::texts() const {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const Table& t : tables) {
    if (t.bins.empty()) continue;
    const std::string name = fmt::format("nontermination_by_{}", name_of(t.given));
    std::string note =
        fmt::format("# chance that a segment forks, by {} at its end; sections:", name_of(t.given));
    for (const ChanceBin& b : t.bins) note += fmt::format(" {}", b.count);
    texts.emplace_back(name,
                       fmt::format("{0}\n{1}\ndistribution {2}({3}) = chance(chance_by_{3}({3}))\n", note,
                                   table_text(fmt::format("chance_by_{}", name_of(t.given)), t.bins), name,
                                   name_of(t.given)));
  }
  for (const FittedQuantity& q : quantities)
    if (!q.distribution.empty()) texts.emplace_back(std::string(q.name), q.distribution);
  return texts;
}

}  // namespace forest::statistics
