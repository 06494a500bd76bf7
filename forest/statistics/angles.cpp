// SPDX-License-Identifier: Apache-2.0
// The arc tangent on [0, tan π/8] by the rational approximation of the Cephes library (Moshier 1989, Methods and Programs for
// Mathematical Functions), without branches.
#include "forest/statistics/angles.h"

#include <cmath>
#include <numbers>

#include "forest/core/clones.h"

namespace forest::statistics {

FOREST_CLONES void angles_of(std::size_t count, const double* y, const double* x, double* out) {
  constexpr double degrees = 180. / std::numbers::pi, quarter = std::numbers::pi / 4.;
#pragma GCC ivdep
  for (std::size_t i = 0; i < count; ++i) {
    const double s = y[i], c = std::abs(x[i]);
    const bool steep = s > c;
    const double t = (steep ? c : s) / (steep ? s : c);  // 0 to 1
    const bool upper = t > 0.66;
    const double u = upper ? (t - 1.) / (t + 1.) : t, z = u * u;
    const double p =
        (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z -
         1.228866684490136173410e2) *
            z -
        6.485021904942025371773e1;
    const double q =
        ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2) *
             z +
         4.853903996359136964868e2) *
            z +
        1.945506571482613964425e2;
    double angle = u + u * (z * p / q) + (upper ? quarter : 0.);
    angle = steep ? 2. * quarter - angle : angle;
    out[i] = degrees * (x[i] < 0. ? 4. * quarter - angle : angle);
  }
}

}  // namespace forest::statistics
