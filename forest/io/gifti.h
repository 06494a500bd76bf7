// SPDX-License-Identifier: Apache-2.0
// GIFTI, the geometry format of neuroimaging (Harwell, Bremen, Coulon et al. 2008, "GIfTI surface data format", version 1.0):
// XML around arrays of numbers, which are text, base64, or base64 of deflated bytes.
//
//   <GIFTI><LabelTable><Label Key="1" Red=".1" …>V1</Label></LabelTable>
//     <DataArray Intent="NIFTI_INTENT_POINTSET" DataType="NIFTI_TYPE_FLOAT32" Dim0="10242" Dim1="3" Encoding="…" Endian="…">
//       <Data>…</Data></DataArray> …</GIFTI>
//
// A surface has one array of points (mm) and one of triangles; any other array is values. Matrices that lead to other
// spaces are not applied, as no program does unasked.
#pragma once

#include "forest/io/surface.h"

namespace forest::io {

/// Throw InputError.
Mesh read_gifti_surface(std::string_view text, const std::string& name);  // in µm
std::string write_gifti_surface(const Mesh& mesh);
/// surface_structure.
std::string gifti_structure(std::string_view text, const std::string& name);
/// Of several arrays the first.
SurfaceValues read_gifti_values(std::string_view text, const std::string& name);

}  // namespace forest::io
