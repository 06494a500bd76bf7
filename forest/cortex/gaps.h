// SPDX-License-Identifier: Apache-2.0
// What lies between a surface and the faces of elements that stand for it, measured from the surface: a fold narrower than an element is
// a pocket that faces do not see, as their way to the surface is short beside it.
#pragma once

#include <vector>

#include "forest/cortex/elements.h"

namespace forest::cortex {

/// Of every element the volume between its face and the surface, µm³: positive where the surface lies outside of the element, negative
/// within. Every small piece of the surface adds its height over the nearest face times its area as seen along the face's normal, so
/// that walls and floor of a pocket count as they should (the divergence theorem). What is nearest to a rim by the wall, or looks
/// the other way, is of no face.
/// @param depth  0: faces on the outer surface, 3: on the inner one
std::vector<double> gaps(const Elements& elements, std::size_t depth, const TriangleTree& surface);

}  // namespace forest::cortex
