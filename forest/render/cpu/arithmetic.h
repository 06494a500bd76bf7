// SPDX-License-Identifier: Apache-2.0
// Functions of single numbers without branches, so that loops over them become vector instructions.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "forest/core/clones.h"

namespace forest::render::cpu {

// As single instructions, which std::min and std::fmin are not within loops.
[[gnu::always_inline]] inline float smaller(float a, float b) { return a < b ? a : b; }
[[gnu::always_inline]] inline float larger(float a, float b) { return a > b ? a : b; }

/// Logarithm to base 2 of a normal positive number; 1e-7 off at most. Of 2 atanh(t) / ln 2 with t = (m - 1) / (m + 1), the
/// terms to t⁷, m within √½ … √2.
[[gnu::always_inline]] inline float log2_of(float x) {
  constexpr std::int32_t root_half = 0x3f3504f3;
  const std::int32_t above = std::bit_cast<std::int32_t>(x) - root_half;
  const float exponent = float(above >> 23);
  const float m = std::bit_cast<float>((above & 0x7fffff) + root_half);
  const float t = (m - 1.f) / (m + 1.f), t2 = t * t;
  return exponent + t * (2.88539008f + t2 * (.96179669f + t2 * (.57707802f + t2 * .41219859f)));
}

/// 2 to the power x, for -126 <= x < 127; 1e-4 of it off at most. The minimax polynomial on [0, 1] times a power of two.
[[gnu::always_inline]] inline float roughly_exp2_of(float x) {
  const float whole = std::floor(x), f = x - whole;
  const float power = .99992522f + f * (.69583356f + f * (.22606716f + f * .07802412f));
  return power * std::bit_cast<float>((std::int32_t(whole) + 127) << 23);
}

[[gnu::always_inline]] inline float fraction(float x) { return x - std::floor(x); }

inline constexpr float golden = .61803399f;

/// Interleaved gradient noise (Jimenez 2014), moved by the subframe.
[[gnu::always_inline]] inline float noise_at(std::int32_t x, std::int32_t y, std::uint32_t subframe) {
  return fraction(52.9829189f * fraction(.06711056f * float(x) + .00583715f * float(y)) +
                  golden * float(subframe));
}

}  // namespace forest::render::cpu
