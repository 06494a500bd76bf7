// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/morphology.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"

namespace forest {
namespace {

constexpr std::array<std::pair<SectionKind, std::string_view>, 7> kind_names{{
    {SectionKind::undefined, "undefined"},
    {SectionKind::axon, "axon"},
    {SectionKind::basal, "basal"},
    {SectionKind::apical, "apical"},
    {SectionKind::custom, "custom"},
    {SectionKind::unspecified, "unspecified"},
    {SectionKind::glia, "glia"},
}};

bool finite(const Point& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.radius);
}

bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

void check_points(std::span<const Point> points, std::string_view owner) {
  for (const Point& p : points)
    if (!finite(p) || p.radius < 0.f)
      throw Error(fmt::format(
          "a point of {} is ({}, {}, {}) with radius {}; coordinates must be finite and radii not negative",
          owner, p.x, p.y, p.z, p.radius));
}

}  // namespace

std::string_view name_of(SectionKind kind) {
  const auto row = std::ranges::find(kind_names, kind, &decltype(kind_names)::value_type::first);
  return row == kind_names.end() ? "custom" : row->second;
}

SectionKind section_kind(std::string_view name) {
  const auto row = std::ranges::find(kind_names, name, &decltype(kind_names)::value_type::second);
  return row == kind_names.end() ? SectionKind::custom : row->first;
}

Point Soma::sphere() const {
  if (points.empty()) return {};
  Vec3 centre = Vec3::Zero();
  float radius = 0.f;
  for (const Point& p : points) centre += p.position(), radius += p.radius;
  const float count = float(points.size());
  centre /= count;
  radius /= count;
  if (kind == SomaKind::contours) {
    radius = 0.f;
    for (const Point& p : points) radius += (p.position() - centre).norm() / count;
  } else if (kind == SomaKind::cylinders) {
    radius = float(std::sqrt(area() / (4. * pi)));  // the sphere of the same surface
  }
  return {centre.x(), centre.y(), centre.z(), radius};
}

bool Soma::at_one_place() const {
  return std::ranges::all_of(points, [&](const Point& p) { return p.position() == points[0].position(); });
}

double Soma::area() const {
  if (kind == SomaKind::cylinders) {
    double sum = 0.;
    float widest = 0.f;
    for (std::size_t i = 0; i < points.size(); ++i) {
      widest = std::max(widest, points[i].radius);
      if (parents[i] >= 0) sum += segment_area(points[std::size_t(parents[i])], points[i]);
    }
    return at_one_place() ? 4. * std::numbers::pi * double(widest) * double(widest) : sum;
  }
  const double r = sphere().radius;
  return 4. * std::numbers::pi * r * r;
}

Morphology::Morphology() { *this = MorphologyBuilder().build(); }

std::span<const SectionId> Morphology::children(SectionId id) const {
  const auto begin = data_->first_child[id.value()], end = data_->first_child[id.value() + 1];
  return std::span(data_->children).subspan(begin, end - begin);
}

std::size_t Morphology::segment_count() const { return data_->points.size() - data_->sections.size(); }

Bounds Morphology::bounds() const {
  Bounds bounds;
  for (const Point& p : points()) bounds.add(p.position(), p.radius);
  for (const Point& p : soma().points) bounds.add(p.position(), p.radius);
  return bounds;
}

bool Morphology::operator==(const Morphology& other) const {
  return data_ == other.data_ ||
         (data_->soma == other.data_->soma && data_->points == other.data_->points &&
          data_->sections == other.data_->sections && data_->spines == other.data_->spines);
}

MorphologyBuilder::MorphologyBuilder() : data_(std::make_shared<Morphology::Data>()) {}

void MorphologyBuilder::reserve(std::size_t sections, std::size_t points) {
  data_->sections.reserve(sections);
  data_->points.reserve(points);
}

void MorphologyBuilder::set_soma(Soma soma) {
  check_points(soma.points, "the soma");
  const std::size_t count = soma.points.size();
  const bool good = soma.kind == SomaKind::none     ? count == 0
                    : soma.kind == SomaKind::sphere ? count == 1
                    : soma.kind == SomaKind::cylinders
                        ? count >= 2 && soma.parents.size() == count && soma.parents[0] == -1
                        : count >= 3 && !soma.contour_starts.empty() && soma.contour_starts[0] == 0;
  if (!good)
    throw Error(
        "the soma's points do not fit its kind: a sphere has 1, cylinders 2 or more with parents, contours 3 "
        "or more");
  for (std::size_t i = 1; i < soma.parents.size(); ++i)
    if (soma.parents[i] < 0 || std::size_t(soma.parents[i]) >= i)
      throw Error("a soma point must come after its parent");
  for (std::size_t i = 1; i < soma.contour_starts.size(); ++i)
    if (soma.contour_starts[i] <= soma.contour_starts[i - 1] || soma.contour_starts[i] >= count)
      throw Error("the contours of a soma must begin at increasing points");
  data_->soma = std::move(soma);
}

