// SPDX-License-Identifier: Apache-2.0
// Pictures of few samples a pixel, made a little more like those of many.
#pragma once

#include "forest/frame/frame.h"

namespace forest::frame {

/// Every pixel takes `share` (0–0.25, in 256ths) of each of its two neighbours in its row, then of those in its column; those
/// beyond the border are the pixel's own. Where one sample says whether a branch is met, the pixels beside it know some of how
/// much of the pixel it covers.
/// @param to  another image; one that was as large before is written over and costs no memory
void soften(const Image& from, float share, Image& to);

}  // namespace forest::frame
