// SPDX-License-Identifier: Apache-2.0
// Synapses as SONATA edges: /edges/POPULATION of an HDF5 file, by whose arrays each row is one contact
// (docs/formats/sonata.md).
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "forest/circuit/synapses.h"
#include "forest/io/format.h"
#include "forest/reports/report.h"

namespace forest::io {

struct SonataEdges {
  std::vector<circuit::Projection> projections;
  std::vector<Warning> warnings;  // what was left out
  std::vector<std::string>
      damaged;  // what could not be read, a sentence for each file or population of edges
};

/// Reads the synapses of a circuit: of every chemical population of edges those whose targets are planted and that say where
/// they are, by afferent_section_id and afferent_section_pos (sec_id and sec_x of older files) or by afferent_center_x, y, z.
/// Their sign is that of their source's type, of virtual sources too, or else told by syn_type_id: 100 and more excite.
/// @param place  of the circuit, as read_sonata takes it
/// @param circuit, nodes  of io::outline_sonata: the types of instances, and what SONATA calls each
/// Throws InputError (file, sentence) when the configuration has no list of edges; what is damaged costs its own synapses alone.
SonataEdges read_edges(const std::filesystem::path& place, const circuit::Circuit& circuit,
                       const reports::Nodes& nodes);

/// One file with these populations. The same synapses give the same bytes.
/// @param named  what errors call it
void write_edges(const std::filesystem::path& path, const std::filesystem::path& named,
                 std::span<const circuit::Projection> projections);

}  // namespace forest::io
