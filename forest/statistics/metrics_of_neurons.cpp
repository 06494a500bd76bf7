// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "forest/statistics/extent.h"
#include "forest/statistics/metric_table.h"
#include "forest/statistics/shared.h"
#include "forest/statistics/sholl.h"

namespace forest::statistics {
namespace {

constexpr double pi = std::numbers::pi;

// Of the soma.

bool has_soma(const Arbors& a) { return a.neuron().soma().kind != SomaKind::none; }
double soma_area(const Arbors& a) { return has_soma(a) ? a.neuron().soma().area() : nan; }
double soma_radius(const Arbors& a) { return has_soma(a) ? a.origin().radius : nan; }
double soma_volume(const Arbors& a) {
  return has_soma(a) ? 4. / 3. * pi * std::pow(a.origin().radius, 3.) : nan;
}

// Counts and sums.

double stem_count(const Arbors& a) { return double(a.stems().size()); }
double is_fork(const Arbors&, const Branch& b) { return b.daughters > 1; }
double segments(const Arbors&, const Branch& b) { return double(b.row_count - 1); }
double bifurcation_count(const Arbors& a) { return double(a.bifurcations().size()); }

double spine_count(const Arbors& a) {
  if (a.neuron().spines().empty()) return 0.;
  std::vector<bool> selected(a.neuron().sections().size());
  for (const Branch& b : a.sections()) selected[b.id.value()] = true;
  return double(std::ranges::count_if(a.neuron().spines(),
                                      [&](const Spine& s) { return selected[s.section.value()]; }));
}
double spine_density(const Arbors& a) { return ratio(spine_count(a), sum<length>(a)); }
double spine_area_density(const Arbors& a) { return ratio(spine_count(a), sum<area>(a)); }

double cylinders_area(const Arbors& a) {
  const Columns& c = a.columns();
  double total = 0.;
  for (std::size_t row = 0; row < c.x.size(); ++row) total += c.radius[row] * c.length[row];
  return 2. * pi * total;
}
double cylinders_volume(const Arbors& a) {
  const Columns& c = a.columns();
  double total = 0.;
  for (std::size_t row = 0; row < c.x.size(); ++row) total += c.radius[row] * c.radius[row] * c.length[row];
  return pi * total;
}

// Extents.

double furthest(const Arbors& a) {
  const auto& distance = a.columns().distance;
  return distance.empty() ? nan : *std::ranges::max_element(distance);
}
double longest_way(const Arbors& a) {
  double best = nan;
  for (const Branch& b : a.sections()) best = std::fmax(best, b.path_distance);
  return best;
}
double highest_order(const Arbors& a) {
  double best = nan;
  for (const Branch& b : a.sections()) best = std::fmax(best, order(a, b));
  return best;
}

template <auto column>
double extent(const Arbors& a) {
  const std::vector<double>& at = a.columns().*column;
  if (at.empty()) return nan;
  const auto [low, high] = std::ranges::minmax(at);
  return high - low;
}
template <auto column>
double extent_95(const Arbors& a) {
  return extent_holding(0.95, a, a.columns().*column);
}

double fraction_above_soma(const Arbors& a) {
  const Columns& c = a.columns();
  const double soma = a.origin().y;
  double above = 0.;
  for (const Branch& b : a.sections())
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
      const double low = std::min(c.y[row - 1], c.y[row]) - soma,
                   high = std::max(c.y[row - 1], c.y[row]) - soma;
      above += high <= 0. ? 0. : low >= 0. ? c.length[row] : c.length[row] * (high / (high - low));
    }
  return ratio(above, sum<length>(a));
}

double length_fraction_along_z(const Arbors& a) {
  return ratio(sum<length_along<&Columns::z>>(a), sum<length>(a));
}
double level_segment_fraction(const Arbors& a) {
  constexpr double as_high = 1e-3;  // µm
  const Columns& c = a.columns();
  double level = 0., all = 0.;
  for (const Branch& b : a.sections())
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
      const double is_one = c.length[row] > 0.;
      all += is_one, level += is_one * double(std::abs(c.z[row] - c.z[row - 1]) < as_high);
    }
  return ratio(level, all);
}
double depth_by_width(const Arbors& a) {
  return ratio(sum<length_along<&Columns::z>>(a), sum<length_along<&Columns::x>>(a));
}

// Shape.

