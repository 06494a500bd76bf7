// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/trace.h"

#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::reports {

std::string Trace::section_name() const { return section == soma_run ? "soma" : std::to_string(section); }

std::string Trace::name() const {
  return section == soma_run ? fmt::format("node {} soma", node)
                             : fmt::format("node {} section {} at {:.4g}", node, section, position);
}

Trace trace(const Activity& activity, std::uint32_t row, std::uint32_t compartment) {
  if (row >= activity.rows().size() || compartment >= activity.count(row, Level::compartment))
    throw Error(
        fmt::format("compartment {} of neuron {} is asked for and was not reported", compartment, row));
  const Row& neuron = activity.rows()[row];
  const LayoutView layout = activity.layout(neuron.layout);
  const auto run = std::ranges::upper_bound(layout.sections, compartment, {}, &SectionRun::end);
  Trace t{.node = neuron.node_id,
          .row = row,
          .compartment = compartment,
          .section = run->section,
          .position = layout.compartments[compartment].position,
          .values = {}};
  for (const Code code : activity.history(neuron.first[std::size_t(Level::compartment)] + compartment))
    t.values.push_back(activity.facts().range.value(code));
  return t;
}

std::string csv_of(const Facts& facts, std::span<const Trace> traces) {
  const int decimals = facts.range.decimals();
  std::string text = "time (ms)";
  for (const Trace& t : traces) text += fmt::format(",{} ({})", t.name(), facts.units);
  for (std::uint64_t i = 0; i < facts.steps; ++i) {
    text += fmt::format("\n{:.10g}", facts.time(i));
    for (const Trace& t : traces)
      text += std::isnan(t.values[i]) ? std::string(",") : fmt::format(",{:.{}f}", t.values[i], decimals);
  }
  return text + "\n";
}

}  // namespace forest::reports
