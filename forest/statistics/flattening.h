// SPDX-License-Identifier: Apache-2.0
// How flat the slice became in which neurons were traced.
#pragma once

#include <span>

#include "forest/morphology/morphology.h"

namespace forest::statistics {

/// How many times as far branches go along x as along z, with its standard error between neurons.
struct Flattening {
  double ratio = 0., error = 0.;
};

/// Slices shrink as they are fixed and mounted, along z far more than across it, and so do the neurons in them. Around the axis
/// towards the pia, y, cells of most types grow alike to all sides; so the sum of |Δx| over that of |Δz| says how much z lacks.
/// Dendrites are looked at, where there are none all branches, in pieces of 20 µm of path or what is left of a section, as what is
/// shorter is the tracer's steps of focus. Of cells that are flat themselves, as Purkinje cells are, it says how flat.
/// The error is the jackknife's, leaving out one neuron after the other; NaN of a single one.
/// Both NaN when nothing goes along z.
Flattening flattening(std::span<const Morphology> neurons);

}  // namespace forest::statistics
