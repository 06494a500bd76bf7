// SPDX-License-Identifier: Apache-2.0
// Whether two surfaces can be those of a cortex, before any work is done on them.
#pragma once

#include <string>
#include <vector>

#include "forest/geometry/mesh.h"

namespace forest::cortex {

/// Throws Error, a sentence with a place, when a pair of surfaces cannot be that of a cortex: one is empty, has coordinates
/// that are no numbers, is open, has triangles that face opposite ways, is in pieces, has handles, faces inwards, is noise
/// (geometry/roughness.h), cuts itself at more than one triangle of 200; its size is no hemisphere's in mm; the inner one is larger; one
/// lies on the wrong side of the other by half a millimetre somewhere (by a quarter of the mean thickness, where that is less), or at more
/// than one vertex of 33 by a tenth (a twentieth of the thickness).
/// Returns what is odd, in sentences: triangles that cut one another but are few; surfaces that cross by a tenth of a millimetre and less
/// than what is refused, as averaged ones do by the medial wall: how many vertices, how deep and where.
std::vector<std::string> check_surfaces(const Mesh& outer, const Mesh& inner);

}  // namespace forest::cortex
