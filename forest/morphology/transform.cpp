// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/transform.h"

#include <numbers>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest {

Vec3 centre(const Morphology& m) {
  if (m.soma().kind != SomaKind::none) return m.soma().sphere().position();
  return m.points().empty() ? Vec3(Vec3::Zero()) : m.points(m.roots()[0])[0].position();
}

namespace {

Point at(const Vec3& position, float radius) { return {position.x(), position.y(), position.z(), radius}; }

/// The same neuron, its points where `moved` says: of the soma (section none) and of the sections, parents first. Heads of
/// spines go where `turned` says.
template <class Moved, class Turned>
Morphology rebuilt(const Morphology& m, Moved&& moved, Turned&& turned) {
  MorphologyBuilder builder;
  builder.reserve(m.sections().size(), m.points().size());
  Soma soma = m.soma();
  for (Point& p : soma.points) p = moved(p, SectionId());
  builder.set_soma(std::move(soma));
  std::vector<Point> points;
  std::vector<Vec3> ends;  // of the sections so far
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const Section& s = m.sections()[i];
    points.clear();
    for (const Point& p : m.points(SectionId(i))) points.push_back(moved(p, SectionId(i)));
    if (s.parent.valid())
      points.front() = at(ends[s.parent.value()], points.front().radius);  // whatever was rounded
    ends.push_back(points.back().position());
    builder.add_section(s.parent, s.kind, points, s.tag, s.soma_point);
  }
  for (Spine spine : m.spines()) {
    spine.head = turned(spine.head, spine.section);
    builder.add_spine(spine);
  }
  for (const auto& [key, value] : m.annotations()) builder.annotate(key, value);
  return builder.build();
}

}  // namespace

Morphology translated(const Morphology& m, const Vec3& by) {
  return rebuilt(
      m,
      [&](Point p, SectionId) {
        p.x += by.x(), p.y += by.y(), p.z += by.z();
        return p;
      },
      [](const Vec3& head, SectionId) { return head; });
}

Morphology stretched(const Morphology& m, const Vec3& factors) {
  const Vec3 origin = centre(m);
  return rebuilt(
      m,
      [&](const Point& p, SectionId) {
        return at(origin + (p.position() - origin).cwiseProduct(factors), p.radius);
      },
      [](const Vec3& head, SectionId) { return head; });
}

Morphology reshaped(const Morphology& m, std::span<const Vec3> places, const Quat& turn) {
  if (places.size() != m.points().size())
    throw Error(
        fmt::format("a neuron of {} points is given places for {}", m.points().size(), places.size()));
  auto next = places.begin();  // points are asked for in their order
  return rebuilt(
      m,
      [&](const Point& p, SectionId s) {
        return at(s.valid() ? *next++ : Vec3(turn * p.position()), p.radius);
      },
      [&](const Vec3& head, SectionId) { return Vec3(turn * head); });
}

Morphology jittered(const Morphology& m, float degrees, std::uint64_t seed, std::uint64_t item) {
  Random random(seed, item, 0x6a697474);  // "jitt"
  struct Turn {
    Quat rotation = Quat::Identity();
    Vec3 shift = Vec3::Zero();
    Vec3 of(const Vec3& p) const { return rotation * p + shift; }
  };
  std::vector<Turn> turns(m.sections().size());
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const SectionId above = m.sections()[i].parent;
    if (!above.valid()) continue;
    turns[i] = turns[above.value()];
    if (m.children(above).size() < 2) continue;
    const auto points = m.points(SectionId(i));
    const Vec3 start = points.front().position(), way = points.back().position() - start;
    const float angle = radians(float(random.normal(0., degrees)));
    const float around = float(random.uniform(0., 2. * std::numbers::pi));
    if (!(way.norm() > 0.f)) continue;
    const Vec3 across = way.unitOrthogonal();
    const Vec3 axis = Quat(Eigen::AngleAxisf(around, way.normalized())) * across;
    // Turned where it stands in the traced neuron, then moved as its parent was.
    const Quat turn(Eigen::AngleAxisf(angle, axis));
    const Quat both = (turns[i].rotation * turn).normalized();
    turns[i] = {both, turns[i].of(start) - both * start};
  }
  return rebuilt(
      m,
      [&](const Point& p, SectionId s) {
        return s.valid() ? at(turns[s.value()].of(p.position()), p.radius) : p;
      },
      [&](const Vec3& head, SectionId s) { return Vec3(turns[s.value()].rotation * head); });
}

Morphology centred(const Morphology& m) {
  const Vec3 offset = centre(m);
  return offset.norm() <= 1e-3f ? m : translated(m, -offset);
}

}  // namespace forest
