// SPDX-License-Identifier: Apache-2.0
// What a plane cuts of a tapered capsule: a convex region, bounded by arcs of the two end spheres and between them by a
// conic. A cylinder cut obliquely gives an ellipse, a sphere a disc, a cone cut along itself a piece of a hyperbola.
//
// The capsule is the union of the spheres along its axis. A plane at height h above the axis' point cuts a sphere of radius
// r in a disc of radius √(r² - h²); r and h change evenly along the axis, so the squared radius is a quadratic, and the
// envelope of the discs, which move evenly along the axis as it is seen on the plane, is a conic.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forest/core/vec.h"
#include "forest/geometry/plane.h"
#include "forest/geometry/round_cone.h"

namespace forest {

class CrossSection {
 public:
  /// None when the plane does not cut it, or only touches it.
  static std::optional<CrossSection> of(const RoundConed& cone, const Plane& plane);

  /// µm²; by Gauss-Legendre quadrature of each piece, 1e-9 of it off at most.
  double area() const;
  /// Anticlockwise, convex, all vertices on the contour; everywhere within `tolerance` (µm) of it, and within `share` of its
  /// width or height, whichever is less. With the least of either the polygon's area is at most .05 % less than the region's.
  std::vector<Place> outline(double tolerance = 1e-3, double share = 1.5e-4) const;

 private:
  // Half the width across the axis of symmetry, squared, between two places along it: k0 + k1 x + k2 x².
  struct Piece {
    double from, to, k0, k1, k2;
    double half_width(double x) const;
  };
  std::vector<Piece> pieces_;  // from left to right, one to three
  Place origin_{0., 0.}, along_{1., 0.};
};

/// Area of the union of convex polygons (anticlockwise), µm². A pure function of their boundaries: of each edge what lies in
/// no other polygon, by Green's theorem.
double area_of_union(std::span<const std::vector<Place>> polygons);

/// Those parts of the edges: what bounds the union. Each with its inside to the left.
std::vector<std::pair<Place, Place>> boundary_of_union(std::span<const std::vector<Place>> polygons);

}  // namespace forest
