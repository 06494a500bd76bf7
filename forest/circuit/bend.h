// SPDX-License-Identifier: Apache-2.0
// Neurons bent as the tissue is in which they stand (cortex/warp.h). Each becomes a shape of its own, in the tissue's axes.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/core/progress.h"
#include "forest/cortex/warp.h"
#include "forest/morphology/morphology.h"

namespace forest::circuit {

/// Least, median and largest of a number, and where all but one in a hundred are.
struct Spread {
  double least = 0., p1 = 0., median = 0., p99 = 0., most = 0.;
};

/// What bending did to all neurons together.
struct Bending {
  double length = 0.;         // µm of branches, before
  double length_ratio = 1.;   // after over before, of all branches together
  Spread ratio;               // … of single neurons
  std::size_t shortened = 0;  // neurons that were taller than the tissue above their soma
  Spread turn;                // degrees by which angles between segments changed, mean of each neuron
  // Shares of length: above the pia; at the pia, where it would have passed; in the white matter; off the rim.
  double beyond_pia = 0., pressed = 0., beyond_white = 0., beside = 0.;
};

struct Bent {
  std::vector<Morphology> neurons;  // of each instance, the soma at the origin, not to be turned any more
  Bending bending;
};

/// What is taller than the tissue above the soma gets shorter in its upper part, by a half at most; what passes the pia all the same
/// lies on it. On all cores.
/// @param morphologies  of circuit.morphologies, the soma at the origin
/// @param seats         of each instance; elements are those of the sheet
Bent bend(const Circuit& circuit, std::span<const Morphology> morphologies,
          std::span<const cortex::Seat> seats, const cortex::Sheet& sheet, Progress& progress);

}  // namespace forest::circuit
