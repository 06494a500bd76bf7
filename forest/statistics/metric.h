// SPDX-License-Identifier: Apache-2.0
// The table of metrics. A metric is one row of metrics_of_<level>.cpp: command line, documentation
// (docs/statistics/metrics.md) and tests walk over the rows. Names are NeuroM's; where NeuroM has none, L-Measure's
// in lower case.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "forest/statistics/arbors.h"
#include "forest/statistics/sholl.h"

namespace forest::statistics {

/// What a value belongs to: the neuron, one of its arbors, sections or bifurcations, a point with the segment that ends in
/// it, a sphere about the soma, a bar of an arbor's barcode (barcode.h).
enum class Level : std::uint8_t { neuron, arbor, section, bifurcation, point, shell, bar };

inline constexpr std::array<std::string_view, 7> levels{"neuron", "arbor", "section", "bifurcation",
                                                        "point",  "shell", "bar"};
std::string_view name_of(Level level);

struct Metric {
  std::string_view name;  // "total_length"
  std::string_view unit;  // "µm", "µm²", "°"; empty for counts and ratios
  Level level;
  bool
      diameters;  // depends on radii, of branches or of the soma; what does not is of the axes of branches alone
  /// One value an element: 1 for a neuron, Arbors::stems(), Arbors::sections(), Arbors::bifurcations(), the rows of
  /// Arbors::columns() but the first of each section, spheres of radius sholl_step, 2 sholl_step, … up to the last that is
  /// crossed (sholl.h), or Barcodes::bars(). NaN where it is not defined for an element.
  std::vector<double> (*values)(const Arbors& arbors);
  std::string_view definition;  // with its formula
  std::string_view source;      // the paper or the program that defines it; empty when it is plain geometry
  std::string_view
      l_measure;  // L-Measure's name of it, or of what it is the total or maximum of; empty when it has none
};

std::span<const Metric> metrics();

/// By its name or L-Measure's; null when there is none.
const Metric* find_metric(std::string_view name);

}  // namespace forest::statistics
