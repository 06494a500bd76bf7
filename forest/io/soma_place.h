// SPDX-License-Identifier: Apache-2.0
// Where a neurite hangs on the soma, for formats that must say it.
#pragma once

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

}  // namespace forest::io
