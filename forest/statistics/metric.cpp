// SPDX-License-Identifier: Apache-2.0
// After L-Measure (Scorcioni, Polavaram & Ascoli 2008, Nat Protoc 3:866) and NeuroM; full references stand in
// docs/statistics/metrics.md. Changed: one value an element, so that values of different metrics can be
// paired; Sholl crossings are counted on the segments themselves, so that they do not depend on how densely a
// branch was traced.
#include "forest/statistics/metric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "forest/core/bounds.h"
#include "forest/morphology/measure.h"

namespace forest::statistics {
namespace {

using Vector = Eigen::Vector3d;
using Values = std::vector<double>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// From a function of one element to a column of the table.
template <double (*f)(const Arbors&)>
Values per_neuron(const Arbors& a) {
  return {f(a)};
}

template <double (*f)(const Arbors&, const Branch&)>
Values per_section(const Arbors& a) {
  Values values;
  values.reserve(a.sections().size());
  for (const Branch& b : a.sections()) values.push_back(f(a, b));
  return values;
}

template <double (*f)(const Arbors&, const Bifurcation&)>
Values per_bifurcation(const Arbors& a) {
  Values values;
  values.reserve(a.bifurcations().size());
  for (const Bifurcation& b : a.bifurcations()) values.push_back(f(a, b));
  return values;
}

// From a function of a section to one of the neuron.
template <double (*f)(const Arbors&, const Branch&)>
double sum(const Arbors& a) {
  double total = 0.;
  for (const Branch& b : a.sections()) total += f(a, b);
  return total;
}

template <double (*f)(const Arbors&, const Branch&)>
double largest(const Arbors& a) {
  double best = nan;
  for (const Branch& b : a.sections()) best = std::fmax(best, f(a, b));
  return best;
}

double ratio(double above, double below) { return below > 0. ? above / below : nan; }

Vector place(const Point& p) { return p.position().cast<double>(); }

double angle(const Vector& u, const Vector& v) {  // degrees
  if (u.isZero(0.) || v.isZero(0.)) return nan;
  return std::atan2(u.cross(v).norm(), u.dot(v)) * (180. / std::numbers::pi);
}

// Metrics of sections.

double one(const Arbors&, const Branch&) { return 1.; }
double is_stem(const Arbors&, const Branch& b) { return b.parent < 0; }
double is_terminal(const Arbors&, const Branch& b) { return b.daughters == 0; }
double is_fork(const Arbors&, const Branch& b) { return b.daughters > 1; }
double segments(const Arbors& a, const Branch& b) { return double(a.points(b).size() - 1); }
double length(const Arbors&, const Branch& b) { return b.length; }
double terminal_length(const Arbors&, const Branch& b) { return b.daughters == 0 ? b.length : nan; }
double bifurcating_length(const Arbors&, const Branch& b) { return b.daughters == 2 ? b.length : nan; }
double area(const Arbors& a, const Branch& b) { return section_area(a.neuron(), b.id); }
double volume(const Arbors& a, const Branch& b) { return section_volume(a.neuron(), b.id); }
double chord(const Arbors& a, const Branch& b) {
  return segment_length(a.points(b).front(), a.points(b).back());
}
double tortuosity(const Arbors& a, const Branch& b) { return ratio(b.length, chord(a, b)); }
double contraction(const Arbors& a, const Branch& b) { return ratio(chord(a, b), b.length); }
double path_distance(const Arbors&, const Branch& b) { return b.path_distance; }
double radial_distance(const Arbors& a, const Branch& b) {
  return segment_length(a.origin(), a.points(b).back());
}
double order(const Arbors& a, const Branch& b) { return a.neuron().order(b.id); }
double strahler(const Arbors&, const Branch& b) { return b.strahler; }
double degree(const Arbors&, const Branch& b) { return b.degree; }
double stem_radius(const Arbors& a, const Branch& b) {
  return b.parent < 0 ? a.points(b).front().radius : nan;
}

double mean_radius(const Arbors& a, const Branch& b) {
  const auto points = a.points(b);
  double weighted = 0.;
  for (std::size_t i = 1; i < points.size(); ++i)
    weighted +=
        0.5 * (double(points[i - 1].radius) + points[i].radius) * segment_length(points[i - 1], points[i]);
  return ratio(weighted, b.length);
}

// The first point of a daughter repeats the branch point, often with the parent's radius: its own begins at
// the next.
double first_diameter(const Arbors& a, const Branch& b) {
  const auto points = a.points(b);
  return 2. * points[b.parent >= 0 ? 1 : 0].radius;
}

double last_diameter(const Arbors& a, const Branch& b) { return 2. * a.points(b).back().radius; }

double taper_1(const Arbors& a, const Branch& b) {
  return ratio(first_diameter(a, b) - last_diameter(a, b), b.length);
}

double taper_2(const Arbors& a, const Branch& b) {
  return ratio(first_diameter(a, b) - last_diameter(a, b), first_diameter(a, b));
}

// Slope of the regression line of diameter on path distance, in two passes.
double taper_rate(const Arbors& a, const Branch& b) {
  const auto points = a.points(b);
  std::vector<double> x(points.size(), 0.);
  double mean_x = 0., mean_y = 2. * points[0].radius;
  for (std::size_t i = 1; i < points.size(); ++i) {
    x[i] = x[i - 1] + segment_length(points[i - 1], points[i]);
    mean_x += x[i], mean_y += 2. * points[i].radius;
  }
  mean_x /= double(x.size()), mean_y /= double(x.size());
  double xy = 0., xx = 0.;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mean_x) * (2. * points[i].radius - mean_y);
    xx += (x[i] - mean_x) * (x[i] - mean_x);
  }
  return ratio(xy, xx);
}

