// SPDX-License-Identifier: Apache-2.0
#include "forest/core/half.h"

#include <Eigen/Core>

namespace forest {

std::uint32_t to_half(float value) { return Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(value)); }

}  // namespace forest
