// SPDX-License-Identifier: Apache-2.0
// How much of a grown neuron was taken from one traced neuron in a row.
#pragma once

#include <cstddef>
#include <optional>

#include "forest/lsystem/grammar.h"

namespace forest::fitting {

/// The most branches, each growing out of the one before, that come from one traced neuron: of all modules Trace of the word, whose
/// samples tell by an outcome `donor` which neuron a row is of. None when the word has no such module.
/// Throws Error when a Trace names what is not there.
std::optional<std::size_t> longest_run(const lsystem::Word& word, const lsystem::Grammar& grammar);

}  // namespace forest::fitting
