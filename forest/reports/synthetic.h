// SPDX-License-Identifier: Apache-2.0
// A made-up report, for tests and measurements at sizes that nobody simulates for that: every value is a formula of
// neuron, compartment and step, so that it can be asked for again and compared. It looks like voltage (rest, slow waves,
// spikes that travel from the soma and fade, noise) and is nobody's physiology.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "forest/circuit/circuit.h"
#include "forest/morphology/morphology.h"
#include "forest/reports/report.h"

namespace forest::reports {

struct Synthetic {
  std::size_t compartments = 1500;  // of each neuron; more where it has more sections
  std::size_t steps = 1000;
  double step = .1;  // ms
  std::uint64_t seed = 1;
};

/// The nodes of a circuit of one population, numbered as its instances.
Nodes nodes_of(const circuit::Circuit& circuit);

/// All neurons of the circuit, each section with one compartment or more, in SONATA's order. The report keeps nothing of
/// its arguments.
Report synthetic_report(const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
                        const Synthetic& options = {});

}  // namespace forest::reports
