// SPDX-License-Identifier: Apache-2.0
// Numbers that people read off scale bars and axes: 1, 2 and 5 × 10ⁿ, and their multiples.
#pragma once

#include <vector>

namespace forest {

/// The greatest of 1, 2 and 5 × 10ⁿ that is no more than `most`, which is greater than 0.
double round_below(double most);
/// The least of them that is no less than `least`, which is greater than 0.
double round_above(double least);

/// Multiples of such a number from `low` to `high`, at most `count` steps; `low` alone where there is nothing between, or no number.
std::vector<double> ticks(double low, double high, int count);

}  // namespace forest
