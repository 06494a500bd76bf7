// SPDX-License-Identifier: Apache-2.0
// Blocks on which generators of grids are tried: shapes after the "rogue's gallery" of Knupp & Steinberg (1993), "Fundamentals of Grid
// Generation", which are hard in one way each, and pieces of cortex. The swan's boundary is theirs; the other shapes are
// drawn by formulas of ours under the names of theirs.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "forest/cortex/grid.h"

namespace forest::cortex {

struct Domain {
  const char* name;
  const char* what;
  bool plane;
  Eigen::Vector3d (*at)(double u, double v, double w);  // right on the boundary, where one of them is 0 or 1
};
std::span<const Domain> domains();
/// Throws Error that lists the names there are.
const Domain& domain(std::string_view name);

/// Its boundary in even steps of the parameters; points inside are 0. @param steps  along each, at least 1
Grid boundary(const Domain& domain, const std::array<int, 3>& steps);

}  // namespace forest::cortex