double parent_daughter_ratio(const Arbors& a, const Branch& b) {
  return b.parent < 0 ? nan : ratio(first_diameter(a, b), last_diameter(a, a.section(std::size_t(b.parent))));
}

// Metrics of bifurcations.

struct Diameters {
  double parent, large, small;
};

Diameters diameters(const Arbors& a, const Bifurcation& b) {
  const double left = first_diameter(a, a.section(b.left)), right = first_diameter(a, a.section(b.right));
  return {last_diameter(a, a.section(b.parent)), std::max(left, right), std::min(left, right)};
}

double daughter_ratio(const Arbors& a, const Bifurcation& b) {
  const Diameters d = diameters(a, b);
  return ratio(d.large, d.small);
}

double sibling_ratio(const Arbors& a, const Bifurcation& b) {
  const Diameters d = diameters(a, b);
  return ratio(d.small, d.large);
}

double pk_classic(const Arbors& a, const Bifurcation& b) {
  const Diameters d = diameters(a, b);
  return ratio(std::pow(d.large, 1.5) + std::pow(d.small, 1.5), std::pow(d.parent, 1.5));
}

// large^n + small^n - parent^n, divided by parent^n, is convex in n and falls from 1 at n = 0 where both daughters are
// thinner: Newton's steps from there never go past the root.
double rall_power(const Arbors& a, const Bifurcation& b) {
  const Diameters d = diameters(a, b);
  const double p = std::log(ratio(d.large, d.parent)), q = std::log(ratio(d.small, d.parent));
  if (!(p < 0. && q < 0. && std::isfinite(q) && std::exp(5. * p) + std::exp(5. * q) <= 1.)) return nan;
  double n = 0.;
  for (int i = 0; i < 100; ++i) {
    const double u = std::exp(n * p), v = std::exp(n * q);
    const double step = (1. - u - v) / (p * u + q * v);
    n += step;
    if (std::abs(step) <= 1e-15 * n) break;
  }
  return n;
}

double partition_asymmetry(const Arbors& a, const Bifurcation& b) {
  const double n = a.section(b.left).degree, m = a.section(b.right).degree;
  return n == m ? 0. : std::abs(n - m) / (n + m - 2.);
}

Vector towards_end(const Arbors& a, std::uint32_t section) {
  const auto points = a.points(a.section(section));
  return place(points.back()) - place(points.front());
}

Vector towards_first(const Arbors& a, std::uint32_t section) {
  const auto points = a.points(a.section(section));
  const Vector start = place(points.front());
  for (const Point& p : points)
    if (place(p) != start) return place(p) - start;
  return Vector::Zero();
}

