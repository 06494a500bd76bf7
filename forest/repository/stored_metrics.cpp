// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/stored_metrics.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string_view>

#include "forest/statistics/metric.h"

namespace forest::repository {
namespace {

// A metric's number is its place here, from 1, and never that of another: new ones go to the end, with a new version of the
// tables (schema.h) so that they are worked out for the neurons that are there.
constexpr std::array<std::string_view, 82> names{
    // since version 2
    "soma_surface_area",
    "soma_radius",
    "number_of_neurites",
    "number_of_sections",
    "number_of_segments",
    "number_of_bifurcations",
    "number_of_forking_points",
    "number_of_leaves",
    "number_of_spines",
    "total_length",
    "total_area",
    "total_volume",
    "max_path_distance",
    "max_radial_distance",
    "max_branch_order",
    "total_width",
    "total_height",
    "total_depth",
    "length_fraction_above_soma",
    "section_lengths",
    "section_term_lengths",
    "section_bif_lengths",
    "section_areas",
    "section_volumes",
    "section_mean_radii",
    "trunk_origin_radii",
    "section_path_distances",
    "section_radial_distances",
    "section_end_distances",
    "section_branch_orders",
    "section_strahler_orders",
    "terminal_degree",
    "section_tortuosity",
    "contraction",
    "section_taper_rates",
    "taper_1",
    "taper_2",
    "parent_daughter_ratio",
    "local_bifurcation_angles",
    "remote_bifurcation_angles",
    "bif_tilt_remote",
    "partition_asymmetry",
    "sibling_ratios",
    "daughter_ratio",
    "rall_power",
    "pk_classic",
    "sholl_crossings",
    // since version 8
    "soma_volume",
    "spine_density",
    "surface",
    "volume",
    "width",
    "height",
    "depth",
    "hull_volume",
    "volume_density",
    "aspect_ratio",
    "circularity",
    "shape_factor",
    "fractal_dimension_boxes",
    "sholl_maximum",
    "sholl_critical_radius",
    "sholl_decay",
    "max_strahler_order",
    "horton_bifurcation_ratio",
    "horton_length_ratio",
    "principal_direction_extents",
    "principal_direction_extents_2",
    "principal_direction_extents_3",
    "trunk_origin_elevations",
    "tmd_radial_entropy",
    "tmd_path_entropy",
    "tmd_path_long_bars",
    "tortuosity_10",
    "tortuosity_50",
    "fractal_dim",
    "bif_tilt_local",
    "bif_torque_local",
    "bif_torque_remote",
    "hillman_threshold",
    "segment_lengths",
    "segment_meander_angles",
};

}  // namespace

std::span<const statistics::Metric* const> stored_metrics() {
  static const auto all = [] {
    std::array<const statistics::Metric*, names.size()> metrics{};
    std::ranges::transform(names, metrics.begin(), statistics::find_metric);
    assert(!std::ranges::count(metrics, nullptr));
    return metrics;
  }();
  return all;
}

int stored_number(const statistics::Metric& metric) {
  const auto all = stored_metrics();
  const auto found = std::ranges::find(all, &metric);
  return found == all.end() ? 0 : int(found - all.begin()) + 1;
}

}  // namespace forest::repository
