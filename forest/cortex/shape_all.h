// SPDX-License-Identifier: Apache-2.0
// From elements as they are dropped to those that are valid, well shaped, of even volumes, and lie on both surfaces: the order in which
// faces are fitted (fit_faces.h), elements shaped (shape.h) and mended (mending.h), and how much is asked each time. What each
// step does for two hemispheres is in docs/cortex/elements.md.
#pragma once

#include "forest/cortex/build.h"

namespace forest::cortex {

/// What cannot be made valid by the wall goes to it.
/// @param cortex  with `between` and `wall`; its elements, `wall`, `mending` and `left_out` change
/// @param volume  wanted of an element, µm³
void shape_all(Cortex& cortex, const SurfaceTrees& surfaces, double volume, Progress& progress);

}  // namespace forest::cortex
