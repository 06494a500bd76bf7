// SPDX-License-Identifier: Apache-2.0
// Many numbers in a few.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace forest::cortex {

/// What this share of the values does not exceed; 0 where there are none. Their order changes.
inline double share_of(std::vector<double>& values, double share) {
  if (values.empty()) return 0.;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Spread {
  double median = 0., p99 = 0.;
};
inline Spread spread_of(std::vector<double>& values) { return {share_of(values, .5), share_of(values, .99)}; }

}  // namespace forest::cortex
