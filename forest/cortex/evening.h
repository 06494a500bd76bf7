// SPDX-License-Identifier: Apache-2.0
// Quadrilaterals move along the ribbon until the same volume lies under each of them.
//
// A vertex that moves takes volume from the faces before it and leaves it to those behind it, so that a whole region which has too
// much can only give it away over many faces. How far each vertex goes is therefore not asked of its own faces: of all ways by which
// volumes become even the shortest is taken,
//
//     Σ |way of a vertex|² / (side of a face)²  least,  with  volume of each face + its change by these ways = what is wanted,
//
// whose multipliers are one number of every face that a sparse system gives. Vertices on a valley go along it, those on the border
// stay. After each step sides turn back to the crosses and faces that are bent out of shape are mended. Turning and evening undo each
// other, though, so in the end both are asked for at once, three times, by least squares over all vertices:
//
//     Σ (what a face lacks)² + Σ (v-isoline of a face by a crest, its cosine with the crest)² + .01 Σ (side beside its cross)²
//       + .25 Σ |difference of the ways of two neighbours|² + .01 Σ |way|²  least.
//
// Private to this room.
#pragma once

#include <optional>
#include <span>

#include "forest/cortex/crosses.h"
#include "forest/cortex/quads.h"

namespace forest::cortex {

/// What quadrilaterals are laid by: at every vertex of the ribbon the way it is bent, an arm of its cross, the line that passes and the
/// volume under a unit of area, µm; and all lines.
struct Guides {
  std::span<const Curvature> curvatures;
  std::span<const Place> arms;
  std::span<const std::optional<Pass>> by;
  std::span<const double> heights;
  std::span<const Line> lines;
};

/// @param quads   whose points are set, too
/// @param volume  µm³, under all of them
void even_volumes(Quads& quads, const Ribbon& ribbon, const Guides& guides, double volume, int rounds,
                  Progress& progress);

}  // namespace forest::cortex
