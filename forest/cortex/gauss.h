// SPDX-License-Identifier: Apache-2.0
// Five places and weights of Gauss and Legendre: exact for polynomials of degree 9, as det J of an element is of degree 8 in each
// parameter.
#pragma once

#include <array>
#include <cmath>

namespace forest::cortex {

/// On [-1, 1]; the weights sum to 2.
struct GaussRule {
  static constexpr std::size_t size = 5;
  std::array<double, size> at, weight;
};

inline const GaussRule& gauss_rule() {
  static const GaussRule rule = [] {
    const double inner = std::sqrt(5. - 2. * std::sqrt(10. / 7.)) / 3.,
                 outer = std::sqrt(5. + 2. * std::sqrt(10. / 7.)) / 3.;
    const double near = (322. + 13. * std::sqrt(70.)) / 900., far = (322. - 13. * std::sqrt(70.)) / 900.;
    return GaussRule{{-outer, -inner, 0., inner, outer}, {far, near, 128. / 225., near, far}};
  }();
  return rule;
}

}  // namespace forest::cortex
