// SPDX-License-Identifier: Apache-2.0
// Triangles that each bring their own corners, as STL writes them and other programs may, hang together again.
#pragma once

#include "forest/geometry/mesh.h"

namespace forest {

/// Vertices at the very same place (0 and -0 are one) become one, with the first one's label, in the order in which they come first.
/// A triangle of which two corners become one is left out.
Mesh welded(const Mesh& mesh);

/// Welded if that is what it takes to be closed: any other mesh keeps the numbers of its vertices, which values in other files go by.
Mesh welded_if_open(Mesh mesh);

}  // namespace forest
