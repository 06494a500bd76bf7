// SPDX-License-Identifier: Apache-2.0
// From the coordinates of a neuron to those of the world, for spheres.
#pragma once

#include "forest/core/bounds.h"
#include "forest/frame/layout.h"
#include "forest/scene/cluster.h"

namespace forest::scene {

struct Placed {
  Vec3 position;
  Mat3 turn;
  explicit Placed(const frame::Instance& i)
      : position(i.x, i.y, i.z), turn(Quat(i.qw, i.qx, i.qy, i.qz).toRotationMatrix()) {}
  Sphere operator()(const Sphere& s) const { return {position + turn * s.centre, s.radius}; }
  Sphere operator()(const Cluster& c) const { return (*this)(c.sphere()); }
};

}  // namespace forest::scene
