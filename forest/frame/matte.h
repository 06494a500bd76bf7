// SPDX-License-Identifier: Apache-2.0
// Pictures without ground, from the same one drawn on black and on white (difference matting: Smith & Blinn 1996, "Blue screen
// matting"). What differs is seen through; so thin branches, what is in fog of the ground's colour and what is transparent itself are as
// opaque as they hide the ground.
#pragma once

#include "forest/frame/frame.h"

namespace forest::frame {

/// Colours that are not multiplied by their opacity, as PNG has them. Laid over black or white, in sRGB as slides and browsers do, it is
/// either picture to within rounding: exactly where both are one colour (opacity 255) or black and white (0, as nothing is there), and where the ground
/// shows as much of all three colours; elsewhere opacity is the mean over these, and what is wrong is shared by both.
Image matted(const Image& on_black, const Image& on_white);

}  // namespace forest::frame
