// SPDX-License-Identifier: Apache-2.0
// Surfaces in PLY (Turk 1994): a header of text names elements and their properties, then come their values, as text or as bytes of
// either order. Taken are x, y and z of `vertex` and the list vertex_indices (or vertex_index) of `face`; whatever else there is, is
// passed over. Lengths are taken as mm, which the format does not name. Faces of more than three corners become fans of triangles.
// Corners of faces at the very same places become one vertex where that closes the surface (geometry/weld.h).
#pragma once

#include <string>
#include <string_view>

#include "forest/geometry/mesh.h"

namespace forest::io {

bool is_ply(std::string_view bytes);
/// In µm. Throws InputError.
Mesh read_ply_surface(std::string_view bytes, const std::string& name);

}  // namespace forest::io
