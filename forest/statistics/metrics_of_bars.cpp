// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "forest/statistics/metric_table.h"
#include "forest/statistics/shared.h"

namespace forest::statistics {
namespace {

template <auto barcodes, auto member>
Values per_bar(const Arbors& a) {
  Values values;
  for (const Bar& bar : a.once<barcodes>().bars()) values.push_back(std::invoke(member, bar));
  return values;
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"tmd_radial_births", "µm", bar, axes_only, per_bar<radial_barcodes, &Bar::birth>,
     "Straight distance of a tip from the start of its arbor, where its bar begins.", "Kanari et al. 2018", ""},
    {"tmd_radial_deaths", "µm", bar, axes_only, per_bar<radial_barcodes, &Bar::death>,
     "Straight distance, from the start of the arbor, of the branch point where the bar meets one whose tip is further out; 0 for the furthest tip of an arbor.", "Kanari et al. 2018", ""},
    {"tmd_radial_bars", "µm", bar, axes_only, per_bar<radial_barcodes, &Bar::length>,
     "Length of a bar, its persistence: abs(birth - death).", "Kanari et al. 2018", ""},
    {"tmd_path_births", "µm", bar, axes_only, per_bar<path_barcodes, &Bar::birth>,
     "Way along the branches from the start of the arbor to a tip, where its bar begins.", "Kanari et al. 2018", ""},
    {"tmd_path_deaths", "µm", bar, axes_only, per_bar<path_barcodes, &Bar::death>,
     "Way from the start of the arbor to the branch point where the bar meets one whose tip has a longer way; 0 for the longest way of an arbor.", "Kanari et al. 2018", ""},
    {"tmd_path_bars", "µm", bar, axes_only, per_bar<path_barcodes, &Bar::length>,
     "Length of a bar, its persistence: birth - death.", "Kanari et al. 2018", ""},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_bars() { return table; }

}  // namespace forest::statistics