SectionId MorphologyBuilder::add_section(SectionId parent, SectionKind kind, std::span<const Point> points) {
  return add_section(parent, kind, points, std::int32_t(kind));
}

SectionId MorphologyBuilder::add_section(SectionId parent, SectionKind kind, std::span<const Point> points,
                                         std::int32_t tag, std::int32_t soma_point) {
  auto& all = data_->points;
  if (parent.valid() && parent.value() >= data_->sections.size())
    throw Error("a section must be added after its parent");
  if (points.empty()) throw Error("a section needs at least one point");
  check_points(points, fmt::format("section {}", data_->sections.size()));
  Section section{.parent = parent,
                  .first_point = std::uint32_t(all.size()),
                  .kind = kind,
                  .tag = tag,
                  .soma_point = soma_point};
  if (parent.valid()) {
    const Section& above = data_->sections[parent.value()];
    const Point joint = all[above.first_point + above.point_count - 1];
    if (points.size() < 2 || !same_place(joint, points[0])) all.push_back(joint);
  }
  all.insert(all.end(), points.begin(), points.end());
  section.point_count = std::uint32_t(all.size()) - section.first_point;
  data_->sections.push_back(section);
  return SectionId(data_->sections.size() - 1);
}

void MorphologyBuilder::add_sections(std::vector<Point> points, std::vector<Section> sections) {
  if (!data_->sections.empty()) throw Error("sections all at once must be the first ones");
  // Summed, a NaN or an infinity is never lost: a check without branches.
  float sum = 0.f, least = 0.f;
  for (const Point& p : points) {
    sum += 0.f * p.x + 0.f * p.y + 0.f * p.z + 0.f * p.radius;
    least = std::min(least, p.radius);
  }
  if (sum != 0.f || least < 0.f) check_points(points, "the sections");
  std::size_t next = 0;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const Section& s = sections[i];
    if (s.first_point != next || s.point_count == 0 || s.point_count > points.size() - next)
      throw Error(fmt::format("section {} must begin where the one before it ends and have a point", i));
    next += s.point_count;
    if (!s.parent.valid()) continue;
    if (s.parent.value() >= i) throw Error("a section must be added after its parent");
    const Section& above = sections[s.parent.value()];
    const Point& joint = points[above.first_point + above.point_count - 1];
    if (s.point_count < 2 || !same_place(joint, points[s.first_point]))
      throw Error(fmt::format("section {} must begin at its parent's last point and have two points", i));
  }
  if (next != points.size()) throw Error("there are points after the last section");
  data_->points = std::move(points);
  data_->sections = std::move(sections);
}

void MorphologyBuilder::add_spine(const Spine& spine) {
  if (!spine.section.valid() || spine.section.value() >= data_->sections.size())
    throw Error("a spine must sit on a section that exists");
  data_->spines.push_back(spine);
}

Morphology Morphology::with_annotations(Annotations annotations) const {
  auto data = std::make_shared<Data>(*data_);
  data->annotations = std::move(annotations);
  return Morphology(std::move(data));
}

void MorphologyBuilder::annotate(std::string key, std::string value) {
  data_->annotations.emplace_back(std::move(key), std::move(value));
}

Morphology MorphologyBuilder::build() {
  auto& d = *data_;
  const std::size_t count = d.sections.size();
  d.first_child.assign(count + 1, 0);
  d.orders.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const SectionId parent = d.sections[i].parent;
    if (!parent.valid()) {
      d.roots.push_back(SectionId(i));
      continue;
    }
    ++d.first_child[parent.value() + 1];
    d.orders[i] = d.orders[parent.value()] + 1;
  }
  for (std::size_t i = 0; i < count; ++i) d.first_child[i + 1] += d.first_child[i];
  d.children.resize(count - d.roots.size());
  auto next = d.first_child;
  for (std::size_t i = 0; i < count; ++i)
    if (const SectionId parent = d.sections[i].parent; parent.valid())
      d.children[next[parent.value()]++] = SectionId(i);
  Morphology result{std::shared_ptr<const Morphology::Data>(std::move(data_))};
  data_ = std::make_shared<Morphology::Data>();
  return result;
}

}  // namespace forest
