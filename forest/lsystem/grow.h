// SPDX-License-Identifier: Apache-2.0
// A synthetic neuron is grammar + seed + index, and the site where it grows, when the grammar asks what is there. Where the grammar
// has tastes, several candidates of it are grown, and one is drawn with a chance of exp(the sum of what they say of it):
// exponential tilting of what the productions grow, by resampling of importance (Rubin 1987). They have the same values that are
// drawn once a neuron, so that cards stay dealt.
#pragma once

#include <cstdint>
#include <vector>

#include "forest/core/progress.h"
#include "forest/cortex/environment.h"
#include "forest/lsystem/grammar.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

class Deriver;

/// The neuron `index` of the population `seed`: a pure function. It says in its annotations where it comes from: grammar, seed and index, and in
/// an environment also grown_at, environment (its name) and environment_hash. Throws as Deriver::derive and interpret do.
Morphology grow(const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                const cortex::Site& site = {});

/// The same, where the deriver is; one object a thread keeps memory between neurons (Deriver).
Morphology grow(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index);

/// The same neuron as it was after some steps of derivation, which are the time of its growth; its annotations say after how
/// many.
Morphology grow_to(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                   int steps);

/// Neurons first to first + count - 1, on all cores; the same at any number of threads.
std::vector<Morphology> grow_population(const Grammar& grammar, std::size_t count, std::uint64_t seed,
                                        Progress& progress = Progress::none(), std::uint64_t first = 0,
                                        const cortex::Site& site = {});

}  // namespace forest::lsystem
