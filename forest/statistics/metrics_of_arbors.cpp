// SPDX-License-Identifier: Apache-2.0
// Of each arbor: what NeuroM calls a neurite, with its trunk.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "forest/statistics/metric_table.h"
#include "forest/statistics/shared.h"

namespace forest::statistics {
namespace {

constexpr double degrees = 180. / std::numbers::pi;

/// From the centre of the soma to the start of the arbor.
Vector trunk(const Arbors& a, const Branch& stem) {
  return place(a.columns(), stem.first_row) - place(a.origin());
}

template <int axis>
double trunk_vector(const Arbors& a, const Branch& stem) {
  return trunk(a, stem)[axis];
}
double azimuth(const Arbors& a, const Branch& stem) {
  const Vector v = trunk(a, stem);
  return v.x() == 0. && v.z() == 0. ? nan : std::atan2(v.z(), v.x()) * degrees;
}
double elevation(const Arbors& a, const Branch& stem) {
  const Vector v = trunk(a, stem);
  return v.isZero(0.) ? nan : std::atan2(v.y(), std::hypot(v.x(), v.z())) * degrees;
}
double angle_from_pia(const Arbors& a, const Branch& stem) { return angle(trunk(a, stem), Vector::UnitY()); }

Values trunk_angles(const Arbors& a) {
  std::vector<double> turned;  // of each trunk in the plane, from y, counterclockwise
  for (const std::uint32_t stem : a.stems()) {
    const Vector v = trunk(a, a.section(stem));
    turned.push_back(v.x() == 0. && v.y() == 0. ? nan : std::atan2(-v.x(), v.y()) * degrees);
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < turned.size(); ++i)
    if (!std::isnan(turned[i])) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return turned[i]; });
  Values values(turned.size(), nan);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double to_next = std::abs(turned[order[(i + 1) % order.size()]] - turned[order[i]]);
    if (order.size() > 1) values[order[i]] = std::min(to_next, 360. - to_next);
  }
  return values;
}

/// Quadratic in the number of arbors, of which a cell has few; of more than a thousand only so many are compared.
Values trunk_angles_inter_types(const Arbors& a) {
  const auto stems = a.stems().first(std::min<std::size_t>(a.stems().size(), 1000));
  const auto kind = [&](std::uint32_t stem) { return a.neuron().section(a.section(stem).id).kind; };
  Values values(a.stems().size(), nan);
  for (std::size_t i = 0; i < stems.size(); ++i)
    for (const std::uint32_t other : stems)
      if (kind(other) != kind(stems[i]))
        values[i] = std::fmin(values[i], angle(trunk(a, a.section(stems[i])), trunk(a, a.section(other))));
  return values;
}

Values furthest_terminals(const Arbors& a) {
  Values values(a.stems().size(), 0.);
  const Columns& c = a.columns();
  for (const Branch& b : a.sections())
    if (b.daughters == 0)
      values[b.arbor] =
          std::max(values[b.arbor],
                   (place(c, b.last_row()) - place(c, a.section(a.stems()[b.arbor]).first_row)).norm());
  return values;
}

Values furthest_ways(const Arbors& a) {
  Values values(a.stems().size(), 0.);
  for (const Branch& b : a.sections()) values[b.arbor] = std::max(values[b.arbor], b.path_distance);
  return values;
}

Values hull_volumes(const Arbors& a) { return a.once<hulls>().arbor_volumes; }

Values volume_densities(const Arbors& a) {
  Values values = sum_per_arbor<volume>(a);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = ratio(values[i], a.once<hulls>().arbor_volumes[i]);
  return values;
}

template <std::size_t rank>
Values principal_extent(const Arbors& a) {
  Values values;
  for (const auto& extents : a.once<principal_extents>()) values.push_back(extents[rank]);
  return values;
}

template <auto barcodes, double (*f)(std::span<const Bar>)>
Values per_barcode(const Arbors& a) {
  Values values;
  const auto& all = a.once<barcodes>();
  for (std::size_t i = 0; i < all.size(); ++i) values.push_back(f(all.of_arbor(i)));
  return values;
}

