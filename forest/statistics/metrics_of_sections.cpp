// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "forest/statistics/metric_table.h"

namespace forest::statistics {
namespace {

double chord(const Arbors& a, const Branch& b) {
  return (place(a.columns(), b.last_row()) - place(a.columns(), b.first_row)).norm();
}
double tortuosity(const Arbors& a, const Branch& b) { return ratio(b.length, chord(a, b)); }
double contraction(const Arbors& a, const Branch& b) { return ratio(chord(a, b), b.length); }
double path_distance(const Arbors&, const Branch& b) { return b.path_distance; }
double radial_distance(const Arbors& a, const Branch& b) {
  const Columns& c = a.columns();
  return (place(c, b.last_row()) - place(c, a.section(a.stems()[b.arbor]).first_row)).norm();
}
double strahler(const Arbors&, const Branch& b) { return b.strahler; }
double degree(const Arbors&, const Branch& b) { return b.degree; }
double segments(const Arbors&, const Branch& b) { return double(b.row_count - 1); }
double type(const Arbors& a, const Branch& b) { return double(a.neuron().section(b.id).kind); }

double mean_radius(const Arbors& a, const Branch& b) {
  const Columns& c = a.columns();
  double weighted = 0.;
  for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row)
    weighted += 0.5 * (c.radius[row - 1] + c.radius[row]) * c.length[row];
  return ratio(weighted, b.length);
}

double taper_1(const Arbors& a, const Branch& b) {
  return ratio(first_diameter(a, b) - last_diameter(a, b), b.length);
}
double taper_2(const Arbors& a, const Branch& b) {
  return ratio(first_diameter(a, b) - last_diameter(a, b), first_diameter(a, b));
}

double taper_rate(const Arbors& a, const Branch& b) {
  const Columns& c = a.columns();
  const std::span path(c.path.data() + b.first_row, b.row_count),
      radius(c.radius.data() + b.first_row, b.row_count);
  return 2. * regression_slope(path, radius);
}

double parent_daughter_ratio(const Arbors& a, const Branch& b) {
  return b.parent < 0 ? nan : ratio(first_diameter(a, b), last_diameter(a, a.section(std::size_t(b.parent))));
}

double diameter_threshold(const Arbors& a, const Branch& b) {
  return b.parent < 0 || b.daughters > 0 ? nan : first_diameter(a, b);
}

/// Where the section passes path distance `path`, between the rows before and at `row`.
Vector interpolated(const Columns& c, std::size_t row, double path) {
  const double t = c.length[row] > 0. ? (path - c.path[row - 1]) / c.length[row] : 1.;
  return place(c, row - 1) + t * (place(c, row) - place(c, row - 1));
}

template <int scale>  // µm
double tortuosity_over(const Arbors& a, const Branch& b) {
  if (b.length < scale) return nan;
  const Columns& c = a.columns();
  double chords = 0., ends = c.path[b.first_row] + scale, pieces = 0.;
  Vector from = place(c, b.first_row);
  for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
    if (ends > c.path[row]) continue;
    const double more = std::floor((c.path[row] - ends) / scale);  // straight pieces on the same segment
    chords += (interpolated(c, row, ends) - from).norm() + more * scale;
    pieces += 1. + more;
    from = interpolated(c, row, ends + more * scale);
    ends += (1. + more) * scale;
  }
  return ratio(pieces * scale, chords);
}

