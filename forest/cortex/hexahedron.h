// SPDX-License-Identifier: Apache-2.0
// The tricubic Bézier hexahedron: a piece of cortex, or a block of a grid, with curved faces. Its place at (u, v, w) in
// [0, 1]³ is the sum of 4×4×4 control points weighted by products of Bernstein polynomials.
//
//         u ──►        w = 0, the outer surface (pia)      u, v and w are right-handed and w points inwards: seen
//       ╭───────╮                                          from outside, u turns to v clockwise. So a valid element
//     v │       │╲     w = 1, the inner surface            has det J > 0, where the columns of J are ∂x/∂u, ∂x/∂v
//     ▼ ╰───────╯ ╲ w  (white matter)                      and ∂x/∂w.
//        ╲_______╲▼
//
// Whether it is valid is decided, not sampled: det J is a polynomial of degree (8, 8, 8), whose 9×9×9 Bernstein coefficients
// bound it on the whole element, and on the halves of it that de Casteljau's algorithm makes, ever more tightly (Johnen,
// Remacle & Geuzaine 2013, "Geometrical validity of curvilinear finite elements", J Comput Phys 233:359).
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

namespace forest::cortex {

/// A face of a hexahedron: where one parameter is 0 or 1. `axis(face)` is that parameter.
enum class Face : unsigned char { u0, u1, v0, v1, w0, w1 };
inline constexpr std::array all_faces{Face::u0, Face::u1, Face::v0, Face::v1, Face::w0, Face::w1};
constexpr int axis(Face face) { return int(face) / 2; }
constexpr bool is_far(Face face) { return int(face) % 2 == 1; }  // parameter 1

/// A bicubic Bézier patch.
struct Patch {
  std::array<Eigen::Vector3d, 16> points;  // µm; the first parameter runs fastest

  Eigen::Vector3d at(double s, double t) const;
};

struct Hexahedron {
  std::array<Eigen::Vector3d, 64>
      points;  // control points, µm; i of u runs fastest, then j of v, then k of w

  static constexpr std::size_t index(int i, int j, int k) {
    return std::size_t(i) + 4 * (std::size_t(j) + 4 * std::size_t(k));
  }
  const Eigen::Vector3d& point(int i, int j, int k) const { return points[index(i, j, k)]; }
  Eigen::Vector3d& point(int i, int j, int k) { return points[index(i, j, k)]; }
  /// c = 0…7: bit 0 is u, bit 1 is v, bit 2 is w.
  const Eigen::Vector3d& corner(int c) const { return point(c & 1 ? 3 : 0, c & 2 ? 3 : 0, c & 4 ? 3 : 0); }

  Eigen::Vector3d at(double u, double v, double w) const;
  Eigen::Vector3d at(const Eigen::Vector3d& uvw) const { return at(uvw[0], uvw[1], uvw[2]); }
  Eigen::Matrix3d jacobian(double u, double v, double w) const;  // columns ∂/∂u, ∂/∂v, ∂/∂w, µm
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& uvw) const { return jacobian(uvw[0], uvw[1], uvw[2]); }

  /// µm³, of the part between two values of w: the integral of det J, exact but for rounding (det J is of degree 8 in each
  /// parameter, for which five points of Gauss and Legendre suffice). What is turned inside out counts negative.
  double volume(double from_w = 0., double to_w = 1.) const;

  /// The face's two parameters are the remaining two, in the order u, v, w: that of Face::v0 is (u, w).
  Patch face(Face face) const;
};

/// The place and the Jacobian at once.
struct Linear {
  Eigen::Vector3d at;
  Eigen::Matrix3d jacobian;
};
Linear linear(const Hexahedron& hexahedron, const Eigen::Vector3d& uvw);

/// µm along the line of constant u and v from the outer face (w = 0) to a place, by five places of Gauss and Legendre.
double below_outer_face(const Hexahedron& hexahedron, const Eigen::Vector3d& uvw);

/// The least of det J / (|∂x/∂u| |∂x/∂v| |∂x/∂w|) at (steps + 1)³ places: 1 where the parameters are at right angles everywhere,
/// at or below 0 where the element is not valid. A measure, no proof: that is certify.
double scaled_jacobian(const Hexahedron& hexahedron, int steps = 4);

/// The element that goes through the 4×4×4 places at parameters 0, 1/3, 2/3 and 1, in the order of control points. A face's
/// control points depend on the places of that face alone and on nothing else, bit for bit: neighbours that have the same
/// places on it, with parameters that run alike, share it exactly.
Hexahedron through_lattice(const std::array<Eigen::Vector3d, 64>& places);
Patch through_lattice(const std::array<Eigen::Vector3d, 16>& places);
/// The straight-edged one of eight corners, in the order of Hexahedron::corner.
Hexahedron from_corners(const std::array<Eigen::Vector3d, 8>& corners);

/// Both halves of an element, cut where the parameter of an axis (0 u, 1 v, 2 w) has the given value.
std::array<Hexahedron, 2> split(const Hexahedron& hexahedron, int axis, double at = .5);

/// A polynomial on [0, 1]³ of degree 8 in each parameter by its Bernstein coefficients, the one of u running fastest. Its values lie
/// between the least and the largest of them; coefficients at corners are values.
using Coefficients = std::array<double, 729>;
/// Those of det J, µm³. @param margin  if given, no coefficient is further than this from the exact one
Coefficients determinant(const Hexahedron& hexahedron, double* margin = nullptr);

struct Certificate {
  enum class Verdict : unsigned char {
    positive,      // proven, rounding included: det J > 0 on all of the closed element
    not_positive,  // det J is at or below 0 at `where`, or so near to it that rounding hides its sign
    undecided,     // after all halvings det J may still be at or below 0 near `where`
  };
  Verdict verdict = Verdict::undecided;
  double least =
      0.;  // µm³: positive and undecided: no value of det J is lower; not_positive: its value there
  Eigen::Vector3d where = Eigen::Vector3d::Zero();  // (u, v, w): where that bound comes from, or the value

  bool positive() const { return verdict == Verdict::positive; }
};

/// Decides the sign of det J. A box whose coefficients are not all positive is halved along the parameter along which they
/// change most, up to `halvings` times. Control points that are not finite are not_positive.
Certificate certify(const Hexahedron& hexahedron, int halvings = 15);

}  // namespace forest::cortex