double local_angle(const Arbors& a, const Bifurcation& b) {
  return angle(towards_first(a, b.left), towards_first(a, b.right));
}

double remote_angle(const Arbors& a, const Bifurcation& b) {
  return angle(towards_end(a, b.left), towards_end(a, b.right));
}

double remote_tilt(const Arbors& a, const Bifurcation& b) {
  const Vector back = -towards_end(a, b.parent);
  return std::fmin(angle(back, towards_end(a, b.left)), angle(back, towards_end(a, b.right)));
}

// Metrics of the neuron.

double bifurcation_count(const Arbors& a) { return double(a.bifurcations().size()); }
double soma_area(const Arbors& a) {
  return a.neuron().soma().kind == SomaKind::none ? nan : a.neuron().soma().area();
}
double soma_radius(const Arbors& a) {
  return a.neuron().soma().kind == SomaKind::none ? nan : a.origin().radius;
}

double spine_count(const Arbors& a) {
  std::vector<bool> selected(a.neuron().sections().size());
  for (const Branch& b : a.sections()) selected[b.id.value()] = true;
  return double(std::ranges::count_if(a.neuron().spines(),
                                      [&](const Spine& s) { return selected[s.section.value()]; }));
}

double furthest(const Arbors& a) {
  double best = nan;
  for (const Branch& b : a.sections())
    for (const Point& p : a.points(b)) best = std::fmax(best, segment_length(a.origin(), p));
  return best;
}

template <int axis>
double extent(const Arbors& a) {
  Bounds box;
  for (const Branch& b : a.sections())
    for (const Point& p : a.points(b)) box.add(p.position());
  return box.empty() ? nan : double(box.high[axis]) - box.low[axis];
}

double fraction_above_soma(const Arbors& a) {
  double above = 0.;
  for (const Branch& b : a.sections()) {
    const auto points = a.points(b);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double from = double(points[i - 1].y) - a.origin().y, to = double(points[i].y) - a.origin().y;
      const double low = std::min(from, to), high = std::max(from, to);
      const double share = low >= 0. ? 1. : high <= 0. ? 0. : high / (high - low);
      above += share * segment_length(points[i - 1], points[i]);
    }
  }
  return ratio(above, sum<length>(a));
}

// Metrics of shells.

// Distance from the centre falls along a segment to its nearest point and rises after it; a shell of radius r
// is crossed by a rise or fall between d and D when d < r <= D, so that a shell through a joint is counted
// once.
Values sholl_crossings(const Arbors& a) {
  constexpr double last_shell = 1e5;  // 1 m: a stray point must not fill the memory
  Values counts;
  const auto count = [&](double low, double high) {
    low = std::min(low, last_shell * sholl_step), high = std::min(high, last_shell * sholl_step);
    for (std::size_t k = std::size_t(low / sholl_step) + 1; double(k) * sholl_step <= high; ++k) {
      if (counts.size() < k) counts.resize(k, 0.);
      ++counts[k - 1];
    }
  };
  const Vector centre = place(a.origin());
  for (const Branch& b : a.sections()) {
    const auto points = a.points(b);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vector from = place(points[i - 1]) - centre, to = place(points[i]) - centre;
      const double near = std::min(from.norm(), to.norm()), far = std::max(from.norm(), to.norm());
      const double t = -from.dot(to - from) / (to - from).squaredNorm();
      if (t > 0. && t < 1.) {
        const double nearest = (from + t * (to - from)).norm();
        count(nearest, near);
        count(nearest, far);
      } else {
        count(near, far);
      }
    }
  }
  return counts;
}

