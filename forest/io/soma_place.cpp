// SPDX-License-Identifier: Apache-2.0
#include "forest/io/soma_place.h"

#include <algorithm>

#include "forest/io/keeps.h"
#include "forest/morphology/measure.h"

namespace forest::io {

SomaPlaces::SomaPlaces(const Morphology& m) : m_(m) {
  for (const SectionId root : m.roots()) known_ = known_ || m.section(root).soma_point >= 0;
}

std::int32_t SomaPlaces::operator()(SectionId root) const {
  const Soma& soma = m_.soma();
  if (soma.kind == SomaKind::none) return -1;
  const bool many = soma.kind == SomaKind::cylinders;
  const std::int32_t place = m_.section(root).soma_point;
  if (place >= 0) return many ? std::min(place, std::int32_t(soma.points.size()) - 1) : 0;
  if (known_) return -1;
  const Point sphere = soma.sphere(), begin = m_.points(root).front();
  if (segment_length(sphere, begin) > 3. * double(sphere.radius) + double(begin.radius)) return -1;
  if (!many) return 0;
  const auto nearest =
      std::ranges::min_element(soma.points, {}, [&](const Point& p) { return segment_length(p, begin); });
  return std::int32_t(nearest - soma.points.begin());
}

std::array<Point, 3> cylinder_of(const Point& sphere) {
  Point low = sphere, high = sphere;
  low.y -= sphere.radius, high.y += sphere.radius;
  if (segment_length(low, high) < .99e-6) high = next_place(low);
  const double length = segment_length(low, high);
  const float radius = float(2. * double(sphere.radius) * double(sphere.radius) / length);
  low.radius = high.radius = radius;
  return {low, {sphere.x, sphere.y, sphere.z, radius}, high};
}

}  // namespace forest::io
