// SPDX-License-Identifier: Apache-2.0
// Surfaces of a cortex and the values on them, as programs that reconstruct it from magnetic resonance write them. Files are
// told by what is in them, packed by gzip or not:
//
//   GIFTI (gifti.h)           lh.pial.surf.gii, lh.thickness.shape.gii, lh.aparc.label.gii, …
//   OBJ (obj.h)               surfaces only, of Wavefront and of the Montreal Neurological Institute
//   PLY (ply.h), STL (stl.h)  surfaces only, as text or as bytes
//   FreeSurfer (freesurfer.h) lh.pial, lh.white, lh.inflated; lh.curv, lh.thickness, lh.sulc, lh.area; lh.aparc.annot
//   text                      values only, one a line; behind # what they are, such as "# thickness (mm)"
//
// All of them measure in mm, to the right, to the front and upwards; a Mesh of this project is in µm, along the same axes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/geometry/mesh.h"

namespace forest::io {

/// An area that a label file names.
struct SurfaceLabel {
  std::int32_t key = 0;
  std::string name;
  Vec3 colour = Vec3::Zero();  // sRGB, 0–1
  float alpha = 1.f;           // 0: not to be shown
};

/// One value a vertex.
struct SurfaceValues {
  std::vector<float> values;         // in the unit of the file; NaN: none
  std::string title = {};            // what they are, with their unit where the file says it; may be empty
  std::vector<SurfaceLabel> labels;  // not empty: the values are keys of them
};

/// Whether the bytes may be one of these files (or gzip's, which they may be in): a forest file is none.
bool may_be_surface(std::string_view bytes);

/// Positions in µm, labels 0. Throws InputError: what is no surface, cut off, or has coordinates or corners that cannot be.
Mesh read_surface(std::string_view bytes, const std::string& name);
/// The part of a brain that a surface is of, as Connectome Workbench names it (CORTEX_LEFT, CORTEX_RIGHT): from GIFTI's
/// metadata, or FreeSurfer's names of files (lh., rh.). Empty: nothing says. Throws InputError.
std::string surface_structure(std::string_view bytes, const std::string& name);
/// Throws InputError. Infinite values become none.
SurfaceValues read_surface_values(std::string_view bytes, const std::string& name);

/// The bytes of a file: GIFTI where the name ends in .gii, else FreeSurfer's. Coordinates are rounded to floats of mm.
std::string write_surface(const Mesh& mesh, std::string_view file_name);

/// The text of such a file.
/// @param title  "thickness (mm)"
std::string write_surface_values(std::string_view title, std::span<const double> values);

// What readers of these formats share.

/// A word of a file as an error may quote it: its first 40 characters, none that a terminal obeys.
std::string printable(std::string_view word);
/// µm of a vertex in mm. Throws InputError when it is not finite or farther away than any brain.
Vec3 micrometres(const Vec3& millimetres, const std::string& name, std::size_t vertex);
/// Throws InputError when one names a vertex that is not there.
void check_corners(const Mesh& mesh, const std::string& name);

}  // namespace forest::io
