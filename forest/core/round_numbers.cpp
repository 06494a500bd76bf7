// SPDX-License-Identifier: Apache-2.0
#include "forest/core/round_numbers.h"

#include <algorithm>
#include <cmath>

namespace forest {
namespace {

double decade_of(double x) { return std::pow(10., std::floor(std::log10(x))); }

}  // namespace

double round_below(double most) {
  const double decade = decade_of(most);
  for (const double factor : {5., 2.})
    if (factor * decade <= most) return factor * decade;
  return decade;
}

double round_above(double least) {
  const double decade = decade_of(least);
  for (const double factor : {1., 2., 5.})
    if (factor * decade >= least) return factor * decade;
  return 10. * decade;
}

std::vector<double> ticks(double low, double high, int count) {
  const double span = high - low;
  constexpr double same = 1e-9;  // but for what rounding makes of it
  if (!(span > same * std::max(std::abs(low), std::abs(high))) || !std::isfinite(span)) return {low};
  const double step = round_above(span / count), first = std::ceil(low / step - same);
  std::vector<double> out;
  // A step's billionth more or less is the same number; no zero is negative.
  for (int i = 0; (first + i) * step <= high + same * step; ++i) out.push_back((first + i) * step + 0.);
  return out;
}

}  // namespace forest
