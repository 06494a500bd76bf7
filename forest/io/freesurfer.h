// SPDX-License-Identifier: Apache-2.0
// FreeSurfer's binary files of surfaces (Dale, Fischl & Sereno 1999, NeuroImage 9:179): whole numbers and floats of 32 bits,
// the first byte first.
//
//   surface  FF FF FE, two lines of text, vertices n, triangles m; n × (x, y, z) in mm; m × three vertices; then what we
//            do not need
//   values   FF FF FF, vertices n, triangles m, values a vertex (1); n × value
//   areas    vertices n; n × (vertex, colour), a colour being red + 256 green + 65536 blue; 1; then a table of colours and
//            names, whose length is negative, its version, where entries are numbered (lh.aparc.annot)
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "forest/io/surface.h"

namespace forest::io {

bool is_freesurfer_surface(std::string_view bytes);
bool is_freesurfer_values(std::string_view bytes);

/// Throw InputError.
Mesh read_freesurfer_surface(std::string_view bytes, const std::string& name);  // in µm
std::string write_freesurfer_surface(const Mesh& mesh);
bool is_freesurfer_areas(std::string_view bytes);
/// Values are places in `labels`; none where a vertex has a colour that the table has not.
SurfaceValues read_freesurfer_areas(std::string_view bytes, const std::string& name);
std::vector<float> read_freesurfer_values(std::string_view bytes, const std::string& name);

}  // namespace forest::io
