// SPDX-License-Identifier: Apache-2.0
// The 5×5 places of a face by which it is compared with the surface that it stands for. Private to this room.
#pragma once

#include <array>

#include <Eigen/Core>

#include "forest/cortex/elements.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {

inline constexpr int face_places_along = 5, face_places = face_places_along * face_places_along;

/// How much each of a face's sixteen places, in the order of slots, weighs at each of the 5×5.
using FaceWeights = Eigen::Matrix<double, face_places, 16>;
const FaceWeights& face_weights();

/// The surface nearest to a place of a face, as a plane.
struct Pin {
  Place normal = Place::Zero();  // of the surface; zero where it is far or the other bank
  double off = 0.;               // µm, along it, from the place to the surface
};
std::array<Pin, face_places> pins_of(const Elements& elements, std::size_t element, std::size_t depth,
                                     const TriangleTree& surface);

}  // namespace forest::cortex
