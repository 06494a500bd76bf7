// SPDX-License-Identifier: Apache-2.0
// Light and what stands for it in files and on screens (IEC 61966-2-1:1999).
#pragma once

#include <cmath>
#include <concepts>

namespace forest {

/// Of a part of red, green or blue, 0–1, the light.
template <std::floating_point Real>
Real from_srgb(Real part) {
  return part <= Real(.04045) ? part / Real(12.92) : std::pow((part + Real(.055)) / Real(1.055), Real(2.4));
}
/// And back.
template <std::floating_point Real>
Real to_srgb(Real light) {
  return light <= Real(.0031308) ? Real(12.92) * light
                                 : Real(1.055) * std::pow(light, Real(1) / Real(2.4)) - Real(.055);
}

}  // namespace forest