/// The logarithms of all sections' ways and straight distances are taken at once, because that is four times as quick.
Values fractal_dimensions(const Arbors& a) {
  const Columns& c = a.columns();
  const auto rows = Eigen::Index(c.x.size());
  Eigen::ArrayXd path(rows), chord(rows);
  std::vector<Eigen::Index> ends;
  Eigen::Index count = 0;
  for (const Branch& b : a.sections()) {
    const std::size_t end = b.last_row();
    for (std::size_t row = b.first_row; row < end; ++row) {
      const double x = c.x[row] - c.x[end], y = c.y[row] - c.y[end], z = c.z[row] - c.z[end];
      chord[count] = x * x + y * y + z * z, path[count] = c.path[end] - c.path[row];
      count += chord[count] > 0. && path[count] > 0.;
    }
    ends.push_back(count);
  }
  path.head(count) = path.head(count).log();
  chord.head(count) = 0.5 * chord.head(count).log();
  Values values;
  Eigen::Index begin = 0;
  for (const Eigen::Index end : ends) {
    const auto points = std::size_t(end - begin);
    values.push_back(
        points < 3 ? nan : regression_slope({chord.data() + begin, points}, {path.data() + begin, points}));
    begin = end;
  }
  return values;
}

std::vector<double> spines_of(const Arbors& a) {
  std::vector<double> counts(a.neuron().sections().size(), 0.);
  for (const Spine& s : a.neuron().spines()) ++counts[s.section.value()];
  return counts;
}

Values spine_counts(const Arbors& a) {
  const std::vector<double> counts = spines_of(a);
  Values values;
  for (const Branch& b : a.sections()) values.push_back(counts[b.id.value()]);
  return values;
}

double fraction_along_z(const Arbors& a, const Branch& b) {
  return ratio(length_along<&Columns::z>(a, b), b.length);
}

