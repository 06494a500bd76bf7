// SPDX-License-Identifier: Apache-2.0
// Surfaces in STL (3D Systems 1989), as text or as bytes: triangles one by one, each with its own three corners. Corners at the very same
// place become one vertex, so that what is closed stays so. Normals are not looked at: corners run counter-clockwise seen from outside.
// Lengths are taken as mm, which the format does not name.
//
//   text   solid NAME, then "facet normal … outer loop vertex x y z vertex … vertex … endloop endfacet", then endsolid
//   bytes  80 of any kind, the number of triangles, then for each 12 floats (normal, corners) and 2 bytes, the lowest byte first
#pragma once

#include <string>
#include <string_view>

#include "forest/geometry/mesh.h"

namespace forest::io {

/// Whether it is as long as the number of its triangles says, or text of the kind above.
bool is_stl(std::string_view bytes);
/// In µm; vertices in the order in which they come first. Throws InputError.
Mesh read_stl_surface(std::string_view bytes, const std::string& name);

}  // namespace forest::io