double hull_volume(const Arbors& a) { return a.sections().empty() ? nan : a.once<hulls>().volume; }
double volume_density(const Arbors& a) { return ratio(sum<volume>(a), a.once<hulls>().volume); }
double circularity(const Arbors& a) {
  const PlanarHull& front = a.once<hulls>().front;
  return ratio(4. * pi * front.area, front.perimeter * front.perimeter);
}
double shape_factor(const Arbors& a) {
  const PlanarHull& front = a.once<hulls>().front;
  return ratio(front.area, front.diameter * front.diameter);
}

/// Of the points seen along z, along the axes of their covariance.
double aspect_ratio(const Arbors& a) {
  const Columns& c = a.columns();
  if (c.x.empty()) return nan;
  double n = 0., x = 0., y = 0., xx = 0., xy = 0., yy = 0.;
  for (const Branch& b : a.sections())  // a daughter's first point is its parent's last
    for (std::size_t row = b.first_row + (b.parent >= 0); row <= b.last_row(); ++row) {
      const double px = c.x[row] - c.x[0], py = c.y[row] - c.y[0];
      ++n, x += px, y += py, xx += px * px, xy += px * py, yy += py * py;
    }
  const double turn = 0.5 * std::atan2(2. * (xy - x * y / n), (xx - x * x / n) - (yy - y * y / n));
  const double cosine = std::cos(turn), sine = std::sin(turn);
  double low_u = 1e300, high_u = -1e300, low_v = 1e300, high_v = -1e300;
  for (std::size_t row = 0; row < c.x.size(); ++row) {
    const double px = c.x[row] - c.x[0], py = c.y[row] - c.y[0];
    const double u = cosine * px + sine * py, v = cosine * py - sine * px;
    low_u = std::min(low_u, u), high_u = std::max(high_u, u);
    low_v = std::min(low_v, v), high_v = std::max(high_v, v);
  }
  const double u = high_u - low_u, v = high_v - low_v;
  return ratio(std::min(u, v), std::max(u, v));
}

// Sholl's analysis.

Values crossings(const Arbors& a) { return sholl_crossings(a); }

double sholl_maximum(const Arbors& a) {
  const Values& n = a.once<crossings>();
  return n.empty() ? 0. : *std::ranges::max_element(n);
}
double sholl_critical_radius(const Arbors& a) {
  const Values& n = a.once<crossings>();
  return n.empty() ? nan : sholl_step * double(std::ranges::max_element(n) - n.begin() + 1);
}
double sholl_ramification(const Arbors& a) { return ratio(sholl_maximum(a), stem_count(a)); }
double sholl_centroid(const Arbors& a) {
  const Values& n = a.once<crossings>();
  double moment = 0., total = 0.;
  for (std::size_t k = 0; k < n.size(); ++k) moment += double(k + 1) * sholl_step * n[k], total += n[k];
  return ratio(moment, total);
}
double sholl_decay(const Arbors& a) {
  const Values& n = a.once<crossings>();
  Values radius, density;
  for (std::size_t k = 0; k < n.size(); ++k) {
    if (n[k] == 0.) continue;
    radius.push_back(double(k + 1) * sholl_step);
    density.push_back(std::log(n[k] / (pi * radius.back() * radius.back())));
  }
  return -regression_slope(radius, density);
}

// Horton's laws: of streams of order 1, 2, … count, length and diameter are geometric series.

