// SPDX-License-Identifier: Apache-2.0
// The column that benchmarks draw: neurons of a hundred shapes, or more, grown from the built-in grammars.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "forest/scene/forest.h"

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

/// --neurons, how many a benchmark plants.
void add_planted(CLI::App& command, std::uint32_t& neurons);

struct GrownColumn {
  circuit::Circuit circuit;
  std::vector<Morphology> neurons;  // of each morphology of the circuit
};

inline constexpr std::uint32_t usual_shapes = 100;

/// So many neurons, at the density of the recipe column-10000; the same for the same seed.
/// @param shapes  distinct neurons among them, at least 5: three of five pyramidal, one Purkinje, one motoneuron
GrownColumn planted_column(std::uint32_t neurons, std::uint64_t seed, Console& console,
                           std::uint32_t shapes = usual_shapes);
/// The same as a forest file.
std::vector<std::byte> packed_column(std::uint32_t neurons, std::uint64_t seed, Console& console);
/// The same, opened.
scene::Forest grown_column(std::uint32_t neurons, std::uint64_t seed, Console& console);

}  // namespace forest::cli
