// SPDX-License-Identifier: Apache-2.0
// One closed surface around many round cones: their union as a signed distance, rounded where branches meet, cut out of
// a lattice of tetrahedra (Doi & Koide 1991, "An efficient method of triangulating equi-valued surfaces by using
// tetrahedral cells"). The lattice is body-centred cubic, whose tetrahedra are all alike and nearly regular; only blocks
// of it that the surface may touch are looked at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "forest/geometry/mesh.h"
#include "forest/geometry/round_cone.h"

namespace forest {

/// A round cone of a branch. Within one branch cones join as they are.
struct BranchCone {
  RoundCone shape;
  std::uint32_t branch = 0;
  std::uint8_t label = 0;  // of the vertices nearest to it
};

/// Where branches meet. Around it, out to `reach`, their union is smooth: with the polynomial minimum of Quilez
/// (iquilezles.org/articles/smin), `rounding` wide at the centre and 0 at the rim.
struct Joint {
  Vec3 centre;
  float reach = 0.f, rounding = 0.f;  // µm
  std::vector<std::uint32_t> branches;
};

inline constexpr std::size_t most_triangles = 20'000'000;

/// How many triangles `polygonise` makes about, if nothing were hidden within other cones.
double expected_triangles(const std::vector<BranchCone>& cones, float voxel);

/// @param voxel  µm, > 0: the longer of the lattice's two edges. Branches of a radius below 0.75 of it may break.
/// Closed, whatever the cones; the same bytes at any number of threads. Throws LimitError when more than
/// `most_triangles` are expected, or the cones span more than 2^23 voxels.
Mesh polygonise(const std::vector<BranchCone>& cones, const std::vector<Joint>& joints, float voxel);

}  // namespace forest
