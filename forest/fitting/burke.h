// SPDX-License-Identifier: Apache-2.0
// A parametric model of a population after Burke, Marks & Ulfhake 1992 (J Neurosci 12:2403): what a branch does next
// depends on its diameter alone. It is what the models of data/grammars/motoneuron.lsys and purkinje.lsys are, with numbers
// estimated from cells; the yardstick that finer models are held to, as it forgets order, place and cell.
#pragma once

#include <span>
#include <string>

#include "forest/fitting/parametric_options.h"
#include "forest/morphology/morphology.h"

namespace forest::fitting {

/// The text of a grammar (docs/lsystem/notation.md): soma, number and diameter and direction of stems, taper, chances to fork
/// and to end by diameter (exponentials by maximum likelihood), ratios of diameters with Burke's anticorrelation, angles,
/// tortuosity. Nothing is thinner, thicker or further than in the cells, and where four times as many branches grow as
/// run side by side in any cell none forks, so that it never runs away. The same text for the same cells, name and seed.
/// @param name  for its title
/// Throws Error when the cells have no section of these kinds.
std::string burke_grammar(std::span<const Morphology> cells, const std::string& name,
                          const ParametricOptions& options = {});

}  // namespace forest::fitting
