// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "forest/statistics/metric_table.h"
#include "forest/statistics/shared.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

// Diameters.

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

double powers_ratio(const Diameters& d, double power) {
  return ratio(std::pow(d.large, power) + std::pow(d.small, power), std::pow(d.parent, power));
}
double pk_classic(const Arbors& a, const Bifurcation& b) { return powers_ratio(diameters(a, b), 1.5); }
double pk_2(const Arbors& a, const Bifurcation& b) { return powers_ratio(diameters(a, b), 2.); }

Values powers(const Arbors& a) { return a.once<rall_powers>(); }

Values pk(const Arbors& a) {
  const double power = mean(a.once<rall_powers>());
  Values values;
  for (const Bifurcation& b : a.bifurcations()) values.push_back(powers_ratio(diameters(a, b), power));
  return values;
}

double diameter_power_relation(const Arbors& a, const Bifurcation& b) {
  const Diameters d = diameters(a, b);
  return std::pow(ratio(d.parent, d.large), 1.5) + std::pow(ratio(d.parent, d.small), 1.5);
}

bool is_last(const Arbors& a, const Bifurcation& b) {
  return a.section(b.left).daughters == 0 && a.section(b.right).daughters == 0;
}

double last_parent_diameter(const Arbors& a, const Bifurcation& b) {
  return is_last(a, b) ? last_diameter(a, a.section(b.parent)) : nan;
}

/// At the first point that is `way` from the start of the section; at its end when it is shorter.
double diameter_after(const Arbors& a, const Branch& b, double way) {
  const Columns& c = a.columns();
  std::size_t row = b.first_row + 1;
  while (row < b.last_row() && c.path[row] - c.path[b.first_row] < way) ++row;
  return 2. * c.radius[row];
}

Values hillman_threshold(const Arbors& a) {
  double way = 0.;
  for (const Branch& b : a.sections()) way += b.length / double(a.sections().size());
  Values values;
  for (const Bifurcation& b : a.bifurcations())
    values.push_back(is_last(a, b) ? 0.5 * last_diameter(a, a.section(b.parent)) +
                                         0.25 * diameter_after(a, a.section(b.left), way) +
                                         0.25 * diameter_after(a, a.section(b.right), way)
                                   : nan);
  return values;
}

// Partitions.

double terminals(const Arbors& a, std::uint32_t section) { return a.section(section).degree; }

double partition_asymmetry(const Arbors& a, const Bifurcation& b) {
  const double n = terminals(a, b.left), m = terminals(a, b.right);
  return n == m ? 0. : std::abs(n - m) / (n + m - 2.);
}

/// Of each section, sections and path length at and beyond it.
struct Beyond {
  std::vector<double> sections, length;
};

Beyond beyond(const Arbors& a) {
  Beyond all;
  for (const Branch& b : a.sections()) all.sections.push_back(1.), all.length.push_back(b.length);
  for (std::size_t i = a.sections().size(); i-- > 0;)
    if (const std::int32_t parent = a.section(i).parent; parent >= 0) {
      all.sections[std::size_t(parent)] += all.sections[i];
      all.length[std::size_t(parent)] += all.length[i];
    }
  return all;
}

double first_partition(const Arbors& a, const Bifurcation& b) { return a.once<beyond>().sections[b.left]; }
double second_partition(const Arbors& a, const Bifurcation& b) { return a.once<beyond>().sections[b.right]; }

double partition(const Arbors& a, const Bifurcation& b) {
  const double n = first_partition(a, b), m = second_partition(a, b);
  return std::max(n, m) / std::min(n, m);
}

double petilla_asymmetry(const Arbors& a, const Bifurcation& b) {
  const double n = first_partition(a, b), m = second_partition(a, b);
  return std::abs(n - m) / (n + m);
}

double length_asymmetry(const Arbors& a, const Bifurcation& b) {
  const auto& length = a.once<beyond>().length;
  return ratio(std::abs(length[b.left] - length[b.right]), length[a.stems()[a.section(b.parent).arbor]]);
}

// Angles. Remote is towards the end of a section, local along its first segment that has length.

Vector remote(const Arbors& a, std::uint32_t section) {
  const Branch& b = a.section(section);
  return place(a.columns(), b.last_row()) - place(a.columns(), b.first_row);
}

Vector local(const Arbors& a, std::uint32_t section) {
  const Branch& b = a.section(section);
  for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row)
    if (const Vector way = place(a.columns(), row) - place(a.columns(), b.first_row); !way.isZero(0.))
      return way;
  return Vector::Zero();
}

/// From its end along the last segment that has length.
Vector local_back(const Arbors& a, std::uint32_t section) {
  const Branch& b = a.section(section);
  for (std::size_t row = b.last_row(); row-- > b.first_row;)
    if (const Vector way = place(a.columns(), row) - place(a.columns(), b.last_row()); !way.isZero(0.))
      return way;
  return Vector::Zero();
}

using Way = Vector(const Arbors&, std::uint32_t);

template <Way way>
double amplitude(const Arbors& a, const Bifurcation& b) {
  return angle(way(a, b.left), way(a, b.right));
}

double tilt(const Vector& back, const Vector& left, const Vector& right) {
  return std::fmin(angle(back, left), angle(back, right));
}
double remote_tilt(const Arbors& a, const Bifurcation& b) {
  return tilt(-remote(a, b.parent), remote(a, b.left), remote(a, b.right));
}
double local_tilt(const Arbors& a, const Bifurcation& b) {
  return tilt(local_back(a, b.parent), local(a, b.left), local(a, b.right));
}

