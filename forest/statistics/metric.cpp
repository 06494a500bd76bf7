// SPDX-License-Identifier: Apache-2.0
// After L-Measure (Scorcioni, Polavaram & Ascoli 2008, Nat Protoc 3:866) and NeuroM; full references stand in
// docs/statistics/metrics.md. Changed: one value an element, so that values of different metrics can be
// paired; Sholl crossings are counted on the segments themselves, so that they do not depend on how densely a
// branch was traced.
#include "forest/statistics/metric.h"

#include <algorithm>
#include <array>

#include "forest/statistics/metric_table.h"

namespace forest::statistics {

std::string_view name_of(Level level) { return levels[std::size_t(level)]; }

std::span<const Metric> metrics() {
  static const std::vector<Metric> all = [] {
    std::vector<Metric> rows;
    for (const auto table :
         {metrics_of_neurons(), metrics_of_arbors(), metrics_of_sections(), metrics_of_bifurcations(),
          metrics_of_points(), metrics_of_shells(), metrics_of_bars()})
      rows.insert(rows.end(), table.begin(), table.end());
    return rows;
  }();
  return all;
}

const Metric* find_metric(std::string_view name) {
  const auto row = std::ranges::find_if(
      metrics(), [&](const Metric& m) { return name == m.name || (!name.empty() && name == m.l_measure); });
  return row == metrics().end() ? nullptr : &*row;
}

}  // namespace forest::statistics
