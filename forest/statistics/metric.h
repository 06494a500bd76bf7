// SPDX-License-Identifier: Apache-2.0
// The table of metrics. A metric is one row here: command line, documentation (docs/statistics/metrics.md),
// Python and tests walk over the rows. Names are NeuroM's; where NeuroM has none, L-Measure's in lower case.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "forest/statistics/arbors.h"

namespace forest::statistics {

/// What a value belongs to: the neuron, one of its sections, one of its bifurcations, a sphere about the
/// soma.
enum class Level : std::uint8_t { neuron, section, bifurcation, shell };

std::string_view name_of(Level level);

struct Metric {
  std::string_view name;  // "total_length"
  std::string_view unit;  // "µm", "µm²", "°"; empty for counts and ratios
  Level level;
  bool
      diameters;  // depends on radii, of branches or of the soma; what does not is of the axes of branches alone
  /// One value an element: 1 for a neuron, Arbors::sections(), Arbors::bifurcations(), or shells of radius
  /// sholl_step, 2 sholl_step, … up to the last that is crossed. NaN where it is not defined for an element.
  std::vector<double> (*values)(const Arbors& arbors);
  std::string_view definition;  // one sentence
  std::string_view source;      // the paper it comes from, or empty when it is plain geometry
  std::string_view
      l_measure;  // L-Measure's name of it, or of what it is the total or maximum of; empty when it has none
};

inline constexpr double sholl_step = 10.;  // µm

std::span<const Metric> metrics();

/// By its name or L-Measure's; null when there is none.
const Metric* find_metric(std::string_view name);

}  // namespace forest::statistics
