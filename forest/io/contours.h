// SPDX-License-Identifier: Apache-2.0
// Contours of sections, to and from files (docs/cortex/contours.md):
//
//   .contours   our own: JSON, in µm, every number to the last bit
//   .svg        one section a file: paths, a group an object; what drawing programs show and change
//   .jser       Reconstruct and PyReconstruct (Fiala 2005): JSON, in µm                                   read only
//   .slc        stacks of SurfaceReconstructionLibrary: "slice Z", "contour closed", x y …, "adjacent", -1   read only
//
// Files are told by what is in them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "forest/cortex/contours.h"

namespace forest::io {

struct ReadContours {
  cortex::ContourStack stack;
  std::vector<std::string> oddities;  // sentences: what was left out
};

/// @param unit  µm of one unit of an .slc file, which names none
/// Throws InputError. What is no closed curve is left out and told; a contour of an .slc or .jser file may run either way
/// round and is turned so that its inside lies to the left, holes by how many others they lie in.
ReadContours read_contours(std::string_view bytes, const std::string& name, double unit = 1000.);

std::string write_contours(const cortex::ContourStack& stack);

/// A section as a drawing in mm, upwards what is up in the section; reading it back gives the same numbers.
/// @param behind  another section that is drawn pale behind it; may be null
std::string write_svg(const cortex::ContourStack& stack, const cortex::Section& section,
                      const cortex::Section* behind = nullptr);
/// One section of a stack, contours turned so that their insides are to the left. The paths of groups are the objects; commands M L H V C S Q T Z are read, in either case.
ReadContours read_svg(std::string_view text, const std::string& name);

/// Sections of several drawings as one stack, by their places. Throws InputError when two are at one place or along other axes.
/// @param name  of their folder
cortex::ContourStack gathered(const std::vector<cortex::ContourStack>& drawings, const std::string& name);

}  // namespace forest::io
