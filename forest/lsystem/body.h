// SPDX-License-Identifier: Apache-2.0
// What the lines that the turtle draws are given besides their axis: diameters such as a tracer sets, spines, and a soma that is
// not round. Private to this room.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "forest/core/random.h"
#include "forest/lsystem/sample.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

/// Which diameters traced branches have.
struct Gauge {
  std::span<const Trace::Stop> stops;  // rising; empty: any
  double even = 0.;                    // 0 to 1
  double gap = 0.;                     // the least between two of them
  double points = 0.;                  // that have one of them

  Gauge() = default;
  Gauge(std::span<const Trace::Stop> of, double share);

  /// The nearest of them. Beyond the thickest, as far apart as the nearest two are.
  double nearest(double diameter) const;
  /// That which is as thick as a share of all.
  double at_share(double share) const;
};

/// Spines, at random along all that is drawn under them.
struct Spines {
  double density = 0., reach = 0., head = 0., neck = 0., spread = 0.;
  Random random{0, 0, 0};
  double left = 0.;  // µm to the next

  Spines() = default;
  /// @param told  as Spiny is told
  explicit Spines(const std::array<double, 6>& told)
      : density(told[0]),
        reach(told[1]),
        head(told[2]),
        neck(told[3]),
        spread(told[4]),
        random(std::bit_cast<std::uint64_t>(told[5]), 0, 0x73706e73),  // "spns"
        left(gap()) {}
  double gap() { return random.exponential(1. / density); }

  /// Those on the segment between two points, whose first lies `along` the section, µm.
  void stand(MorphologyBuilder& builder, SectionId section, const Point& from, const Point& to, double along);
};

/// A soma of this middle and mean radius whose outline, seen along z, is that radius times 1 + a2 cos 2φ + b2 sin 2φ + a3 cos 3φ +
/// b3 sin 3φ, φ from +x to +y, as 24 points, to a nanometre.
Soma outlined_soma(const Point& middle, const std::array<double, 4>& outline);

}  // namespace forest::lsystem
