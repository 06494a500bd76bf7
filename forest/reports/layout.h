// SPDX-License-Identifier: Apache-2.0
// How the compartments of a report lie on the branches of a circuit. Each neuron's compartments are put in an order in
// which those of a section, of a branch and of the neuron are neighbours, so that every level of detail is a mean of a
// run. A *branch* is a path of sections: at every branch point the daughter with the longest path to a tip continues it,
// the others begin new ones (the branch numbering of GabrielStudio, de Heras Ciechomski & Mange 2007).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/morphology/morphology.h"
#include "forest/reports/report.h"

namespace forest::reports {

/// One compartment, in the order of branches.
struct Compartment {
  std::uint32_t column = 0;  // in the report, counted from the neuron's first
  float position = 0.f;      // of its middle along its section, 0 to 1
  std::uint32_t weight = 1;  // its length in tenths of a µm, 1 to 65535: what it counts for in means
};

/// A section that has compartments, or the soma.
struct SectionRun {
  std::uint32_t section = 0;  // in Morphology::sections(), or all ones: the soma
  std::uint32_t element = 0;  // the same as the report counts it; the soma is 0
  std::uint32_t end = 0;      // one past its last compartment
};
inline constexpr std::uint32_t soma_run = 0xffffffffu;

/// A place on a neuron: where along a section of its morphology, 0 to 1; or the soma (soma_run).
struct Place {
  std::uint32_t section = soma_run;
  float position = .5f;

  bool operator==(const Place&) const = default;
};

/// The order of compartments that all neurons with one morphology and one list of elements share.
struct Layout {
  std::uint32_t morphology = 0;  // in Circuit::morphologies
  std::uint32_t soma = 0;        // the compartment nearest to the middle of the soma
  std::vector<Compartment> compartments;
  std::vector<SectionRun> sections;
  std::vector<std::uint32_t>
      branches;  // of each: one past its last entry in `sections`; the soma is one, too
};

/// The section of an element: SONATA counts the soma as 0, then axon, basal and apical dendrites, then what else there is,
/// each in the order of the file. Element e > 0 is section result[e - 1].
std::vector<SectionId> sections_of_elements(const Morphology& m);

struct Match {
  std::vector<Layout> layouts;
  std::vector<std::uint32_t> layout, instance;  // of each node of the report
};

/// Throws InputError that names what does not fit: a population or node that the circuit does not have, a section that
/// its morphology does not have, a position outside its section.
Match match(const Report& report, const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
            const Nodes& nodes);

struct PlacedSpikes {
  std::vector<Spike> spikes;   // sorted by time, then by instance
  std::uint64_t left_out = 0;  // of neurons of the circuit that have no shape
};

/// Throws InputError that names a population or node that the circuit does not have, or a time that is no number.
PlacedSpikes place(std::span<const Spikes> spikes, const Nodes& nodes);

}  // namespace forest::reports
