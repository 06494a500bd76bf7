// SPDX-License-Identifier: Apache-2.0
// The footprints of the elements: quadrilaterals on the middle of the ribbon whose sides run along and across the folds, and
// under each of which lies the same volume.
//
//   1. a cross at every vertex, along the principal curvatures where the ribbon is bent in one direction, and along crests and
//      valleys exactly; smooth elsewhere (Knöppel, Crane, Pinkall & Schröder 2013, "Globally optimal direction fields");
//   2. a lattice point at every vertex, of a lattice along the crosses whose spacing makes up the wanted volume with the
//      thickness there; those of neighbours agree as well as they can, and lines of the lattice lie on the valleys (Jakob,
//      Tarini, Panozzo & Sorkine-Hornung 2015, "Instant field-aligned meshes");
//   3. the triangles are collapsed until every lattice point is one vertex, which keeps the surface whole, and paired into
//      quadrilaterals; all faces are halved once, so that what is left over is quadrilaterals too;
//   4. vertices move along the ribbon until volumes are even.
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
  double volume = 1e9;          // µm³ under each
  double volume_within = .005;  // of it: how near their mean must come
  int relaxations = 60;
};

Quads lay_quads(const Ribbon& ribbon, std::span<const Curvature> curvatures, std::span<const Line> lines,
                const QuadOptions& options, Progress& progress);

/// Unit, tangential: one arm of the cross of every vertex; the others are at right angles.
std::vector<Place> crosses(const Ribbon& ribbon, const Neighbours& near,
                           std::span<const Curvature> curvatures, std::span<const Line> lines);

}  // namespace forest::cortex
