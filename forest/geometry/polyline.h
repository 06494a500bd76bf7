// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "forest/core/vec.h"

namespace forest {

/// Distance from `point` to the segment a–b.
float distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b);

}  // namespace forest
