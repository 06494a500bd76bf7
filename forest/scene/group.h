// SPDX-License-Identifier: Apache-2.0
// Spheres around some segments of a larger sphere, in four bytes.
#pragma once

#include <cstdint>

#include "forest/core/bounds.h"

namespace forest::scene {

/// The centre from that of the larger sphere, a signed byte a coordinate in 127ths of its radius, and the radius, a byte in
/// 127ths: never smaller than the sphere given.
std::uint32_t packed_group(const Sphere& group, const Sphere& larger);

inline Sphere unpacked_group(std::uint32_t bits, const Sphere& larger) {
  const float unit = larger.radius / 127.f;
  const auto at = [&](int shift) { return float(std::int8_t(bits >> shift & 255)) * unit; };
  return {larger.centre + Vec3(at(0), at(8), at(16)), float(bits >> 24) * unit};
}

}  // namespace forest::scene
