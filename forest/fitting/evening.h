// SPDX-License-Identifier: Apache-2.0
// How often what was traced is drawn. A kernel draws what lies amid much that is alike more often than what lies aside, and the forks
// of neurons that have many more often than those of neurons that have few. So grown branches would fork more narrowly and lie flatter
// than traced ones do. Each row of a sample gets a weight, and the weights are changed until as many neurons as were traced draw each
// row about once, as it was met. Private to this room.
#pragma once

#include <cstddef>
#include <vector>

#include "forest/core/progress.h"
#include "forest/fitting/resampling.h"
#include "forest/lsystem/grammar.h"

namespace forest::fitting {

/// How seldom each stem, fork and fork that lends its diameters is to be drawn: what the last condition of the samples `stems`,
/// `forks` and `calibres`, a kernel of width 1 which is asked for 0, is to say. e to minus half of its square is a weight.
struct Seldom {
  std::vector<double> stems, forks, calibres;
};

/// The same at any number of threads.
/// @param grammar  in which all are drawn alike, as resampling_grammar writes it: Trace(forks, r, i, …) draws branch i of fork r
///                 with the diameters of another, its eighth parameter
/// @param neurons  that were traced
Seldom evened(lsystem::Grammar grammar, std::size_t neurons, const Evening& options = {},
              Progress& progress = Progress::none());

}  // namespace forest::fitting
