// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::reports {

void check(const Report& report) {
  const auto require = [&](bool good, const auto& sentence) {
    if (!good) throw InputError(report.source, 0, sentence());
  };
  const auto name_of = [&](const Node& node) {
    return fmt::format("node {} of population {}", node.id, report.populations[node.population]);
  };
  require(std::isfinite(report.start) && std::isfinite(report.step) && report.step > 0., [&] {
    return fmt::format("its steps are {} ms long from {} ms on; time must go on", report.step, report.start);
  });
  require(report.steps > 0, [] { return "holds no step of time; let the simulation run and report again"; });
  require(!report.nodes.empty() && report.columns() > 0,
          [] { return "holds no compartment; name the neurons to report and simulate again"; });
  require(report.first_column.size() == report.nodes.size() + 1 && report.first_column.front() == 0 &&
              report.first_column.back() == report.columns() &&
              (report.element_positions.empty() || report.element_positions.size() == report.columns()),
          [&] {
            return fmt::format("its mapping does not fit its {} columns; write the report again",
                               report.columns());
          });
  for (std::size_t i = 0; i < report.nodes.size(); ++i) {
    require(report.nodes[i].population < report.populations.size(),
            [] { return "its mapping names a population it does not have; write the report again"; });
    require(report.first_column[i] < report.first_column[i + 1], [&] {
      return fmt::format("{} has no compartment; leave it out of the report", name_of(report.nodes[i]));
    });
  }
  std::vector<Node> sorted = report.nodes;
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  require(twice == sorted.end(), [&] {
    return fmt::format("{} occurs twice; write the report with each neuron once", name_of(*twice));
  });
}

Report without_values(std::span<const Spikes> spikes, const Nodes& nodes) {
  constexpr double before = 5., after = 20., finest = .1;  // ms: until the last one has run along its axon
  constexpr double most_steps = 1000.;
  double first = INFINITY, last = -INFINITY;
  for (const Spikes& of : spikes)
    for (const double time : of.times) {
      if (!std::isfinite(time)) throw InputError(of.source, 0, "a spike's time is no number; write it again");
      first = std::min(first, time), last = std::max(last, time);
    }
  if (!(first <= last))
    throw InputError(spikes.empty() ? "" : spikes.front().source, 0,
                     "holds no spikes, so there is nothing to play; let the simulation run longer");
  Report report;
  report.source = spikes.front().source;
  report.start = std::min(first, std::max(0., first - before));
  const double length = last + after - report.start;
  report.step = std::max(finest, length / most_steps);
  report.steps = std::size_t(std::ceil(length / report.step));
  report.populations = nodes.populations;
  report.nodes = nodes.of_instance;
  for (std::uint64_t i = 0; i <= report.nodes.size(); ++i) report.first_column.push_back(i);
  report.element_ids.assign(report.nodes.size(), 0);
  report.read = [](std::size_t, std::size_t rows, std::size_t, std::size_t columns, float* out) {
    std::fill_n(out, rows * columns, NAN);
  };
  return report;
}

}  // namespace forest::reports
