// SPDX-License-Identifier: Apache-2.0
// Angles of many vectors at once, in loops that the compiler makes vectors of.
#pragma once

#include <cstddef>

namespace forest::statistics {

/// out[i] = atan2(y[i], x[i]) in degrees, for y >= 0, within two units in the last place; NaN where both are 0. `out` may be
/// `y` or `x`.
void angles_of(std::size_t count, const double* y, const double* x, double* out);

}  // namespace forest::statistics
