// SPDX-License-Identifier: Apache-2.0
// w-curves: the field lines of a cortex, dropped from the outer surface along the axis of its pyramidal cells to the inner
// one, and how deep a place on one is. A field on a lattice does not see how surfaces turn between two nodes, in the floors of
// sulci above all: near a surface curves leave the field's way for the line that meets the surface at right angles, and all do
// so the same way, so that none cross.
//
// Two measures of depth, both 0 on the outer surface and 1 on the inner one: the share of the curve's length (equidistant),
// and the share of the volume of the thin tube around it (equivolumetric, after Bok 1929: layers keep their share of volume
// as the cortex folds). The flux of the field through such a tube is the same everywhere, so its cross-section is
// proportional to 1/|slope|, and its volume to the integral of that along the curve.
#pragma once

#include <optional>
#include <vector>

#include "forest/cortex/boundary.h"
#include "forest/cortex/laplace.h"

namespace forest::cortex {

struct WCurve {
  std::vector<Place> points;  // from the outer surface to the inner one, at least two
  std::vector<double>
      volume;  // µm: the tube's up to each point for a cross-section of 1 where the slope is 1/µm
  std::uint32_t triangle = 0;  // of the inner surface, on which it ends
  bool arrived =
      false;  // without it the last piece is the straight way to the nearest place of the inner surface

  double length() const;  // µm
  /// By share of volume (or of length), w in [0, 1].
  Place at(double w) const;
  Place at_length(double share) const;
};

/// Both surfaces of a cortex, on which places are looked up.
struct SurfaceTrees {
  const TriangleTree &outer, &inner;

  /// Where curves with four places have their first and their last.
  const TriangleTree& at(std::size_t depth) const { return depth == 0 ? outer : inner; }
};

/// Between the last .15 mm of a curve and the surfaces' normals where it ends, degrees.
struct EndAngles {
  double outer = 0., inner = 0.;
};
EndAngles end_angles(const WCurve& curve, const SurfaceTrees& surfaces);

/// Drops curves; the field and the surfaces must outlive it.
class WCurves {
 public:
  WCurves(const Laplace& field, const Boundary& outer, const Boundary& inner)
      : field_(field), outer_(outer), inner_(inner) {}

  /// @param start   on the outer surface
  /// @param inward  roughly into the tissue
  WCurve drop(const Place& start, const Place& inward) const;
  /// The curve through a place between the surfaces, followed both ways: where curves fan out from a crease of the outer surface, one
  /// of them is told by a place on its way much better than by its start. Arrived: at both surfaces.
  /// None where the field has no slope.
  std::optional<WCurve> through(const Place& place, const Place& inward) const;
  /// To the nearest place of the inner surface, µm.
  double straight_way(const Place& from) const;

 private:
  struct Way;
  struct Slope;
  std::optional<Slope> slope(const Place& at, const Place& heading) const;
  Way follow(const Place& start, const Place& heading, bool upwards) const;

  const Laplace& field_;
  const Boundary &outer_, &inner_;
};

}  // namespace forest::cortex
