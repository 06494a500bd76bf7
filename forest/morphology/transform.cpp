// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/transform.h"

namespace forest {

Vec3 centre(const Morphology& m) {
  if (m.soma().kind != SomaKind::none) return m.soma().sphere().position();
  return m.points().empty() ? Vec3(Vec3::Zero()) : m.points(m.roots()[0])[0].position();
}

Morphology translated(const Morphology& m, const Vec3& by) {
  const auto moved = [&](Point p) {
    p.x += by.x(), p.y += by.y(), p.z += by.z();
    return p;
  };
  MorphologyBuilder builder;
  builder.reserve(m.sections().size(), m.points().size());
  Soma soma = m.soma();
  for (Point& p : soma.points) p = moved(p);
  builder.set_soma(std::move(soma));
  std::vector<Point> points;
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const Section& s = m.sections()[i];
    points.clear();
    for (const Point& p : m.points(SectionId(i))) points.push_back(moved(p));
    builder.add_section(s.parent, s.kind, points, s.tag, s.soma_point);
  }
  for (const Spine& spine : m.spines()) builder.add_spine(spine);
  for (const auto& [key, value] : m.annotations()) builder.annotate(key, value);
  return builder.build();
}

Morphology centred(const Morphology& m) {
  const Vec3 offset = centre(m);
  return offset.norm() <= 1e-3f ? m : translated(m, -offset);
}

}  // namespace forest
