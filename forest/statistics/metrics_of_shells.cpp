// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "forest/statistics/metric_table.h"
#include "forest/statistics/sholl.h"

namespace forest::statistics {
namespace {

Values crossings(const Arbors& a) { return sholl_crossings(a); }

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"sholl_crossings", "", Level::shell, axes_only, crossings,
     "Crossings of spheres about the centre of the soma, of radius 10, 20, 30 µm ….", "Sholl 1953", ""},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_shells() { return table; }

}  // namespace forest::statistics
