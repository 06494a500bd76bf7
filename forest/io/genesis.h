// SPDX-License-Identifier: Apache-2.0
// GENESIS cell parameter files (.p), what the routine readcell of GENESIS 2 reads: a line a compartment,
// `name parent x y z diameter [channel density]…`, in µm, and lines that begin with * and say how to read those that follow
// (Wilson and Bower 1989, "The simulation of large-scale neural networks"; GENESIS 2.4 Reference Manual, readcell).
//
//   - A compartment is a segment of its diameter; runs without branch, of one kind, are sections. The kind is told by the
//     name (genesis_kind).
//   - The compartment named soma is the soma: a sphere if it has no length, else cylinders. Where it hangs on a dendrite, the
//     tree is turned to begin at it.
//   - Membrane parameters and channels do not change the shape; they are kept as annotations.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/io/format.h"

namespace forest::io {

/// A compartment has one diameter and a length, so a point where another lies already has no place.
inline constexpr Keeps genesis_keeps{.foreign_tags = false,
                                     .contours = false,
                                     .still_points = false,
                                     .lengthless = false,
                                     .zero_radii = false,
                                     .spines = false};

bool recognises_genesis(std::string_view bytes);

/// Throws InputError when a line is neither compartment, option nor comment, or when there is no compartment.
ReadResult read_genesis(std::string_view bytes, const std::string& name);
/// The cell of the file, then those after *start_cell that are no prototype.
std::vector<Cell> read_genesis_cells(std::string_view bytes, const std::string& name);

/// Both ends of each compartment, absolute. Its diameter is that of a cylinder of the segment's area, so that GENESIS finds
/// the membrane that was measured; the diameters at its ends stand in a comment where they differ.
std::string write_genesis(const Morphology& morphology);

/// Every deviation that is read.
std::span<const Oddity> genesis_oddities();

}  // namespace forest::io
