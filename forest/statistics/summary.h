// SPDX-License-Identifier: Apache-2.0
// Many values in five numbers.
#pragma once

#include <cstddef>
#include <span>

namespace forest::statistics {

/// Of the values that are defined (not NaN). All but `count` are NaN when there is none.
struct Summary {
  std::size_t count = 0;
  double mean, sd;  // sd: of a sample (n - 1); 0 for a single value
  double min, median, max;
};

Summary summarize(std::span<const double> values);

/// The first three of them alone, which need no sorting.
struct Moments {
  std::size_t count = 0;
  double mean, sd;
};
Moments moments(std::span<const double> values);

/// Of the values that are defined; NaN when there is none. Takes a tenth of the time of all five numbers.
double mean(std::span<const double> values);

}  // namespace forest::statistics
