// SPDX-License-Identifier: Apache-2.0
// One closed surface around many round cones: their union as a signed distance, rounded where branches meet, cut out of
// a lattice of tetrahedra (Doi & Koide 1991, "An efficient method of triangulating equi-valued surfaces by using
// tetrahedral cells"). The lattice is body-centred cubic, whose tetrahedra are all alike and nearly regular; only blocks
// of it that the surface may touch are looked at.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "forest/core/bounds.h"
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

/// A lattice that stays where it is, so that a surface can be made in pieces, one when it is needed: pieces side by side
/// meet in the same vertices, bit for bit. A piece is a cell of 64 × 64 × 64 lattice points (a parallelepiped); with half
/// the voxel and the same origin there are eight in its place.
struct PieceLattice {
  using Cell = std::array<std::int64_t, 3>;

  Vec3 origin;  // µm; everything lies beyond it in all of Y + Z, X + Z and X + Y, by `margin` or more
  float voxel;  // µm, as for `polygonise`

  static constexpr float margin_voxels = 64.f;
  float margin() const { return margin_voxels * voxel; }
  /// The sphere around a cell.
  Sphere around(const Cell& cell) const;
  /// The cells of all that may come within a box: [first, last].
  std::pair<Cell, Cell> cells(const Bounds& box) const;
};

struct Piece {
  Mesh mesh;  // those triangles that the cell owns
  std::vector<Vec3>
      normals;  // of the vertices: which way the distance grows; they are the same in all pieces
  std::vector<std::uint32_t> cones;  // of the vertices: the nearest cone
};

/// @param cones  all that come within piece_band voxels and the joints' rounding of the cell, in the same order for all pieces;
///               others do no harm
/// @param joints  the same, within their reach
Piece polygonise_piece(const std::vector<BranchCone>& cones, const std::vector<Joint>& joints,
                       const PieceLattice& lattice, const PieceLattice::Cell& cell);
inline constexpr float piece_band = 10.f;

}  // namespace forest
