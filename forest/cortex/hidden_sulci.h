// SPDX-License-Identifier: Apache-2.0
// Sulci that no section shows. One that runs along the sections between two of them leaves grey matter in both, and what is
// interpolated between is grey, too. The inner surface knows of it: where one is as far from white matter as the cortex is
// thick, and there is white matter on both sides, two banks meet. (The same thought makes sulci of volumes in which banks
// touch: anatomically consistent enhancement, Han et al. 2004.)
#pragma once

#include "forest/geometry/isosurface.h"

namespace forest::cortex {

/// Puts a sheet of outside between banks that meet between two sections, where it hangs together with what is outside.
/// @param outer    negative within the outer surface; its third axis goes across the sections
/// @param inner    of the same grid, negative within the inner surface
/// @param between  every so many layers is a section, beginning with the first; sections stay as they are
/// @param value    of the sheet, > 0
/// @return  how many points of the grid came outside
std::size_t open_hidden_sulci(ScalarGrid& outer, const ScalarGrid& inner, std::size_t between, float value);

}  // namespace forest::cortex