double long_bars(std::span<const Bar> bars) {
  const double least = 0.1 * longest_bar(bars);
  return double(std::ranges::count_if(bars, [&](const Bar& bar) { return bar.length() >= least; }));
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"number_of_sections_per_neurite", "", arbor, axes_only, sum_per_arbor<one>,
     "Sections of the arbor.", "NeuroM", ""},
    {"number_of_bifurcations_per_neurite", "", arbor, axes_only, sum_per_arbor<is_bifurcation>,
     "Branch points of the arbor with exactly two daughters.", "NeuroM", ""},
    {"number_of_leaves_per_neurite", "", arbor, axes_only, sum_per_arbor<is_terminal>,
     "Terminals of the arbor.", "NeuroM", ""},
    {"total_length_per_neurite", "µm", arbor, axes_only, sum_per_arbor<length>,
     "Path length of the sections of the arbor.", "NeuroM", ""},
    {"total_area_per_neurite", "µm²", arbor, diameters_too, sum_per_arbor<area>,
     "Lateral area of the segments of the arbor as truncated cones.", "NeuroM", ""},
    {"total_volume_per_neurite", "µm³", arbor, diameters_too, sum_per_arbor<volume>,
     "Volume of the segments of the arbor as truncated cones.", "NeuroM", ""},
    {"max_radial_distance_per_neurite", "µm", arbor, axes_only, furthest_terminals,
     "Straight distance of the furthest terminal from the start of the arbor.", "NeuroM", ""},
    {"max_path_distance_per_neurite", "µm", arbor, axes_only, furthest_ways,
     "Longest way along the neurite from where it leaves the soma to a terminal of the arbor.", "", ""},
    {"hull_volume_per_neurite", "µm³", arbor, axes_only, hull_volumes,
     "Volume of the convex hull of the points of the arbor.", "", ""},
    {"neurite_volume_density", "", arbor, diameters_too, volume_densities,
     "Volume of the segments of the arbor over that of the convex hull of its points; none where they lie in one plane.", "NeuroM", ""},
    {"principal_direction_extents", "µm", arbor, axes_only, principal_extent<0>,
     "Extent of the points of the arbor along its principal axes (eigenvectors of their covariance); the greatest of three.", "NeuroM", ""},
    {"principal_direction_extents_2", "µm", arbor, axes_only, principal_extent<1>,
     "The second greatest.", "NeuroM", ""},
    {"principal_direction_extents_3", "µm", arbor, axes_only, principal_extent<2>,
     "The least.", "NeuroM", ""},
    {"trunk_origin_radii", "µm", arbor, diameters_too, per_arbor<radius_at_start>,
     "Radius at the start of the stem.", "NeuroM", ""},
    {"trunk_section_lengths", "µm", arbor, axes_only, per_arbor<length>,
     "Path length of the stem.", "NeuroM", ""},
    {"trunk_vectors_x", "µm", arbor, axes_only, per_arbor<trunk_vector<0>>,
     "x coordinate of the start of the arbor, from the centre of the soma.", "NeuroM", ""},
    {"trunk_vectors_y", "µm", arbor, axes_only, per_arbor<trunk_vector<1>>,
     "y coordinate of the start of the arbor, from the centre of the soma.", "NeuroM", ""},
    {"trunk_vectors_z", "µm", arbor, axes_only, per_arbor<trunk_vector<2>>,
     "z coordinate of the start of the arbor, from the centre of the soma.", "NeuroM", ""},
    {"trunk_origin_azimuths", "°", arbor, axes_only, per_arbor<azimuth>,
     "Angle of the way (x, y, z) from the centre of the soma to the start of the arbor about y, atan2(z, x): -180 to 180.", "NeuroM", ""},
    {"trunk_origin_elevations", "°", arbor, axes_only, per_arbor<elevation>,
     "Angle of the same way above the plane of x and z, towards the pia: -90 to 90.", "NeuroM", ""},
    {"trunk_angles_from_vector", "°", arbor, axes_only, per_arbor<angle_from_pia>,
     "Angle between the same way and y, the direction of the pia.", "NeuroM", ""},
    {"trunk_angles", "°", arbor, axes_only, trunk_angles,
     "Angle between the same way and that of the next arbor counterclockwise, both seen along z; none with one arbor.", "NeuroM", ""},
    {"trunk_angles_inter_types", "°", arbor, axes_only, trunk_angles_inter_types,
     "Least angle between the same way and that of an arbor of another kind.", "NeuroM", ""},
    {"tmd_radial_total_persistence", "µm", arbor, axes_only, per_barcode<radial_barcodes, total_persistence>,
     "Sum of the lengths of the bars of the arbor's barcode by straight distance from its start.", "Kanari et al. 2018", ""},
    {"tmd_radial_longest_bar", "µm", arbor, axes_only, per_barcode<radial_barcodes, longest_bar>,
     "Length of the longest bar of the same barcode.", "Kanari et al. 2018", ""},
    {"tmd_radial_long_bars", "", arbor, axes_only, per_barcode<radial_barcodes, long_bars>,
     "Bars of the same barcode at least a tenth as long as the longest.", "Kanari et al. 2018", ""},
    {"tmd_radial_entropy", "", arbor, axes_only, per_barcode<radial_barcodes, entropy>,
     "Entropy -Σ p ln p of the same barcode, p a bar's share of the total persistence: 0 for one bar, ln n for n alike.", "Chintakunta et al. 2015", ""},
    {"tmd_path_total_persistence", "µm", arbor, axes_only, per_barcode<path_barcodes, total_persistence>,
     "Sum of the lengths of the bars of the arbor's barcode by distance along the branches from its start.", "Kanari et al. 2018", ""},
    {"tmd_path_longest_bar", "µm", arbor, axes_only, per_barcode<path_barcodes, longest_bar>,
     "Length of the longest bar of the same barcode.", "Kanari et al. 2018", ""},
    {"tmd_path_long_bars", "", arbor, axes_only, per_barcode<path_barcodes, long_bars>,
     "Bars of the same barcode at least a tenth as long as the longest.", "Kanari et al. 2018", ""},
    {"tmd_path_entropy", "", arbor, axes_only, per_barcode<path_barcodes, entropy>,
     "Entropy of the same barcode, as of that by straight distance.", "Chintakunta et al. 2015", ""},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_arbors() { return table; }

}  // namespace forest::statistics