Values spine_densities(const Arbors& a) {
  Values values = spine_counts(a);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = ratio(values[i], a.section(i).length);
  return values;
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"section_lengths", "µm", section, axes_only, per_section<length>,
     "Path length of the section: the sum of the lengths of its segments.", "NeuroM", "Branch_pathlength"},
    {"section_term_lengths", "µm", section, axes_only, per_section<ending_in<length, terminal>>,
     "Path length of a section that ends in a terminal.", "NeuroM", ""},
    {"section_bif_lengths", "µm", section, axes_only, per_section<ending_in<length, bifurcation_of>>,
     "Path length of a section that ends in a bifurcation.", "NeuroM", ""},
    {"section_areas", "µm²", section, diameters_too, per_section<area>,
     "Lateral area of the section: the sum over its segments as truncated cones.", "NeuroM", ""},
    {"section_volumes", "µm³", section, diameters_too, per_section<volume>,
     "Volume of the section: the sum over its segments as truncated cones.", "NeuroM", ""},
    {"section_mean_radii", "µm", section, diameters_too, per_section<mean_radius>,
     "Mean radius along the section, weighted by length.", "", ""},
    {"section_path_distances", "µm", section, axes_only, per_section<path_distance>,
     "Way along the neurite from where it leaves the soma to the end of the section.", "NeuroM", ""},
    {"terminal_path_lengths", "µm", section, axes_only, per_section<ending_in<path_distance, terminal>>,
     "Way along the neurite from where it leaves the soma to a terminal.", "NeuroM", ""},
    {"section_radial_distances", "µm", section, axes_only, per_section<radial_distance>,
     "Straight distance from the start of the arbor to the end of the section.", "NeuroM", ""},
    {"section_term_radial_distances", "µm", section, axes_only, per_section<ending_in<radial_distance, terminal>>,
     "Straight distance from the start of the arbor to a terminal.", "NeuroM", ""},
    {"section_bif_radial_distances", "µm", section, axes_only, per_section<ending_in<radial_distance, bifurcation_of>>,
     "Straight distance from the start of the arbor to a bifurcation.", "NeuroM", ""},
    {"section_end_distances", "µm", section, axes_only, per_section<chord>,
     "Straight distance between the ends of the section.", "NeuroM", ""},
    {"section_branch_orders", "", section, axes_only, per_section<order>,
     "Centrifugal order: 0 for a stem, one more at every branch point, and where a branch goes on as one of another kind.", "Uylings & van Pelt 2002", ""},
    {"section_term_branch_orders", "", section, axes_only, per_section<ending_in<order, terminal>>,
     "Centrifugal order of a section that ends in a terminal.", "Uylings & van Pelt 2002", ""},
    {"section_bif_branch_orders", "", section, axes_only, per_section<ending_in<order, bifurcation_of>>,
     "Centrifugal order of a section that ends in a bifurcation.", "Uylings & van Pelt 2002", ""},
    {"section_strahler_orders", "", section, axes_only, per_section<strahler>,
     "Centripetal order: 1 for a terminal section; the highest of the daughters', plus one where at least two share it.", "Horton 1945, Strahler 1957", ""},
    {"terminal_degree", "", section, axes_only, per_section<degree>,
     "Terminals at or beyond the section.", "van Pelt et al. 1992", "Terminal_degree"},
    {"section_tortuosity", "", section, axes_only, per_section<tortuosity>,
     "Path length over the straight distance between the ends.", "NeuroM", ""},
    {"tortuosity_10", "", section, axes_only, per_section<tortuosity_over<10>>,
     "Tortuosity over 10 µm: of as many pieces of 10 µm of path as follow one another from the start of the section, their path length over the sum of their straight distances; none in a shorter section.", "", ""},
    {"tortuosity_25", "", section, axes_only, per_section<tortuosity_over<25>>,
     "The same over 25 µm.", "", ""},
    {"tortuosity_50", "", section, axes_only, per_section<tortuosity_over<50>>,
     "The same over 50 µm.", "", ""},
    {"tortuosity_100", "", section, axes_only, per_section<tortuosity_over<100>>,
     "The same over 100 µm.", "", ""},
    {"section_length_fractions_along_z", "", section, axes_only, per_section<fraction_along_z>,
     "Way along z, forth or back, over path length.", "", ""},
    {"contraction", "", section, axes_only, per_section<contraction>,
     "Straight distance between the ends over path length.", "Scorcioni et al. 2008", "Contraction"},
    {"fractal_dim", "", section, axes_only, fractal_dimensions,
     "Slope of the regression of log(way) on log(straight distance), both from the end of the section to its other points: 1 where it is straight; none with fewer than three of them.", "Scorcioni et al. 2008", "Fractal_Dim"},
    {"fragmentation", "", section, axes_only, per_section<segments>,
     "Segments of the section.", "Scorcioni et al. 2008", "Fragmentation"},
    {"type", "", section, axes_only, per_section<type>,
     "Kind of the section as SWC's number: 2 axon, 3 basal, 4 apical, 5 custom, 6 unspecified, 7 glia, 0 undefined.", "Scorcioni et al. 2008", "Type"},
    {"section_taper_rates", "", section, diameters_too, per_section<taper_rate>,
     "Slope of the regression of diameter on path length; negative where the section thins.", "NeuroM", ""},
    {"taper_1", "", section, diameters_too, per_section<taper_1>,
     "Loss of diameter over length, (d - e) / l with the diameters d at the start and e at the end.", "Burke et al. 1992", "Taper_1"},
    {"taper_2", "", section, diameters_too, per_section<taper_2>,
     "Loss of diameter over the diameter at the start, (d - e) / d.", "Hillman 1979", "Taper_2"},
    {"parent_daughter_ratio", "", section, diameters_too, per_section<parent_daughter_ratio>,
     "Diameter at the start of a daughter over that at the end of its parent.", "Scorcioni et al. 2008", "Parent_Daughter_Ratio"},
    {"diam_threshold", "µm", section, diameters_too, per_section<diameter_threshold>,
     "Diameter at the start of a terminal section, after the last branch point.", "Scorcioni et al. 2008", "Diam_threshold"},
    {"section_spine_counts", "", section, axes_only, spine_counts,
     "Spines that were traced on the section.", "", ""},
    {"section_spine_densities", "1/µm", section, axes_only, spine_densities,
     "Spines that were traced on the section over its length.", "", ""},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_sections() { return table; }

}  // namespace forest::statistics
