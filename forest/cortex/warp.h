// SPDX-License-Identifier: Apache-2.0
// Morphing: a neuron that grew straight is bent as the tissue is in which it stands. The places of its points are taken as
// (u, v, w) of a straight block, the element's own affine map at the soma, so that near the soma nothing changes; the curved
// element gives each its place. A branch that crosses a side face goes on in the neighbour's (u, v, w), with the same speed across
// the face: it never tears, wherever four or five elements meet.
//
//      pia  ────────────          ⌒⌒⌒⌒⌒⌒            rigid: x = soma + R p
//            \  |  /              ╲  │  ╱             bent:  x = element(uvw of the soma + J⁻¹ R p)
//             \ | /     ──►        ╲ │ ╱              R turns the neuron's y axis to where −∂x/∂w points
//               ●                    ●
//      ────────────────           ⌒⌒⌒⌒
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

/// What lies beyond a side face: which element, by which of its faces, and whether the parameter along the face (u or v;
/// w is the same on both sides) runs the other way there.
struct Junction {
  static constexpr std::uint32_t nothing = ~std::uint32_t(0);
  std::uint32_t element = nothing;
  Face face = Face::u0;
  bool reversed = false;

  bool operator==(const Junction&) const = default;
};
using Junctions = std::array<Junction, 4>;  // of the faces u0, u1, v0, v1

/// Faces that have the same four corners, bit for bit, with pia to pia. Throws Error that names the first element of which a face has
/// more than one other beyond it.
std::vector<Junctions> junctions(std::span<const Hexahedron> elements);

/// Elements and what lies beside them; both must outlive it. Without junctions each element stands alone.
struct Sheet {
  std::span<const Hexahedron> elements;
  std::span<const Junctions> junctions = {};
};

/// Where a soma sits.
struct Seat {
  std::uint32_t element = 0;
  Eigen::Vector3d uvw = Eigen::Vector3d::Constant(.5);
  double turn = 0.;  // radians, about the neuron's y axis; at 0 its x axis points along ∂x/∂u
};

/// R: the columns are the neuron's x, y, z axes in the tissue; y points along −∂x/∂w, towards the pia.
Eigen::Matrix3d axes(const Sheet& sheet, const Seat& seat);
Eigen::Matrix3d axes(const Eigen::Matrix3d& jacobian, double turn);  // of the element, at the soma

struct WarpOptions {
  bool rigid = false;
  bool below_pia = false;  // bent: what would pass the pia lies on it
};

/// What became of a neuron. Segments lead from a point to its parent; angles are those between a segment and the one before it.
struct Distortion {
  double length = 0., straight_length = 0.;   // µm, all segments, after and before
  double shortest = 1., longest = 1.;         // a segment's length after, over before
  double mean_turn = 0., largest_turn = 0.;   // by which angles changed, degrees
  double beyond_pia = 0., beyond_white = 0.;  // µm of segments whose end lies at w < 0, or w > 1
  double beside = 0.;                         // µm of those that left the sheet at its rim

  double length_change() const { return straight_length > 0. ? length / straight_length - 1. : 0.; }
};

struct Warped {
  std::vector<Eigen::Vector3d> points;  // µm, in the tissue
  Distortion distortion;
};

/// @param points   µm, the soma at 0, y towards the pia
/// @param parents  one a point, smaller than its own number; -1: it leaves the soma
/// What leaves the sheet at its rim, or passes pia or white matter, goes on straight. Throws Error that names the first point or parent
/// that is wrong, or the seat.
Warped warp(const Sheet& sheet, const Seat& seat, std::span<const Eigen::Vector3d> points,
            std::span<const std::int32_t> parents, const WarpOptions& options = {});

}  // namespace forest::cortex
