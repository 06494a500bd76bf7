// SPDX-License-Identifier: Apache-2.0
// Morphing: a neuron that grew straight is bent as the tissue is in which it stands. A branch is followed through the elements:
// its height above or below the soma becomes w, as the affine map of the soma's element has it, so that what grew in a layer
// stays in that layer and a trunk follows the w-curve; what it goes to the sides keeps its length, along axes that are carried
// with the branch and turned with the tissue (parallel transport). Near the soma nothing changes; where w-curves lean against
// the layers, a branch follows the layers from some tenths of a mm on. No side of an element is favoured, and none is seen: a
// branch that crosses a side face goes on in the neighbour, and never tears, wherever four or five elements meet. What leaves
// the tissue (an axon in white matter) goes on straight; where it comes into tissue again it is bent by that.
//
//      pia  ────────────          ⌒⌒⌒⌒⌒⌒            rigid: x = soma + R p
//            \  |  /              ╲  │  ╱             bent:  dw = ∂w/∂p dp, d(u, v) = J⁻¹ R dp
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

class Locator;

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

/// Elements, what lies beside them, and where they are; all must outlive it. Without junctions each element stands alone; without a
/// locator what left the tissue does not come back.
struct Sheet {
  std::span<const Hexahedron> elements;
  std::span<const Junctions> junctions = {};
  const Locator* locator = nullptr;
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
  /// The neuron that distortion is told against, where it was made shorter before; as many points. None: `points`.
  std::span<const Eigen::Vector3d> traced = {};
};

/// What became of a neuron. Segments lead from a point to its parent; angles are those between a segment and the one before it.
struct Distortion {
  double length = 0., straight_length = 0.;  // µm, all segments, after and before
  double shortest = 1., longest = 1.;        // a segment's length after, over before
  double mean_turn = 0., largest_turn = 0.;  // by which angles changed, degrees
  double beyond_pia = 0.,
         beyond_white =
             0.;  // µm of segments whose end lies where the branch left by the pia, or by the white matter
  double beside = 0.;  // … or by the sheet's rim

  double length_change() const { return straight_length > 0. ? length / straight_length - 1. : 0.; }
};

struct Warped {
  std::vector<Eigen::Vector3d> points;  // µm, in the tissue
  Distortion distortion;
};

/// @param points   µm, the soma at 0, y towards the pia
/// @param parents  one a point, smaller than its own number; -1: it leaves the soma
/// Throws Error that names the first point or parent that is wrong, or the seat.
Warped warp(const Sheet& sheet, const Seat& seat, std::span<const Eigen::Vector3d> points,
            std::span<const std::int32_t> parents, const WarpOptions& options = {});

}  // namespace forest::cortex
