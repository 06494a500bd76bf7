// SPDX-License-Identifier: Apache-2.0
// How far arbors reach along an axis, and how they fill space.
#pragma once

#include <vector>

#include "forest/statistics/arbors.h"

namespace forest::statistics {

/// L-Measure's Width, Height and Depth (Scorcioni, Polavaram & Ascoli 2008): the least extent along an axis, µm, that holds
/// `part` of the path length, each segment counted where it ends. NaN without any length.
double extent_holding(double part, const Arbors& arbors, const std::vector<double>& coordinate);

/// Fractal dimension by counting boxes (Smith, Marks, Lange, Sheriff & Neale 1989, J Neurosci Methods 27:173): cubes of side
/// L/2, L/4, … L/64, L the greatest extent along x, y or z, of which N hold a piece of a branch; the slope of the regression
/// of log N on -log(side). NaN without extent.
double box_dimension(const Arbors& arbors);

}  // namespace forest::statistics