/// Angle between the normals of a bifurcation's plane and of that before it.
template <Way way>
Values torque(const Arbors& a) {
  std::vector<Vector> normal_above(a.sections().size(),
                                   Vector::Zero());  // of the bifurcation a section starts from
  for (const Bifurcation& b : a.bifurcations())
    normal_above[b.left] = normal_above[b.right] = way(a, b.left).cross(way(a, b.right));
  Values values;
  for (const Bifurcation& b : a.bifurcations())
    values.push_back(angle(normal_above[b.parent], normal_above[b.left]));
  return values;
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"local_bifurcation_angles", "°", bifurcation, axes_only, per_bifurcation<amplitude<local>>,
     "Angle between the first segments of the daughters.", "Scorcioni et al. 2008", "Bif_ampl_local"},
    {"remote_bifurcation_angles", "°", bifurcation, axes_only, per_bifurcation<amplitude<remote>>,
     "Angle between the ends of the daughters, seen from the branch point.", "Scorcioni et al. 2008", "Bif_ampl_remote"},
    {"bif_tilt_local", "°", bifurcation, axes_only, per_bifurcation<local_tilt>,
     "Angle between the last segment of the parent, seen backwards, and the first of a daughter; the smaller of two.", "Scorcioni et al. 2008", "Bif_tilt_local"},
    {"bif_tilt_remote", "°", bifurcation, axes_only, per_bifurcation<remote_tilt>,
     "Angle between the way back to the start of the parent and the end of a daughter; the smaller of two.", "Scorcioni et al. 2008", "Bif_tilt_remote"},
    {"bif_torque_local", "°", bifurcation, axes_only, torque<local>,
     "Angle between the planes of the bifurcation and of the one that its parent comes from: of the normals first × second daughter, in the order of the file, of the daughters' first segments.", "Scorcioni et al. 2008", "Bif_torque_local"},
    {"bif_torque_remote", "°", bifurcation, axes_only, torque<remote>,
     "The same with the ends of the daughters.", "Scorcioni et al. 2008", "Bif_torque_remote"},
    {"partition_asymmetry", "", bifurcation, axes_only, per_bifurcation<partition_asymmetry>,
     "Difference of the daughters' terminal degrees n and m, abs(n - m) / (n + m - 2); 0 where n = m. NeuroM's method 'uylings'.", "van Pelt et al. 1992", "Partition_asymmetry"},
    {"partition_asymmetry_petilla", "", bifurcation, axes_only, per_bifurcation<petilla_asymmetry>,
     "Of the numbers n and m of sections at and beyond each daughter, abs(n - m) / (n + m): NeuroM's method 'petilla'.", "Ascoli et al. 2008", ""},
    {"partition_asymmetry_length", "", bifurcation, axes_only, per_bifurcation<length_asymmetry>,
     "Difference of the path lengths at and beyond the daughters over the path length of the arbor.", "NeuroM", ""},
    {"bifurcation_partitions", "", bifurcation, axes_only, per_bifurcation<partition>,
     "Of the numbers of sections at and beyond each daughter, the larger over the smaller.", "NeuroM", ""},
    {"partition_pairs_first", "", bifurcation, axes_only, per_bifurcation<first_partition>,
     "Sections at and beyond the first daughter, in the order of the file.", "NeuroM", ""},
    {"partition_pairs_second", "", bifurcation, axes_only, per_bifurcation<second_partition>,
     "Sections at and beyond the second daughter.", "NeuroM", ""},
    {"sibling_ratios", "", bifurcation, diameters_too, per_bifurcation<sibling_ratio>,
     "Diameter of the thinner daughter over that of the thicker.", "NeuroM", ""},
    {"daughter_ratio", "", bifurcation, diameters_too, per_bifurcation<daughter_ratio>,
     "Diameter of the thicker daughter over that of the thinner.", "Hillman 1979", "Daughter_Ratio"},
    {"rall_power", "", bifurcation, diameters_too, powers,
     "The n in [0, 5] for which the daughters' diameters to the power n add up to the parent's; none where a daughter is as thick as the parent.", "Rall 1959", "Rall_Power"},
    {"pk", "", bifurcation, diameters_too, pk,
     "Sum of the daughters' diameters to the power n over the parent's, with the mean n of rall_power over the neuron.", "Rall 1959", "Pk"},
    {"pk_classic", "", bifurcation, diameters_too, per_bifurcation<pk_classic>,
     "Sum of the daughters' diameters to the power 3/2 over the parent's; 1 where impedances match.", "Rall 1959", "Pk_classic"},
    {"pk_2", "", bifurcation, diameters_too, per_bifurcation<pk_2>,
     "Sum of the squares of the daughters' diameters over that of the parent's; 1 where cross sections match.", "Rall 1959", "Pk_2"},
    {"diameter_power_relations", "", bifurcation, diameters_too, per_bifurcation<diameter_power_relation>,
     "Sum over the daughters of (diameter of the parent / of the daughter) to the power 3/2.", "Ascoli et al. 2008", ""},
    {"last_parent_diam", "µm", bifurcation, diameters_too, per_bifurcation<last_parent_diameter>,
     "Diameter of the parent at a bifurcation of two terminal sections.", "Scorcioni et al. 2008", "Last_parent_diam"},
    {"hillman_threshold", "µm", bifurcation, diameters_too, hillman_threshold,
     "At a bifurcation of two terminal sections, half the diameter of the parent and a quarter of each daughter's, a mean section length further on.", "Hillman 1979", "HillmanThreshold"},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_bifurcations() { return table; }

}  // namespace forest::statistics
