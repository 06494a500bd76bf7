// SPDX-License-Identifier: Apache-2.0
// How noisy a surface is.
#pragma once

#include "forest/geometry/mesh.h"

namespace forest {

/// How far vertices scatter about a smooth surface, µm: the standard deviation of independent normal numbers that would leave as much
/// behind as the surface does when what a vertex shares with its neighbours is taken away three times (what is left of smooth folds
/// falls with the sixth power of the triangles' edges over their width; what is left of noise does not), along the normals, in the
/// median of all vertices. 0 without triangles. The mesh must be closed.
double roughness(const Mesh& mesh);

}  // namespace forest
