// SPDX-License-Identifier: Apache-2.0
// A parametric model of a population in Hillman's parameters (1979, "Neuronal shape parameters and substructures as a basis of
// neuronal form"), as L-Neuron grows by them (Ascoli & Krichmar 2000, Neurocomputing 32:1003): a branch is drawn whole, with
// its length and the part of its diameter that it loses; it forks when it is still thicker than a threshold.
#pragma once

#include <span>
#include <string>

#include "forest/fitting/parametric_options.h"
#include "forest/morphology/morphology.h"

namespace forest::fitting {

/// The text of a grammar: stems as of burke_grammar; lengths of branches that fork and that end; taper_2, the loss of diameter
/// over the diameter; Hillman's threshold, half the parent and a quarter of each daughter at forks whose daughters end;
/// daughter ratio and Pk (of the power 3/2), from which the daughters' diameters follow; amplitudes, tortuosity. What is
/// corrected is the threshold. Otherwise as burke_grammar, errors too.
std::string hillman_grammar(std::span<const Morphology> cells, const std::string& name,
                            const ParametricOptions& options = {});

}  // namespace forest::fitting
