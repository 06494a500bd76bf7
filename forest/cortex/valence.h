// SPDX-License-Identifier: Apache-2.0
// Fewer vertices with more or less than four quadrilaterals around them. Two changes, each made where it lowers the sum of
// (quadrilaterals around a vertex − 4)² and turns nothing over (Kinney 1997, "CleanUp: Improving quadrilateral finite
// element meshes"):
//
//       p───────q            p───────q                 ╱╲ b
//       │       │            │     ╱ │              a ╱  ╲ c              b
//       x───────v    ──►     x   ╱   v                ╲  ╱     ──►     a=c│
//       │       │            │ ╱     │                 ╲╱ d               d
//       s───────r            s───────r
//     a side is turned                          a quadrilateral is closed
#pragma once

#include "forest/cortex/quads.h"

namespace forest::cortex {

/// Sides with both ends on a valley, and vertices on the border, stay. Only middle, on_valley and quads are looked at; vertices are
/// numbered anew. Returns the number of changes.
std::size_t even_valences(Quads& quads);

}  // namespace forest::cortex
