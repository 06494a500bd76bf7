// SPDX-License-Identifier: Apache-2.0
// Elements whose faces are right and whose inside is not: the eight inner control points are moved until det J is positive
// everywhere. Faces stay, bit for bit, so neighbours are not touched.
#pragma once

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

/// The inner control points by transfinite interpolation of the six faces: with them the element is the trilinear Boolean sum of
/// its faces (Gordon & Hall 1973).
Hexahedron blended_inside(Hexahedron faces);

struct Untangled {
  Hexahedron hexahedron;
  Certificate certificate;
};
/// The element itself where it is certified. Otherwise the blended one, and where that is not certified either, the one whose inner control
/// points make Jacobians at 7×7×7 places most even (minimise.h). Not positive in the end: no inside was found for these
/// faces, most often because they fold themselves, at `certificate.where`.
Untangled untangle(const Hexahedron& hexahedron);

}  // namespace forest::cortex
