// SPDX-License-Identifier: Apache-2.0
// Surfaces as text, of two formats that share a name and nothing else:
//
//   Wavefront OBJ   "v x y z" a vertex, "f 1 2 3" or "f 1/1/1 2/2/2 3/3/3" a face, counted from 1, negative from the end; other
//                   lines say how it looks
//   MNI OBJ         of the Montreal Neurological Institute (MacDonald 1990s), as CIVET and BigBrain have them: "P", five numbers
//                   of how it looks, n; n points, n normals, m; colours; m ends of faces; corners of all faces, counted from 0
//
// Lengths are taken as mm, which neither names. Faces of more than three corners become fans of triangles. Corners of faces at the
// very same places become one vertex where that closes the surface (geometry/weld.h).
#pragma once

#include <string>
#include <string_view>

#include "forest/geometry/mesh.h"

namespace forest::io {

/// Whether the first word that is no comment is one of theirs.
bool is_obj(std::string_view bytes);
/// In µm. Throws InputError.
Mesh read_obj_surface(std::string_view text, const std::string& name);

}  // namespace forest::io
