// SPDX-License-Identifier: Apache-2.0
// Closed plane curves of cubic Bézier pieces, and the one of fewest pieces that lies along a polygon. As Schneider (1990, "An
// algorithm for automatically fitting digitized curves", Graphics Gems) does, pieces are fitted by least squares with the
// places of the samples found anew in between. Two things are ours: where pieces begin is the cheapest of all ways around the
// polygon, by dynamic programming; and in the end all pieces of a loop are fitted at once, nodes and tangents with them.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "forest/geometry/plane.h"

namespace forest {

struct Cubic {
  std::array<Place, 4> points;  // where it begins, two controls, where it ends

  Place at(double t) const;          // t in [0, 1]
  Place derivative(double t) const;  // by t
  /// Controls that lie on the ends say that it is a straight line.
  bool straight() const { return points[0] == points[1] && points[2] == points[3]; }
};

/// Closed: three points a piece, where it begins and its two controls; it ends where the next one begins, the last where
/// the first one begins. What lies to its left as one walks along it is inside.
struct BezierLoop {
  std::vector<Place> points;  // µm

  std::size_t pieces() const { return points.size() / 3; }
  Cubic piece(std::size_t i) const;
  bool polygon() const;  // all its pieces are straight

  friend bool operator==(const BezierLoop&, const BezierLoop&) = default;
};

/// The polygon as straight pieces, one an edge. Its last point is joined with its first one.
BezierLoop straight_loop(std::span<const Place> polygon);

/// Corners of a polygon everywhere within `tolerance` (µm, > 0) of the loop; straight pieces give their ends alone.
std::vector<Place> flattened(const BezierLoop& loop, double tolerance);

double length(
    const BezierLoop& loop);  // µm; by Gauss-Legendre quadrature, 1e-6 of it off or less where speed is even
double area(const BezierLoop& loop);  // µm², exactly; negative when the inside is to the right

/// `count` points at equal distances along the loop (1e-6 of its length), the first where the first piece begins.
std::vector<Place> resampled(const BezierLoop& loop, std::size_t count);

/// Where a curve must lie closer than elsewhere: squared distances of what lies within a circle count so many times.
struct Emphasis {
  Place at;
  double within;  // µm
  double times;   // >= 1; where several circles meet, the most
};

struct FitOptions {
  double tolerance = 20.;  // µm: the root mean square of the distances of the polygon from the curve
  double corner =
      .5;  // radians: where pieces that fit by themselves meet at a greater angle, the corner stays
  std::span<const Emphasis> closer = {};
};
struct Fit {
  BezierLoop curve;
  double rms = 0., greatest = 0.;  // µm: distances of points all along the polygon from the curve
  std::size_t samples = 0;         // so many
  std::size_t corners = 0;
};
/// @param polygon  at least three points, not all the same; edges of any lengths
Fit fit_loop(std::span<const Place> polygon, const FitOptions& options = {});

}  // namespace forest
