// SPDX-License-Identifier: Apache-2.0
// Neurons in HDF5, as MorphIO has them (BlueBrain/MorphIO, doc/source/specification_h5.rst, versions 1.0 to 1.3):
//
//   points      float [n][4]  x, y, z, diameter
//   structure   int   [m][3]  first point, type, row of the parent; a section runs to the next one's first point
//   metadata    version, cell_family: 0 neuron, 1 glia, 2 dendritic spine
//   perimeters  float [n]     since 1.1; organelles/… since 1.2 (mitochondria, endoplasmic reticulum), 1.3 (PSD)
//
// Row 0 is the soma when its type is 1: an outline. A child's first point is its parent's last. Groups with `points`
// and `structure` anywhere in a file are cells of a container; version 2 (/neuron1) is read as well.
// docs/formats/h5.md says what becomes of all that.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/io/format.h"

namespace forest::io {

bool recognises_h5(std::string_view bytes);

/// Throws InputError when the file is no neuron, is of a later version, or its rows do not fit its points.
ReadResult read_h5(std::string_view bytes, const std::string& name);
std::vector<Cell> read_all_h5(std::string_view bytes, const std::string& name);

/// Version 1.3. The same neuron gives the same bytes. What the format has no words for stands in a group brain_forest,
/// which other programs skip.
std::string write_h5(const Morphology& morphology);

/// A container, each cell in the group of its name; a/b is a group in a group. Throws Error when a name is empty or stands twice.
std::string write_h5(std::span<const NamedMorphology> cells);

/// Every deviation that is read, in the order of enum H5Oddity (h5.cpp).
std::span<const Oddity> h5_oddities();

}  // namespace forest::io
