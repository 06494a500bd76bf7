// SPDX-License-Identifier: Apache-2.0
#include "forest/core/round_numbers.h"

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
  if (!(span > 0.) || !std::isfinite(span)) return {low};
  const double step = round_above(span / count);
  std::vector<double> out;
  // A step's billionth more or less is the same number; no zero is negative.
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    out.push_back(k * step + 0.);
  return out;
}

}  // namespace forest
