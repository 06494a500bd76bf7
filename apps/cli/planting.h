// SPDX-License-Identifier: Apache-2.0
// From a recipe and a repository to a circuit with its morphologies: what `plant` and `demo` share.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "forest/circuit/plant.h"
#include "forest/circuit/recipe.h"
#include "forest/core/progress.h"
#include "forest/morphology/morphology.h"

namespace forest::cli {

/// What a recipe is planted in: one whose types grow where they stand, in columns alone.
enum class Tissue : std::uint8_t { column, elements };

/// The recipe at a path, or the one that ships under a name ("column-1000"). Throws Error that lists the names, for one that is
/// not there and one that cannot be planted in that tissue.
circuit::Recipe find_recipe(const std::string& name_or_path, Tissue tissue = Tissue::column);

/// Neurons that were stretched along z, as their slice had shrunk.
struct Unflattened {
  std::string name;  // of their population, or of their type where they grew
  double factor = 1.;
  std::optional<double> error = {};  // where it was measured
};

/// The neurons of a repository that a recipe plants from, centre at the origin; names are safe as those of files.
struct Stock {
  std::vector<circuit::Candidate> candidates;
  std::vector<Morphology> neurons;  // one for each
  std::vector<Unflattened> unflattened = {};
};
/// Throws Error when a population that the recipe plants from is empty, with the commands that fill it.
/// @param wanted  of each type whether any of it is planted
/// @param repo  may be empty when all types have a grammar
Stock stock_of(const circuit::Recipe& recipe, const std::vector<bool>& wanted, const std::string& repo,
               Progress& progress);

/// Those of the stock that the circuit has planted, in its order.
std::vector<Morphology> planted_of(const Stock& stock, const circuit::Circuit& circuit);

struct Planted {
  circuit::Circuit circuit;
  std::vector<Morphology> morphologies;  // one for each of circuit.morphologies, centre at the origin
  std::vector<circuit::TooTall> too_tall = {};
  std::vector<Unflattened> unflattened = {};
};

/// A type all of whose cells have no other processes than those of glia is glia, also when the recipe does not say so.
void mark_glia(Planted& planted);

/// Plants the neurons of a repository, and grows those of types with a grammar where they stand: below the pia, in the layers,
/// among the somata of all others. A morphology is called as its neuron, made safe as a file name.
/// @param repo  may be empty when all types have a grammar
/// Throws Error when a population that the recipe plants from is empty, with the commands that fill it.
Planted plant_from_repository(const circuit::Recipe& recipe, const std::string& repo, std::uint64_t seed,
                              Progress& progress);

}  // namespace forest::cli
