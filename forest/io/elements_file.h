// SPDX-License-Identifier: Apache-2.0
// The elements of a cortex as an HDF5 file. Lengths in µm; rows of three are x, y, z.
//
//   /                    attributes: magic "brainforest cortex", version 1
//   /curves/places       curves × 4 × 3: places at w = 0, 1/3, 2/3 and 1; corners come first
//   /elements/curves     elements × 16 curves; u runs fastest, then v
//   /corners/on_valley   corners: 1 on a valley line
//   /corners/depths, /elements/depths   19 each: w at depths 1/20, 2/20, … (forest/cortex/depth.h); absent: depth is w
//   /lines/{points, starts, kind, strength}   crests (0) and valleys (1) half way down, floors of sulci (3) on the
//                        outer surface: line i has the points from starts[i] on
//   /facts               volume of an element asked for; volumes between the surfaces and under the wall; w-angles, …
#pragma once

#include <filesystem>

#include "forest/cortex/build.h"

namespace forest::io {

/// Throws Error when it cannot be written; nothing is left then.
void write_elements(const std::filesystem::path& path, const cortex::Cortex& cortex, double volume);

struct ElementsFile {
  cortex::Cortex cortex;  // its lines know their points and kinds, and no triangles
  double volume = 0.;     // µm³, of an element, asked for
};
/// Throws InputError for what is no such file, is cut off, or has numbers that cannot be.
ElementsFile read_elements(const std::filesystem::path& path);

}  // namespace forest::io
