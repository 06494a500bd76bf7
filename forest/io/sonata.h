// SPDX-License-Identifier: Apache-2.0
// Circuits as SONATA (Dai et al. 2020, PLoS Comput Biol 16:e1007696), the format of the Allen Institute and the Blue
// Brain Project: circuit_config.json, nodes.h5, node_types.csv and a folder of morphologies. docs/formats/sonata.md
// shows the layout that is written. What SONATA has no place for (the radius of the column, the limits of layers)
// stands under the key "brainforest" of the configuration, which other programs pass over.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "forest/circuit/node_sets.h"
#include "forest/circuit/synapses.h"
#include "forest/core/progress.h"
#include "forest/io/format.h"
#include "forest/reports/report.h"

namespace forest::io {

/// Writes a circuit as a folder, whole or not at all. The same circuit gives the same bytes.
/// @param morphologies  one for each of circuit.morphologies; each is written once, as SWC, with its centre at the
///                      origin (forest/morphology/transform.h)
/// @param projections  synapses between its neurons; without any there is no file of edges
/// A circuit that Brain Forest wrote before is replaced; throws Error when the folder holds anything else, when a name
/// of a morphology is no file name, or when the circuit is not sound (circuit::check).
void write_sonata(const std::filesystem::path& folder, const circuit::Circuit& circuit,
                  std::span<const Morphology> morphologies, Progress& progress = Progress::none(),
                  std::span<const circuit::Projection> projections = {});
/// Throws Error unless the folder is missing, empty, or holds a circuit of ours and nothing more.
void must_take_sonata(const std::filesystem::path& folder);
/// What it calls the neurons of a circuit: the name of their population.
std::string sonata_population(const circuit::Circuit& circuit);

struct SonataCircuit {
  circuit::Circuit circuit;
  std::vector<Morphology> morphologies;  // one for each of circuit.morphologies, centre at the origin
  std::vector<Warning> warnings;         // neurons left out, oddities of morphology files
  reports::Nodes nodes;                  // of each instance: what reports call it
};

/// A circuit whose morphologies are still in their files, for those that do not fit into memory.
struct SonataOutline {
  circuit::Circuit circuit;
  std::vector<std::filesystem::path> files;          // of each of circuit.morphologies
  std::vector<Warning> warnings;                     // neurons left out
  reports::Nodes nodes;                              // of each instance: what reports call it
  std::vector<circuit::NodeAttribute> attributes{};  // of all instances: what node sets may ask for besides
  std::filesystem::path node_sets{};                 // the file that the configuration names; empty: none

  /// Reads one of circuit.morphologies, centre at the origin; warnings name its file. May be called by several threads.
  ReadResult morphology(std::size_t index) const;
};

/// Reads a circuit: one of ours comes back equal. Of others' circuits every population of neurons with a shape is read;
/// virtual and point neurons are left out, and said so. Layers of such a circuit reach as far as their somata.
/// @param place  the folder with circuit_config.json, or a configuration file of another name
/// Throws InputError (file, line where there is one, remedy).
SonataCircuit read_sonata(const std::filesystem::path& place, Progress& progress = Progress::none());
/// The same but for the morphologies; of them only those are looked at whose centre says where their neurons stand.
SonataOutline outline_sonata(const std::filesystem::path& place);

}  // namespace forest::io
