// SPDX-License-Identifier: Apache-2.0
// The shape of a soma that is more than a sphere, as branches have shapes: runs of points with radii.
#pragma once

#include <vector>

#include "forest/morphology/morphology.h"

namespace forest {

/// Runs of round cones, a point and its radius each. Cylinders are drawn in at their free ends, as far as the balls there would
/// stick out. A single outline becomes cones along its longest direction, as wide as it is across that and as deep as wide, as NEURON
/// takes it (Carnevale & Hines 2006, "The NEURON Book", chapter 5); a stack of outlines, the cones through their middles. Empty for a
/// sphere and for none.
std::vector<std::vector<Point>> soma_shape(const Soma& soma);

/// The middle and mean radius of each outline, in their order.
std::vector<Point> outline_discs(const Soma& soma);

}  // namespace forest
