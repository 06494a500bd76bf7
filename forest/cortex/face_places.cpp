// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/face_places.h"

#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

constexpr double parameter(int i) { return (i + .5) / face_places_along; }

Place place_of(const Patch& patch, int k) {
  return patch.at(parameter(k % face_places_along), parameter(k / face_places_along));
}

}  // namespace

const FaceWeights& face_weights() {
  static const FaceWeights weights = [] {
    FaceWeights result;
    for (std::size_t c = 0; c < 16; ++c) {
      std::array<Place, 16> one;
      one.fill(Place::Zero());
      one[c] = Place::UnitX();
      const Patch patch = through_lattice(one);
      for (int k = 0; k < face_places; ++k) result(k, Eigen::Index(c)) = place_of(patch, k).x();
    }
    return result;
  }();
  return weights;
}

std::array<Pin, face_places> pins_of(const Elements& elements, std::size_t element, std::size_t depth,
                                     const TriangleTree& surface) {
  constexpr double reach = 300.;  // µm
  const Patch patch = face_of(elements, element, depth);
  const Depths& middle = elements.curves[elements.elements[element][slot(1, 1)]];
  const Place outwards = middle[0] - middle[3];
  std::array<Pin, face_places> pins;
  for (int k = 0; k < face_places; ++k) {
    Pin& pin = pins[std::size_t(k)];
    const Place at = place_of(patch, k);
    const auto hit = surface.nearest(at, reach);
    if (!hit) continue;
    const Place n = surface.normal(hit->triangle);
    if (n.dot(outwards) > 0.) pin.normal = n, pin.off = n.dot(hit->at - at);
  }
  return pins;
}

}  // namespace forest::cortex
