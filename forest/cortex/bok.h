// SPDX-License-Identifier: Apache-2.0
// Bok's principle: layers keep their share of volume as the cortex folds (Bok 1929). Over a crown the outside of a column is wider
// than its inside, so that its upper layers are thin and its deep ones thick; in a fundus it is the other way. How much
// thicker on crowns than in fundi is a number that can be held against measured layers.
//
//     crown   ╲─────────╱  L1 thin           fundus    ╲───╱   L1 thick
//              ╲───────╱                              ╱─────╲
//               ╲_____╱    L6 thick                  ╱_______╲  L6 thin
//
// BigBrain's layers do so where the fold is that of some millimetres, and much less where it is that of single creases: at 6 mm its
// layers have L1 .65 and L6 1.43 times the share of thickness on crowns that they have in fundi, and constant volumes give .64 and
// 1.48; at 1.4 mm .72 and 1.28 stand against .37 and 2.2. Depth by length gives 1 and 1.
#pragma once

#include <span>
#include <vector>

#include "forest/cortex/elements.h"

namespace forest::cortex {

inline constexpr double fold_scale = 6000.;  // µm, at which BigBrain's layers keep their volumes

/// Of every vertex: the logarithm of the area of the outer surface around it over that of the inner one, over about `scale`: above
/// 0 on a crown. Both surfaces have the same triangles.
std::vector<double> folds(std::span<const Place> outer, std::span<const Place> inner,
                          std::span<const Triangle> triangles, double scale = fold_scale);

/// The share of the way inwards at which a share of the volume has been passed, where the cross-section grows evenly with
/// the way; as Waehnert et al. 2014, "Anatomically motivated modeling of cortical laminae".
double way_of_volume(double fold, double volume_share);

/// Mean of the values in the tenth of places that are most like a crown, over that in the tenth most like a fundus; 0 for fewer than
/// ten places.
double crown_over_fundus(std::span<const double> folds, std::span<const double> values);

enum class Depth : std::uint8_t {
  by_volume,
  by_length
};  // by which layers have constant shares (human_layers)

/// How many times the share of thickness that it has in fundi a layer has on crowns.
struct Bok {
  double l1 = 0., l6 = 0.;
};
/// Along the w-curves of an element's middle, as the elements are.
Bok bok(const Elements& elements, Depth depth = Depth::by_volume);
/// By way_of_volume at each vertex.
Bok bok(std::span<const double> folds, Depth depth = Depth::by_volume);

}  // namespace forest::cortex
