// SPDX-License-Identifier: Apache-2.0
// Planting: from a recipe and the neurons at hand to a circuit. Counts are exact, somata do not overlap, and the
// result is a pure function of (recipe, candidates, seed), the same at any number of threads.
//
// Somata are placed by random sequential addition (Feder 1980, "Random sequential adsorption"): each is given
// uniform places in its layer until it is clear of those before it. Large somata go first, as they find room
// hardest. A grid of cells keeps each trial at the cost of a few comparisons. Random sequential addition jams
// when spheres fill about 38 % of the volume; near that a soma needs ever more trials, and a layer where one
// finds no place is refused.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/circuit/recipe.h"
#include "forest/core/progress.h"

namespace forest::circuit {

/// A neuron that may be planted, any number of times.
struct Candidate {
  std::string name;         // distinct among the candidates
  std::string population;   // as in CellType::population
  float soma_radius = 0.f;  // µm, >= 0
  float height = 0.f;       // how far it reaches above the centre of its soma, towards the pia, µm
};

inline constexpr float pia_slack = 30.f;  // µm that a neuron may reach above the pia

/// The candidates of each type, by index. Throws Error for two of the same name, for a soma or height that is no number, and for a
/// type that is planted and has none.
std::vector<std::vector<std::uint32_t>> candidates_of(
    const Recipe& recipe, std::span<const Candidate> candidates,
    const std::function<bool(std::size_t type)>& is_planted);

/// Candidates of a type that are taller than all tissue above the floor of every layer in which it is planted, so that they stand
/// nowhere, unless all are and the lowest does.
struct TooTall {
  std::uint32_t type = 0;
  std::size_t count = 0, of = 0;  // of so many candidates
};
std::vector<TooTall> too_tall(const Recipe& recipe, std::span<const Candidate> candidates);

/// Names the candidates that instances have, in their order; Instance::morphology becomes the number among these.
void name_morphologies(Circuit& circuit, std::span<const Candidate> candidates);

/// Circuit::morphologies holds the candidates that were planted, in their order; instances are in the order
/// of layers, then types. Each instance has a candidate of its type's population and stands where that does not reach
/// above the pia: the chance of a candidate is the share of the layer's depth in which it fits. Where none fits at all
/// it is the lowest one.
/// Throws Error when a population has no candidate, and when somata do not fit into a layer (naming it).
Circuit plant(const Recipe& recipe, std::span<const Candidate> candidates, std::uint64_t seed,
              Progress& progress = Progress::none());

}  // namespace forest::circuit
