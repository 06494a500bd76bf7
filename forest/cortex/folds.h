// SPDX-License-Identifier: Apache-2.0
// The folds of a cortex: its ribbon without creases, how it is bent, and the lines along its crowns and fundi.
#pragma once

#include <vector>

#include "forest/core/progress.h"
#include "forest/cortex/lines.h"
#include "forest/cortex/w_curve.h"

namespace forest::cortex {

struct Folds {
  Ribbon ribbon;                // unfolded
  std::vector<Curvature> bent;  // its middle, at every vertex, seen over the scale
  std::vector<Line> lines;      // crests and valleys, on its middle
  std::vector<Line> sulci;      // their floors, on its outer surface
};

/// @param dropped  made of the curves
/// @param scale    µm: what is smaller is no crest and no valley
Folds find_folds(const Ribbon& dropped, const WCurves& curves, double scale, Progress& progress);

/// The edge of triangles to which a ribbon is refined for elements of this volume (µm³), µm: two to a side of the lattice by which
/// elements are laid, or more.
double ribbon_edge(double volume);

}  // namespace forest::cortex
