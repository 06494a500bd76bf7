// SPDX-License-Identifier: Apache-2.0
// How successive sections differ: distances between their contours laid over one another.
#pragma once

#include <vector>

#include "forest/cortex/contours.h"

namespace forest::cortex {

/// Of an object, from a section to the next. Distances are of points all along the contours of each section, 50 µm apart or
/// less, from the nearest contour of the other: both ways, so that nothing that one section lacks goes unseen. µm; NaN where
/// only one of the two has contours.
struct SectionChange {
  std::size_t section = 0;  // and the next
  std::uint32_t object = 0;
  double mean = 0., p95 = 0., greatest = 0.;  // the last is Hausdorff's
  double overlap =
      0.;  // what lies within both, as a share of what lies within either; along 2000 lines, on each exactly
};

/// Objects that neither section has are left out. On all cores.
std::vector<SectionChange> changes(const ContourStack& stack, Progress& progress);

}  // namespace forest::cortex
