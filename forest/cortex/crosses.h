// SPDX-License-Identifier: Apache-2.0
// A cross at every vertex of the ribbon, which the sides of elements follow: along the principal curvatures where it is bent in one
// direction, along crests and valleys exactly, smooth elsewhere (Knöppel, Crane, Pinkall & Schröder 2013, "Globally optimal
// direction fields", ACM Trans Graph 32:59). Private to this room.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forest/cortex/lines.h"
#include "forest/cortex/ribbon.h"

namespace forest::cortex {

// Where a line passes by a vertex: the nearest place on it and its direction.
struct Pass {
  Place at, along;
  Line::Kind kind;

  bool holds() const { return kind != Line::Kind::crest; }  // sides of elements lie on it
};

/// Of every vertex, the strongest line that goes through a triangle of it.
std::vector<std::optional<Pass>> passes(const Ribbon& ribbon, std::span<const Line> lines);

/// Unit, tangential: one arm of the cross of every vertex; the others are at right angles.
std::vector<Place> crosses(const Ribbon& ribbon, const Neighbours& near,
                           std::span<const Curvature> curvatures, std::span<const Line> lines);

}  // namespace forest::cortex
