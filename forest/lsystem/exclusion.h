// SPDX-License-Identifier: Apache-2.0
// Where a neurite cannot grow: through somata and above the pia. A step that would enter is turned by the least angle that
// keeps it out, so that a neurite slides along what it meets, as growth cones do along what they cannot enter. Where
// several obstacles leave no such turn other directions are tried, then shorter steps; where nothing is free nothing grows.
#pragma once

#include <vector>

#include "forest/core/vec.h"

namespace forest::lsystem {

struct Obstacles {
  struct Ball {
    Eigen::Vector3d centre;
    double radius;  // µm, with what is kept free around it and the thickness of the neurite
  };
  std::vector<Ball> balls;
  double ceiling = 1e300;  // nothing grows above this y
};

/// A step that enters no obstacle, as long as the one that was wanted or an eighth, a quarter or half of that; or zero. A
/// step from inside of an obstacle may lead out of it or along, not deeper.
/// @param side  a unit vector not along the step: to which side it turns when it meets an obstacle head on
Eigen::Vector3d clear_step(const Eigen::Vector3d& from, const Eigen::Vector3d& step,
                           const Eigen::Vector3d& side, const Obstacles& obstacles);

}  // namespace forest::lsystem
