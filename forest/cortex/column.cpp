// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/column.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "forest/core/error.h"

namespace forest::cortex {

Column::Column(float radius, std::span<const Layer> layers) : radius_(radius) {
  const auto positive = [](float length) { return std::isfinite(length) && length > 0.f; };
  if (!positive(radius)) throw Error("the radius of a column must be a positive number of µm");
  if (layers.empty()) throw Error("a column needs at least one layer");
  // Summed upwards in double precision from the white matter, so that neighbours share a limit to the last
  // bit.
  layers_.resize(layers.size());
  double y = 0.;
  for (std::size_t i = layers.size(); i-- > 0;) {
    if (!positive(layers[i].thickness))
      throw Error("the thickness of layer " + layers[i].name + " must be a positive number of µm");
    layers_[i] = {.name = layers[i].name, .bottom = float(y), .top = float(y + double(layers[i].thickness))};
    y += double(layers[i].thickness);
  }
}

Bounds Column::bounds() const {
  return {.low = {-radius_, 0.f, -radius_}, .high = {radius_, height(), radius_}};
}

double Column::volume(std::size_t layer) const {
  const double r = double(radius_);
  return std::numbers::pi * r * r * double(layers_[layer].thickness());
}

Vec3 Column::sample(std::size_t layer, Random& random) const {
  const Slab& slab = layers_[layer];
  // The area within a distance grows with its square, hence the root.
  const double distance = double(radius_) * std::sqrt(random.uniform());
  const double angle = random.uniform(0., 2. * std::numbers::pi);
  const double y = random.uniform(double(slab.bottom), double(slab.top));
  // Rounding to float may step over a limit by one unit in the last place.
  const Vec3 point(float(distance * std::cos(angle)), std::clamp(float(y), slab.bottom, slab.top),
                   float(distance * std::sin(angle)));
  return point;
}

bool Column::contains(std::size_t layer, const Vec3& point) const {
  const Slab& slab = layers_[layer];
  return point.y() >= slab.bottom && point.y() <= slab.top &&
         std::hypot(point.x(), point.z()) <= radius_ * (1.f + 1e-6f);
}

}  // namespace forest::cortex
