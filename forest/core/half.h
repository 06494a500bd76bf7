// SPDX-License-Identifier: Apache-2.0
// Radii as the forest file and graphics cards store them.
#pragma once

#include <bit>
#include <cstdint>

namespace forest {

/// The half-precision number in the low 16 bits, when it is neither negative nor infinite. Without branches, so that loops
/// over it become vector instructions.
[[gnu::always_inline]] inline float from_half(std::uint32_t bits) {
  return std::bit_cast<float>((bits & 0x7fff) << 13) * 0x1p112f;
}

/// The half-precision number nearest to a value, in the low 16 bits.
std::uint32_t to_half(float value);

}  // namespace forest
