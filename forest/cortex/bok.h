// SPDX-License-Identifier: Apache-2.0
// Bok's principle: layers keep their share of volume as the cortex folds (Bok 1929). Over a crown the outside of a column is wider
// than its inside, so that its upper layers are thin and its deep ones thick; in a fundus it is the other way. How much
// thicker on crowns than in fundi is a number that can be held against measured layers.
//
//     crown   ╲─────────╱  L1 thin           fundus    ╲───╱   L1 thick
//              ╲───────╱                              ╱─────╲
//               ╲_____╱    L6 thick                  ╱_______╲  L6 thin
//
// BigBrain's layers do so where the fold is that of some millimetres, and much less where it is that of single creases: seen at
// 6 mm, L1 has .66 and L6 1.42 times the share of thickness on crowns that it has in fundi, and constant volumes give .65 and 1.47;
// at 1.5 mm .72 and 1.28 stand against .37 and 2.21. Depth by length gives 1 and 1.
#pragma once

#include <cstdint>
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

/// Of what layers have constant shares (human_layers): of volume as Bok says, or of length.
enum class Shares : std::uint8_t { of_volume, of_length };

/// How many times the share of thickness that it has in fundi a layer has on crowns.
struct Bok {
  double l1 = 0., l6 = 0.;
};
/// Along the w-curves of an element's middle, as the elements are.
Bok bok(const Elements& elements, Shares shares = Shares::of_volume);
/// By way_of_volume at each vertex.
Bok bok(std::span<const double> folds, Shares shares = Shares::of_volume);

/// Measured thicknesses against constant volumes, at the same vertices.
struct MeasuredBok {
  Bok measured, of_volume;
  std::size_t vertices = 0;  // where layers are measured: the sum of their thicknesses is positive
};
/// @param layers  from the pia inwards, six; of each the thickness at every vertex, in any unit; not a number: not measured
/// Both surfaces have the same triangles.
MeasuredBok bok(std::span<const Place> outer, std::span<const Place> inner,
                std::span<const Triangle> triangles, std::span<const std::vector<float>> layers);

}  // namespace forest::cortex
