// SPDX-License-Identifier: Apache-2.0
// A synthetic neuron is grammar + seed + index, nothing more.
#pragma once

#include <cstdint>
#include <vector>

#include "forest/core/progress.h"
#include "forest/lsystem/grammar.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

/// The neuron `index` of the population `seed`: a pure function. Throws as Deriver::derive and interpret do.
Morphology grow(const Grammar& grammar, std::uint64_t seed, std::uint64_t index);

/// Neurons 0 to count - 1, on all cores; the same at any number of threads.
std::vector<Morphology> grow_population(const Grammar& grammar, std::size_t count, std::uint64_t seed,
                                        Progress& progress = Progress::none());

}  // namespace forest::lsystem