template <auto member>
double horton_ratio(const Arbors& a) {
  Values order, logarithm;
  for (const double value : a.once<streams>().*member) {
    order.push_back(double(order.size() + 1));
    logarithm.push_back(std::log(value));
  }
  const double slope = regression_slope(order, logarithm);
  const double ratio = std::exp(member == &Streams::count ? -slope : slope);
  return std::isfinite(ratio) ? ratio : nan;
}
double highest_strahler(const Arbors& a) {
  double best = nan;
  for (const Branch& b : a.sections()) best = std::fmax(best, b.strahler);
  return best;
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"soma_surface_area", "µm²", neuron, diameters_too, per_neuron<soma_area>,
     "Surface of the soma: of its sphere, of its cylinders, or of the sphere with the mean radius of its contours.", "NeuroM", "Soma_Surface"},
    {"soma_volume", "µm³", neuron, diameters_too, per_neuron<soma_volume>,
     "Volume of the sphere that stands for the soma.", "NeuroM", ""},
    {"soma_radius", "µm", neuron, diameters_too, per_neuron<soma_radius>,
     "Radius of the sphere that stands for the soma.", "NeuroM", ""},
    {"number_of_neurites", "", neuron, axes_only, per_neuron<stem_count>,
     "Stems: sections that leave the soma.", "NeuroM", "N_stems"},
    {"number_of_sections", "", neuron, axes_only, per_neuron<sum<one>>,
     "Sections between two nodes (soma, branch point, terminal).", "NeuroM", "N_branch"},
    {"number_of_segments", "", neuron, axes_only, per_neuron<sum<segments>>,
     "Segments between two consecutive points.", "NeuroM", ""},
    {"number_of_bifurcations", "", neuron, axes_only, per_neuron<bifurcation_count>,
     "Branch points with exactly two daughters.", "NeuroM", "N_bifs"},
    {"number_of_forking_points", "", neuron, axes_only, per_neuron<sum<is_fork>>,
     "Branch points with two or more daughters.", "NeuroM", ""},
    {"number_of_leaves", "", neuron, axes_only, per_neuron<sum<is_terminal>>,
     "Terminals (tips).", "NeuroM", "N_tips"},
    {"number_of_spines", "", neuron, axes_only, per_neuron<spine_count>,
     "Spines that were traced.", "", ""},
    {"spine_density", "1/µm", neuron, axes_only, per_neuron<spine_density>,
     "Spines that were traced over the path length of all sections.", "", ""},
    {"spine_area_density", "1/µm²", neuron, diameters_too, per_neuron<spine_area_density>,
     "Spines that were traced over the lateral area of all sections.", "", ""},
    {"total_length", "µm", neuron, axes_only, per_neuron<sum<length>>,
     "Path length of all sections.", "NeuroM", "Length"},
    {"total_area", "µm²", neuron, diameters_too, per_neuron<sum<area>>,
     "Lateral area of all segments as truncated cones.", "NeuroM", ""},
    {"total_volume", "µm³", neuron, diameters_too, per_neuron<sum<volume>>,
     "Volume of all segments as truncated cones.", "NeuroM", ""},
    {"surface", "µm²", neuron, diameters_too, per_neuron<cylinders_area>,
     "Lateral area of all segments as cylinders with the diameter d of their end: Σ π d l.", "Scorcioni et al. 2008", "Surface"},
    {"volume", "µm³", neuron, diameters_too, per_neuron<cylinders_volume>,
     "Volume of all segments as cylinders with the radius r of their end: Σ π r² l.", "Scorcioni et al. 2008", "Volume"},
    {"max_path_distance", "µm", neuron, axes_only, per_neuron<longest_way>,
     "Longest way along a neurite from where it leaves the soma.", "Scorcioni et al. 2008", "PathDistance"},
    {"max_radial_distance", "µm", neuron, axes_only, per_neuron<furthest>,
     "Distance of the furthest point from the centre of the soma.", "NeuroM", "EucDistance"},
    {"max_branch_order", "", neuron, axes_only, per_neuron<highest_order>,
     "Highest centrifugal order.", "Scorcioni et al. 2008", "Branch_Order"},
    {"total_width", "µm", neuron, axes_only, per_neuron<extent<&Columns::x>>,
     "Extent of the points along x.", "NeuroM", ""},
    {"total_height", "µm", neuron, axes_only, per_neuron<extent<&Columns::y>>,
     "Extent of the points along y, the direction of the pia.", "NeuroM", ""},
    {"total_depth", "µm", neuron, axes_only, per_neuron<extent<&Columns::z>>,
     "Extent of the points along z.", "NeuroM", ""},
    {"width", "µm", neuron, axes_only, per_neuron<extent_95<&Columns::x>>,
     "Least extent along x that holds 95 % of the path length, each segment counted where it ends.", "Scorcioni et al. 2008", "Width"},
    {"height", "µm", neuron, axes_only, per_neuron<extent_95<&Columns::y>>,
     "Least extent along y that holds 95 % of the path length.", "Scorcioni et al. 2008", "Height"},
    {"depth", "µm", neuron, axes_only, per_neuron<extent_95<&Columns::z>>,
     "Least extent along z that holds 95 % of the path length.", "Scorcioni et al. 2008", "Depth"},
    {"length_fraction_above_soma", "", neuron, axes_only, per_neuron<fraction_above_soma>,
     "Part of the path length that lies on the pia's side (larger y) of the centre of the soma.", "NeuroM", ""},
    {"length_fraction_along_z", "", neuron, axes_only, per_neuron<length_fraction_along_z>,
     "Way along z, forth or back, over path length: Σ abs(Δz) / Σ l. It sees a wrong depth of a slice, or a wrong step between its pictures.", "", ""},
    {"level_segment_fraction", "", neuron, axes_only, per_neuron<level_segment_fraction>,
     "Part of the segments with a length that do not change z, by .001 µm or more. Somebody at a microscope follows a branch in one plane of focus, and goes on to the next; who turns or bends a neuron leaves no such segments.", "", ""},
    {"length_along_z_by_x", "", neuron, axes_only, per_neuron<depth_by_width>,
     "Way along z over way along x: Σ abs(Δz) / Σ abs(Δx).", "", ""},
    {"hull_volume", "µm³", neuron, axes_only, per_neuron<hull_volume>,
     "Volume of the convex hull of all points; 0 where they lie in one plane.", "", ""},
    {"volume_density", "", neuron, diameters_too, per_neuron<volume_density>,
     "Volume of all segments over that of the convex hull of their points; none where they lie in one plane.", "NeuroM", ""},
    {"aspect_ratio", "", neuron, axes_only, per_neuron<aspect_ratio>,
     "Of the points seen along z, extent along the lesser over that along the greater of their principal axes.", "NeuroM", ""},
    {"circularity", "", neuron, axes_only, per_neuron<circularity>,
     "Of the points seen along z, 4 π area / perimeter² of their convex hull: 1 for a circle.", "NeuroM", ""},
    {"shape_factor", "", neuron, axes_only, per_neuron<shape_factor>,
     "Of the points seen along z, area of their convex hull over the square of the greatest distance between two of them.", "NeuroM", ""},
    {"fractal_dimension_boxes", "", neuron, axes_only, per_neuron<box_dimension>,
     "Slope of the regression of log N on -log(side), N the cubes of side L/2, L/4, … L/64 that hold a piece of a branch, L the greatest extent along x, y or z.", "Smith et al. 1989", ""},
    {"sholl_maximum", "", neuron, axes_only, per_neuron<sholl_maximum>,
     "Most crossings of a sphere, of those of radius 10, 20, 30 µm … about the centre of the soma.", "Sholl 1953", ""},
    {"sholl_critical_radius", "µm", neuron, axes_only, per_neuron<sholl_critical_radius>,
     "Radius of the first sphere that is crossed most.", "Sholl 1953", ""},
    {"sholl_centroid", "µm", neuron, axes_only, per_neuron<sholl_centroid>,
     "Mean radius of the spheres, weighted by their crossings.", "", ""},
    {"sholl_ramification", "", neuron, axes_only, per_neuron<sholl_ramification>,
     "Most crossings of a sphere over the number of stems.", "Schoenen 1982", ""},
    {"sholl_decay", "1/µm", neuron, axes_only, per_neuron<sholl_decay>,
     "Sholl's regression coefficient k of ln(N / (π r²)) = -k r + m, over the spheres of radius r with N > 0 crossings.", "Sholl 1953", ""},
    {"max_strahler_order", "", neuron, axes_only, per_neuron<highest_strahler>,
     "Highest centripetal order.", "Horton 1945, Strahler 1957", ""},
    {"horton_bifurcation_ratio", "", neuron, axes_only, per_neuron<horton_ratio<&Streams::count>>,
     "exp(-slope) of the regression of ln(number of streams) on Strahler order; a stream is a run of sections of one order.", "Horton 1945, Strahler 1957", ""},
    {"horton_length_ratio", "", neuron, axes_only, per_neuron<horton_ratio<&Streams::mean_length>>,
     "exp(slope) of the regression of ln(mean path length of the streams) on Strahler order.", "Horton 1945, Strahler 1957", ""},
    {"horton_diameter_ratio", "", neuron, diameters_too, per_neuron<horton_ratio<&Streams::mean_diameter>>,
     "exp(slope) of the regression of ln(mean diameter of the streams, weighted by length) on Strahler order.", "Horton 1945, Strahler 1957", ""},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_neurons() { return table; }

}  // namespace forest::statistics
