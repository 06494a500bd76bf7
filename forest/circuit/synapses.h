// SPDX-License-Identifier: Apache-2.0
// Contacts between neurons as plain data: who contacts whom, and where. At rest they are SONATA edges (io/sonata_edges.h);
// a forest draws them (scene/synapses.h).
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/core/progress.h"
#include "forest/morphology/morphology.h"

namespace forest::circuit {

enum class Sign : std::uint8_t { unknown, excitatory, inhibitory };
std::string_view name_of(Sign sign);

/// One contact. Where it is on its target is said by a section and a position along it, by a place in the world, or both.
struct Synapse {
  static constexpr std::uint32_t not_planted = 0xffffffffu;
  static constexpr std::int32_t no_section = -1;
  static constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();

  std::uint32_t target = 0;                // index in Circuit::instances
  std::uint32_t neuron = not_planted;      // the source, the same
  std::uint64_t source = 0;                // the same as a node of the projection's source population
  std::int32_t element = no_section;       // of the target, as SONATA counts sections: 0 is the soma
  float position = .5f;                    // along it, 0 to 1
  Vec3 centre = Vec3::Constant(nowhere);   // on the axis of the branch, µm in the world
  Vec3 surface = Vec3::Constant(nowhere);  // on its surface
  Sign sign = Sign::unknown;
};

/// SONATA counts the soma as section 0, then axon, basal and apical dendrites, then what else there is, each in the order of
/// the file: sections in the order of this number are those from 1 on.
constexpr int element_rank(SectionKind kind) {
  return kind == SectionKind::axon ? 0 : kind == SectionKind::basal ? 1 : kind == SectionKind::apical ? 2 : 3;
}

/// The synapses of one population of neurons on another.
struct Projection {
  std::string name;    // of the edges: "column__column__chemical"
  std::string source;  // population that the sources are of
  std::string target;
  std::vector<Synapse> synapses;
};

/// The word in the name of what nobody measured.
inline constexpr std::string_view made_up_word = "made_up";

/// Synapses that nobody measured, so that there is something to look at: every neuron has `each` of them. Their sources are
/// drawn by lot from all other neurons, alike; glia makes none and has none. Excitatory ones sit on spines where the neuron has some, else anywhere along
/// its dendrites; inhibitory ones at the place nearest to the soma of three such. Neurons without dendrites have none.
/// A pure function of its arguments.
/// @param morphologies  one for each of circuit.morphologies
/// @param population    what SONATA calls the circuit's neurons
Projection made_up_synapses(const Circuit& circuit, std::span<const Morphology> morphologies,
                            const std::string& population, std::uint32_t each, std::uint64_t seed,
                            Progress& progress = Progress::none());

}  // namespace forest::circuit
