// SPDX-License-Identifier: Apache-2.0
// Sholl's analysis (Sholl 1953, J Anat 87:387): how often spheres about the soma are crossed. Counted on the segments
// themselves, so that it does not matter how densely a branch was traced.
#pragma once

#include <vector>

#include "forest/statistics/arbors.h"

namespace forest::statistics {

inline constexpr double sholl_step = 10.;  // µm

/// Crossings of spheres about the origin of the arbors, of radius `first`, `first` + `step`, … (µm) up to the last that is
/// crossed. A sphere through a point is crossed by the segment on its inner side, once; one that only touches is not.
std::vector<double> sholl_crossings(const Arbors& arbors, double step, double first);

/// Of radius sholl_step, 2 sholl_step, …
std::vector<double> sholl_crossings(const Arbors& arbors);

}  // namespace forest::statistics
