// SPDX-License-Identifier: Apache-2.0
// How alike successive sections of a fold are: those that follow its elements, against those of a knife.
//
//   t ▲ ┌┬┬┬┬┬┬┐   A stretch is a piece of the lattice over a crest, so many elements across the fold (s) and so many along it (t),
//     │ ├┼┼┼┼┼┼┤   without a fault. Its v-sections are the surfaces between its rows: all s and w at a whole t. A planar cut is
//     │ ├┼┼┼┼┼┼┤   where planes as far apart as those rows are meet the same columns: at every (s, w) one crosses the line of t.
//     │ ├┼┼┼┼┼┼┤
//       └┴┴┴┴┴┴┘─► s
//
// A section is laid flat, on the plane nearest to it, and drawn as six bands, its layers by share of volume (human_layers). Two
// successive ones are laid over one another by the shift and turn that make them agree best; their difference is 1 − the area on
// which both have the same layer, over what the layers of either cover: the intersection over the union of the masks.
//
// Planes are tried in all directions up to 40° from across the stretch, each stretch by itself, and the one with the least mean
// difference is taken. This favours planes: a knife has one direction for a whole block.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/cortex/elements.h"
#include "forest/cortex/lines.h"

namespace forest::cortex {

struct SymmetryOptions {
  int across = 6, along = 12;  // elements of a stretch
  std::size_t stretches = 24;  // at most, spread over all crests
  double pixel = 50.;          // µm
};

struct Symmetry {
  double elements = 0.;       // mean difference of successive v-sections
  double best_planar = 0.;    // of successive planes, each stretch cut in its best direction
  std::size_t stretches = 0;  // 0: there was none, and the rest says nothing
};

/// @param lines  of which the crests say where stretches lie
/// The same at any number of threads.
Symmetry symmetry(const Elements& elements, std::span<const Line> lines, const SymmetryOptions& options = {});

}  // namespace forest::cortex
