// SPDX-License-Identifier: Apache-2.0
// The cylindrical column: the simplest piece of cortex that has layers. Its axis is y, which is 0 at the
// white matter and grows towards the pia; its layers are flat slabs, given from the pia downwards as
// anatomists list them.
//
//        ╭───────╮ ── height()
//        │  L1   │                Real cortex is curved; a column stands for a piece small enough
//        ├───────┤ ── layer bottom   (a few hundred µm across) to be taken as flat.
//        │  L2   │
//        ╰───────╯ ── 0
//         ◄──┼──►  radius()
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/core/random.h"
#include "forest/core/vec.h"

namespace forest::cortex {

/// A layer as a flat slab.
struct Slab {
  std::string name;               // "L4"
  float bottom = 0.f, top = 0.f;  // y of its limits, µm

  float thickness() const { return top - bottom; }  // µm
  bool operator==(const Slab&) const = default;
};

class Column {
 public:
  struct Layer {
    std::string name;
    float thickness = 0.f;  // µm, > 0
  };

  /// @param radius  µm, > 0
  /// @param layers  from the pia downwards, at least one
  /// Throws Error that names the layer whose thickness is not a positive number.
  Column(float radius, std::span<const Layer> layers);

  float radius() const { return radius_; }
  float height() const { return layers_.front().top; }  // µm, from the white matter to the pia
  std::span<const Slab> layers() const { return layers_; }
  Bounds bounds() const;

  double volume(std::size_t layer) const;  // µm³

  /// A point uniform in the volume of a layer. Three numbers are drawn.
  Vec3 sample(std::size_t layer, Random& random) const;

  bool contains(std::size_t layer, const Vec3& point) const;

 private:
  float radius_;
  std::vector<Slab> layers_;
};

}  // namespace forest::cortex
