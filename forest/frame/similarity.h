// SPDX-License-Identifier: Apache-2.0
// How far two pictures of one size are alike, on luminance (Rec. 709 weights on 8-bit sRGB values, 0–255).
#pragma once

#include <vector>

#include "forest/frame/frame.h"

namespace forest::frame {

std::vector<float> luminance(const Image& image);

/// Mean structural similarity (Wang, Bovik, Sheikh & Simoncelli 2004, IEEE Trans Image Process 13:600): Gaussian window
/// of 11 × 11 pixels, σ 1.5, K1 = .01, K2 = .03; 1 for equal pictures. Only windows that lie wholly inside count, as in
/// the authors' own program; where the picture is smaller than one, windows are cut at its edge.
/// Throws Error when the sizes differ or are zero.
double similarity(const Image& a, const Image& b);

/// Mean absolute difference of luminance, 0–255: how much changes from one picture to the next. Throws as above.
double change(const Image& a, const Image& b);

}  // namespace forest::frame
