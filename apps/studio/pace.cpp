// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/pace.h"

#include <algorithm>
#include <cmath>

namespace forest::studio {
namespace {
constexpr float coarsest = 8.f;  // times the wanted error: beyond it branches come apart visibly
}

void Pace::drew(float milliseconds) {
  if (warming_up_ > 0) {
    --warming_up_;
    return;
  }
  milliseconds_ = milliseconds_ > 0.f ? .8f * milliseconds_ + .2f * milliseconds : milliseconds;
  // The time falls more slowly than the error grows: half steps, so that the two do not chase one another.
  const float ratio = std::clamp(milliseconds / budget_, .5f, 2.f);
  factor_ = std::clamp(factor_ * std::sqrt(ratio), 1.f, coarsest);
}

float Pace::error(float wanted) const { return wanted * factor_; }

}  // namespace forest::studio
