// SPDX-License-Identifier: Apache-2.0
// The virtual clamp: what a compartment did over the whole of a simulation.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "forest/reports/activity.h"

namespace forest::reports {

struct Trace {
  std::uint64_t node = 0;
  std::uint32_t row = 0;          // in Activity::rows()
  std::uint32_t compartment = 0;  // of that neuron
  std::uint32_t section = 0;      // its section, in Morphology::sections(), or soma_run
  float position = 0.f;           // of its middle along the section, 0 to 1
  std::vector<float> values;      // at every step, in the unit of the report; NaN where there is none

  std::string section_name() const;  // "12", or "soma": as a branch that is picked is called
  std::string name() const;          // "node 3 section 12 at 0.5", "node 3 soma"
};

/// Reads it. Throws Error for a neuron or a compartment that is not in the file.
Trace trace(const Activity& activity, std::uint32_t row, std::uint32_t compartment);

/// A table of comma-separated values: a line a step, its time in ms, then a column a trace; empty where there is no value.
std::string csv_of(const Facts& facts, std::span<const Trace> traces);

}  // namespace forest::reports
