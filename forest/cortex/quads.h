// SPDX-License-Identifier: Apache-2.0
// The footprints of the elements: quadrilaterals on the middle of the ribbon whose sides run along and across the folds, and
// under each of which lies the same volume.
//
//   1. a cross at every vertex (crosses.h) and a lattice along the crosses, whose spacing makes up the wanted volume with the thickness
//      there (lattice.h);
//   2. triangles collapsed to the lattice and paired, all faces halved once (collapse.h), faults mended (valence.h);
//   3. vertices move along the ribbon until volumes are even (evening.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "forest/cortex/lines.h"
#include "forest/cortex/ribbon.h"

namespace forest::cortex {

using Quad = std::array<std::uint32_t, 4>;  // counter-clockwise seen from outside

struct Quads {
  std::vector<Place> middle;        // of the vertices
  std::vector<RibbonPoint> points;  // and where they are
  std::vector<Quad> quads;
  std::vector<std::uint8_t> on_valley;  // 1: the vertex lies on a valley
};

struct QuadOptions {
  double volume = 1e9;  // µm³ under each
  double whole = 0.;    // µm³ that all share; 0: what lies under the ribbon, whose triangles cut folds
  double volume_within = .007;  // of the volume wanted: how near their mean must come
  int attempts = 40;            // to have it so
  int relaxations = 30;
};

Quads lay_quads(const Ribbon& ribbon, std::span<const Curvature> curvatures, std::span<const Line> lines,
                const QuadOptions& options, Progress& progress);

}  // namespace forest::cortex
