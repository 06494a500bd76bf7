// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace forest::statistics {

Summary summarize(std::span<const double> values) {
  std::vector<double> v;
  v.reserve(values.size());
  std::ranges::copy_if(values, std::back_inserter(v), [](double x) { return !std::isnan(x); });
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (v.empty()) return {0, nan, nan, nan, nan, nan};

  std::ranges::sort(v);
  const std::size_t n = v.size();
  const double mean = std::accumulate(v.begin(), v.end(), 0.) / double(n);
  double squares = 0.;
  for (const double x : v) squares += (x - mean) * (x - mean);
  return {.count = n,
          .mean = mean,
          .sd = n > 1 ? std::sqrt(squares / double(n - 1)) : 0.,
          .min = v.front(),
          .median = 0.5 * (v[(n - 1) / 2] + v[n / 2]),
          .max = v.back()};
}

double mean(std::span<const double> values) {
  double sum = 0.;
  std::size_t count = 0;
  for (const double x : values)
    if (!std::isnan(x)) sum += x, ++count;
  return count ? sum / double(count) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace forest::statistics
