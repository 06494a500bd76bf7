// SPDX-License-Identifier: Apache-2.0
// What is odd about a neuron. Findings are returned, never printed, and never change the neuron.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest {

enum class Severity : std::uint8_t { note, warning };

struct Finding {
  Severity severity = Severity::note;
  std::string_view code;    // a stable word, for example "no-soma"
  SectionId section;        // none when the whole neuron is meant
  std::int64_t point = -1;  // within the section
  std::string sentence;     // what it is and what to do
};

/// Looks for: no soma, no section, zero radii, zero-length segments, single-point stems, unifurcations,
/// multifurcations, kinds that change below a branch point, jumps (a segment much longer than the rest),
/// stems far from the soma, tips that end thick, stems that begin thin.
std::vector<Finding> validate(const Morphology& m);

}  // namespace forest
