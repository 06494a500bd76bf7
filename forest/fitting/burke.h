// SPDX-License-Identifier: Apache-2.0
// A parametric model of a population after Burke, Marks & Ulfhake 1992 (J Neurosci 12:2403): what a branch does next
// depends on its diameter alone. It is what the models of data/grammars/motoneuron.lsys and purkinje.lsys are, with numbers
// estimated from cells; the yardstick that finer models are held to, as it forgets order, place and cell.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::fitting {

/// What came of correcting the chance to fork: tips of a kind, in the mean of cells.
struct Corrected {
  SectionKind kind;
  double traced, grown;
};

struct BurkeOptions {
  statistics::KindSet kinds = statistics::KindSet::all();  // each kind gets numbers of its own
  int rounds =
      10;  // of growing cells and correcting the chance to fork until they have as many tips; 0: as measured
  std::uint64_t seed = 1;
  std::function<void(const Corrected&)> tell = {};  // of each kind
};

/// The text of a grammar (docs/lsystem/notation.md): soma, number and diameter and direction of stems, taper, chances to fork
/// and to end by diameter (exponentials by maximum likelihood), ratios of diameters with Burke's anticorrelation, angles,
/// tortuosity. Nothing is thinner, thicker or further than in the cells, and where four times as many branches grow as
/// run side by side in any cell none forks, so that it never runs away. The same text for the same cells, name and seed.
/// @param name  for its title
/// Throws Error when the cells have no section of these kinds.
std::string burke_grammar(std::span<const Morphology> cells, const std::string& name,
                          const BurkeOptions& options = {});

}  // namespace forest::fitting
