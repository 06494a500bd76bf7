// SPDX-License-Identifier: Apache-2.0
// What can be said of elements and the surfaces they were made of.
#pragma once

#include <cstddef>
#include <optional>

#include "forest/cortex/build.h"

namespace forest::cortex {

/// Of an element's volume, of the one that is wanted.
constexpr double least_volume = .8, most_volume = 1.25;
constexpr bool as_wanted(double volume, double wanted) {
  return volume >= least_volume * wanted && volume <= most_volume * wanted;
}

/// How far places of faces, four of each, are from a surface, µm.
struct FaceDistance {
  double p99 = 0., most = 0.;
  std::size_t farthest = 0;  // the element of `most`
};
/// @param w  0: outer faces, 1: inner ones
FaceDistance face_distance(const Elements& elements, double w, const TriangleTree& surface);

struct Report {
  std::size_t elements = 0, uncertified = 0;
  double volume_error = 0.;   // of elements and wall together, as a share of what lies between the surfaces
  double volume_mean = 0.;    // µm³
  double volume_within = 0.;  // share of elements that are as_wanted
  double equivolume_error = 0.;            // the largest |V(0 → w) / V − w| of any element
  double equivolume_p99 = 0.;              // and of 99 of 100 elements
  double bulge_p99 = 0., bulge_most = 0.;  // layer_bulge, µm
  double jacobian_least = 0.,
         jacobian_p1 = 0.;  // scaled Jacobian: the least of each element over a lattice of places
  std::optional<Spread>
      crest_angle;  // degrees between v-isolines of elements by a crest and the right angle to it; none: no crests
  std::optional<FaceDistance> outer, inner;  // of faces from surfaces; none where these are not given
};

/// @param volume  wanted of an element, µm³
/// @param outer, inner  for the distances; null: they are not measured
Report report(const Cortex& cortex, double volume, const TriangleTree* outer, const TriangleTree* inner,
              Progress& progress);

}  // namespace forest::cortex
