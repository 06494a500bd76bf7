// SPDX-License-Identifier: Apache-2.0
// Faces of elements and the surfaces that they stand for. A patch through sixteen places on a creased surface cuts its convex creases
// off and bridges the others, so its places have to lie beside the surface for the patch to lie on it.
#pragma once

#include "forest/cortex/elements.h"

namespace forest::cortex {

enum class Fit {
  mean,  // each face as a whole, by some µm, until it lies outside of the surface as much as inside; corners stay
  places,  // all places of it, by least squares over 5×5 places of the face
  volume  // all places along their curves, until there is as much on one side of the surface as on the other (gaps.h)
};

/// Moves the faces on both surfaces towards these, along the surface's normals. What would cost an element its validity
/// or a good shape goes half of its way, a quarter, … or stays.
void fit_faces(Elements& elements, const SurfaceTrees& surfaces, Fit fit);

/// What all elements together lack of a volume (or have beyond it), spread over all faces as a height that is the same everywhere,
/// along the curves: of all ways to have that volume the one that moves faces least, by least squares. No face goes farther than 25 µm,
/// and no element loses its validity or a good shape.
/// @param volume  µm³
void keep_volume(Elements& elements, double volume);

}  // namespace forest::cortex
