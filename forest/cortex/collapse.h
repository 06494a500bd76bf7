// SPDX-License-Identifier: Apache-2.0
// From a lattice on a triangulation to faces: triangles are collapsed until every lattice point is one vertex, which keeps the surface
// whole, and paired into quadrilaterals; all faces are halved once, so that what is left over is quadrilaterals too.
// Private to this room.
#pragma once

#include <cstdint>
#include <vector>

#include "forest/cortex/lattice.h"
#include "forest/cortex/quads.h"

namespace forest::cortex {

struct Faces {
  std::vector<Place> places;
  std::vector<std::uint8_t> on_valley;
  std::vector<std::vector<std::uint32_t>> faces;  // of three or four corners
};

/// Triangles of the sites of a settled level.
Faces collapsed(const Level& level, std::vector<Triangle> triangles);

/// Every face as as many quadrilaterals as it has corners, each from a corner to the middle; without places on the ribbon yet.
Quads halved(const Faces& faces);

}  // namespace forest::cortex
