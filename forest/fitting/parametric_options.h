// SPDX-License-Identifier: Apache-2.0
// What is asked when a published form of model is fitted (burke.h, hillman.h).
#pragma once

#include <cstdint>
#include <functional>

#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::fitting {

/// What came of correcting what makes branches fork: tips of a kind, in the mean of cells.
struct Corrected {
  SectionKind kind;
  double traced, grown;
};

struct ParametricOptions {
  statistics::KindSet kinds = statistics::KindSet::all();  // each kind gets numbers of its own
  int rounds =
      10;  // of growing cells and correcting what makes them fork until they have as many tips; 0: as measured
  std::uint64_t seed = 1;
  std::function<void(const Corrected&)> tell = {};  // of each kind
};

}  // namespace forest::fitting
