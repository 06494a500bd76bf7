// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/folds.h"

#include <cmath>

#include "forest/cortex/sulci.h"

namespace forest::cortex {

double ribbon_edge(double volume) { return .75 * std::sqrt(volume / 2500.); }

Folds find_folds(const Ribbon& dropped, const WCurves& curves, double scale, Progress& progress) {
  Folds folds{unfolded(dropped, curves, progress), {}, {}, {}};
  const Ribbon& ribbon = folds.ribbon;
  progress.begin("looking for crests and valleys", 0);
  folds.bent =
      curvatures(ribbon.middle, ribbon.triangles, neighbours(ribbon.size(), ribbon.triangles), scale);
  folds.lines = crests_and_valleys(ribbon, folds.bent, {.scale = scale});
  progress.end();
  progress.begin("looking for the floors of sulci", 0);
  folds.sulci = sulci(coarser(dropped), {});
  progress.end();
  return folds;
}

}  // namespace forest::cortex
