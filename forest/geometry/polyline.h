// SPDX-License-Identifier: Apache-2.0
// Polylines with a radius at each vertex, and their simplification with a stated error.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/vec.h"

namespace forest {

/// Distance from `point` to the segment a–b.
float distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b);

/// Douglas & Peucker (1973) on vertices (x, y, z, radius): the indices of a subset that keeps both ends, such
/// that no dropped vertex is further than `tolerance` (µm) from the simplified line, and no radius differs by
/// more.
std::vector<std::uint32_t> simplify(std::span<const Vec4> vertices, float tolerance);

}  // namespace forest
