// SPDX-License-Identifier: Apache-2.0
// The soma of a simulator: where a neurite hangs on it, and a sphere where there are cylinders only.
#pragma once

#include <array>
#include <cstdint>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// The soma point a root hangs on: an index in Soma::points, 0 unless the soma is of cylinders; -1 where it stays apart.
/// A root whose place is not known stays apart where other roots know theirs; where none does (another format, a grown
/// neuron), it hangs on the nearest soma point if it begins within three radii of the soma.
class SomaPlaces {
 public:
  explicit SomaPlaces(const Morphology& m);
  std::int32_t operator()(SectionId root) const;

 private:
  const Morphology& m_;
  bool known_ = false;  // of some root
};

/// A sphere as a cylinder of its area, as long as wide: its lower end, its middle, its upper end (along y). Where the floats
/// of its place are too coarse for that length, the width makes up for it.
std::array<Point, 3> cylinder_of(const Point& sphere);

}  // namespace forest::io