using enum Level;
constexpr bool axes_only = false, diameters_too = true;  // Metric::diameters

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"soma_surface_area", "µm²", neuron, diameters_too, per_neuron<soma_area>,
     "Surface of the soma: of its sphere, of its cylinders, or of the sphere with the mean radius of its contours.", "", "Soma_Surface"},
    {"soma_radius", "µm", neuron, diameters_too, per_neuron<soma_radius>,
     "Radius of the sphere that stands for the soma.", "", ""},
    {"number_of_neurites", "", neuron, axes_only, per_neuron<sum<is_stem>>,
     "Stems: sections that leave the soma.", "", "N_stems"},
    {"number_of_sections", "", neuron, axes_only, per_neuron<sum<one>>,
     "Sections between two nodes (soma, branch point, terminal).", "", "N_branch"},
    {"number_of_segments", "", neuron, axes_only, per_neuron<sum<segments>>,
     "Segments between two consecutive points.", "", ""},
    {"number_of_bifurcations", "", neuron, axes_only, per_neuron<bifurcation_count>,
     "Branch points with exactly two daughters.", "", "N_bifs"},
    {"number_of_forking_points", "", neuron, axes_only, per_neuron<sum<is_fork>>,
     "Branch points with two or more daughters.", "", ""},
    {"number_of_leaves", "", neuron, axes_only, per_neuron<sum<is_terminal>>,
     "Terminals (tips).", "", "N_tips"},
    {"number_of_spines", "", neuron, axes_only, per_neuron<spine_count>,
     "Spines that were traced.", "", ""},
    {"total_length", "µm", neuron, axes_only, per_neuron<sum<length>>,
     "Path length of all sections.", "", "Length"},
    {"total_area", "µm²", neuron, diameters_too, per_neuron<sum<area>>,
     "Lateral area of all segments as truncated cones.", "", "Surface"},
    {"total_volume", "µm³", neuron, diameters_too, per_neuron<sum<volume>>,
     "Volume of all segments as truncated cones.", "", "Volume"},
    {"max_path_distance", "µm", neuron, axes_only, per_neuron<largest<path_distance>>,
     "Longest way along a neurite from where it leaves the soma.", "", "PathDistance"},
    {"max_radial_distance", "µm", neuron, axes_only, per_neuron<furthest>,
     "Distance of the furthest point from the centre of the soma.", "", "EucDistance"},
    {"max_branch_order", "", neuron, axes_only, per_neuron<largest<order>>,
     "Highest centrifugal order.", "", "Branch_Order"},
    {"total_width", "µm", neuron, axes_only, per_neuron<extent<0>>,
     "Extent of the points along x.", "", "Width"},
    {"total_height", "µm", neuron, axes_only, per_neuron<extent<1>>,
     "Extent of the points along y, the direction of the pia.", "", "Height"},
    {"total_depth", "µm", neuron, axes_only, per_neuron<extent<2>>,
     "Extent of the points along z.", "", "Depth"},
    {"length_fraction_above_soma", "", neuron, axes_only, per_neuron<fraction_above_soma>,
     "Part of the path length that lies on the pia's side (larger y) of the centre of the soma.", "", ""},
    {"section_lengths", "µm", section, axes_only, per_section<length>,
     "Path length of the section.", "", "Branch_pathlength"},
    {"section_term_lengths", "µm", section, axes_only, per_section<terminal_length>,
     "Path length of a section that ends in a terminal.", "", ""},
    {"section_bif_lengths", "µm", section, axes_only, per_section<bifurcating_length>,
     "Path length of a section that ends in a bifurcation.", "", ""},
    {"section_areas", "µm²", section, diameters_too, per_section<area>,
     "Lateral area of the section.", "", ""},
    {"section_volumes", "µm³", section, diameters_too, per_section<volume>,
     "Volume of the section.", "", ""},
    {"section_mean_radii", "µm", section, diameters_too, per_section<mean_radius>,
     "Mean radius along the section, weighted by length.", "", ""},
    {"trunk_origin_radii", "µm", section, diameters_too, per_section<stem_radius>,
     "Radius at the start of a stem.", "", ""},
    {"section_path_distances", "µm", section, axes_only, per_section<path_distance>,
     "Way along the neurite from where it leaves the soma to the end of the section.", "", ""},
    {"section_radial_distances", "µm", section, axes_only, per_section<radial_distance>,
     "Straight distance from the centre of the soma to the end of the section.", "", ""},
    {"section_end_distances", "µm", section, axes_only, per_section<chord>,
     "Straight distance between the ends of the section.", "", ""},
    {"section_branch_orders", "", section, axes_only, per_section<order>,
     "Centrifugal order: 0 for a stem, one more at every branch point.", "Uylings & van Pelt 2002", ""},
    {"section_strahler_orders", "", section, axes_only, per_section<strahler>,
     "Centripetal order: 1 for a terminal section; the highest of the daughters', plus one where at least two share it.", "Horton 1945, Strahler 1957", ""},
    {"terminal_degree", "", section, axes_only, per_section<degree>,
     "Terminals at or beyond the section.", "van Pelt et al. 1992", "Terminal_degree"},
    {"section_tortuosity", "", section, axes_only, per_section<tortuosity>,
     "Path length over the straight distance between the ends.", "", ""},
    {"contraction", "", section, axes_only, per_section<contraction>,
     "Straight distance between the ends over path length.", "Scorcioni et al. 2008", "Contraction"},
    {"section_taper_rates", "", section, diameters_too, per_section<taper_rate>,
     "Slope of the regression of diameter on path length; negative where the section thins.", "", ""},
    {"taper_1", "", section, diameters_too, per_section<taper_1>,
     "Loss of diameter over length.", "Burke et al. 1992", "Taper_1"},
    {"taper_2", "", section, diameters_too, per_section<taper_2>,
     "Loss of diameter over the diameter at the start.", "Hillman 1979", "Taper_2"},
    {"parent_daughter_ratio", "", section, diameters_too, per_section<parent_daughter_ratio>,
     "Diameter at the start of a daughter over that at the end of its parent.", "Scorcioni et al. 2008", "Parent_Daughter_Ratio"},
    {"local_bifurcation_angles", "°", bifurcation, axes_only, per_bifurcation<local_angle>,
     "Angle between the first segments of the daughters.", "Scorcioni et al. 2008", "Bif_ampl_local"},
    {"remote_bifurcation_angles", "°", bifurcation, axes_only, per_bifurcation<remote_angle>,
     "Angle between the ends of the daughters, seen from the branch point.", "Scorcioni et al. 2008", "Bif_ampl_remote"},
    {"bif_tilt_remote", "°", bifurcation, axes_only, per_bifurcation<remote_tilt>,
     "Angle between the way back to the start of the parent and the end of a daughter; the smaller of two.", "Scorcioni et al. 2008", "Bif_tilt_remote"},
    {"partition_asymmetry", "", bifurcation, axes_only, per_bifurcation<partition_asymmetry>,
     "Difference of the daughters' terminal degrees n and m, abs(n - m) / (n + m - 2); 0 where n = m.", "van Pelt et al. 1992", "Partition_asymmetry"},
    {"sibling_ratios", "", bifurcation, diameters_too, per_bifurcation<sibling_ratio>,
     "Diameter of the thinner daughter over that of the thicker.", "", ""},
    {"daughter_ratio", "", bifurcation, diameters_too, per_bifurcation<daughter_ratio>,
     "Diameter of the thicker daughter over that of the thinner.", "Hillman 1979", "Daughter_Ratio"},
    {"rall_power", "", bifurcation, diameters_too, per_bifurcation<rall_power>,
     "The n in [0, 5] for which the daughters' diameters to the power n add up to the parent's; none where a daughter is as thick as the parent.", "Rall 1959", "Rall_Power"},
    {"pk_classic", "", bifurcation, diameters_too, per_bifurcation<pk_classic>,
     "Sum of the daughters' diameters to the power 3/2 over the parent's; 1 where impedances match.", "Rall 1959", "Pk_classic"},
    {"sholl_crossings", "", shell, axes_only, sholl_crossings,
     "Crossings of spheres about the soma, 10 µm apart.", "Sholl 1953", ""},
});
// clang-format on

}  // namespace

std::string_view name_of(Level level) {
  constexpr std::array<std::string_view, 4> names{"neuron", "section", "bifurcation", "shell"};
  return names[std::size_t(level)];
}

std::span<const Metric> metrics() { return table; }

const Metric* find_metric(std::string_view name) {
  const auto row = std::ranges::find_if(
      table, [&](const Metric& m) { return name == m.name || (!name.empty() && name == m.l_measure); });
  return row == table.end() ? nullptr : &*row;
}

}  // namespace forest::statistics
