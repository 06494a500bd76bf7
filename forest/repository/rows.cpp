// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/rows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/morphology/measure.h"
#include "forest/repository/stored_metrics.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

namespace forest::repository {
namespace {

static_assert(std::endian::native == std::endian::little && sizeof(Point) == 16);

constexpr std::array<std::string_view, 4> soma_kinds{"none", "sphere", "cylinders", "contours"};

template <class T>
std::string blob_of(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

template <class T>
std::vector<T> values_of(const std::string& blob) {
  if (blob.size() % sizeof(T)) throw Error("the bytes of an array end within a value");
  std::vector<T> values(blob.size() / sizeof(T));
  if (!blob.empty()) std::memcpy(values.data(), blob.data(), blob.size());
  return values;
}

void measure(const Morphology& m, Rows& rows) {
  const statistics::Arbors arbors(m);
  int number = 0;
  for (const statistics::Metric* metric : stored_metrics()) {
    ++number;
    const double value = statistics::mean(metric->values(arbors));
    if (!std::isfinite(value)) continue;
    rows.metric.push_back(number);
    rows.metric_value.push_back(value);
  }
}

}  // namespace

std::string_view name_of(SomaKind kind) { return soma_kinds[std::size_t(kind)]; }

std::optional<SomaKind> soma_kind(std::string_view name) {
  const auto found = std::ranges::find(soma_kinds, name);
  if (found == soma_kinds.end()) return std::nullopt;
  return SomaKind(found - soma_kinds.begin());
}

PointRuns runs_of(const Rows& rows) { return {rows.sections.parent, rows.sections.point_count}; }

Rows rows_of(const Morphology& m, bool measured) {
  Rows rows;
  rows.points = blob_of(m.points());
  const Soma& soma = m.soma();
  rows.soma_kind = soma.kind;
  rows.soma_points = blob_of(std::span(soma.points));
  rows.soma_links = soma.kind == SomaKind::contours ? blob_of(std::span(soma.contour_starts))
                                                    : blob_of(std::span(soma.parents));

  auto& s = rows.sections;
  auto& a = rows.arbors;
  for (auto* column : {&s.parent, &s.arbor, &s.order, &s.kind, &s.tag, &s.soma_point, &s.first_point,
                       &s.point_count, &s.daughters})
    column->reserve(m.sections().size());
  for (auto* column : {&s.length, &s.area, &s.start_diameter, &s.end_diameter, &s.end_x, &s.end_y, &s.end_z})
    column->reserve(m.sections().size());
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id(i);
    const Section& section = m.section(id);
    const bool root = !section.parent.valid();
    if (root) {
      a.root.push_back(std::int32_t(i));
      a.kind.push_back(std::int32_t(section.kind));
      for (auto* column : {&a.sections, &a.terminals, &a.order}) column->push_back(0);
      a.length.push_back(0.);
    }
    const std::int32_t arbor = root ? std::int32_t(a.size() - 1) : s.arbor[section.parent.value()];
    const double length = section_length(m, id);
    ++a.sections[std::size_t(arbor)];
    a.terminals[std::size_t(arbor)] += m.is_terminal(id);
    a.order[std::size_t(arbor)] = std::max(a.order[std::size_t(arbor)], m.order(id));
    a.length[std::size_t(arbor)] += length;

    s.parent.push_back(root ? -1 : std::int32_t(section.parent.value()));
    s.arbor.push_back(arbor);
    s.order.push_back(m.order(id));
    s.kind.push_back(std::int32_t(section.kind));
    s.tag.push_back(section.tag);
    s.soma_point.push_back(section.soma_point);
    s.first_point.push_back(std::int32_t(section.first_point));
    s.point_count.push_back(std::int32_t(section.point_count));
    s.daughters.push_back(std::int32_t(m.children(id).size()));
    // Whole numbers of picometres, and of square nanometres: the database keeps them in half the bytes.
    const auto put = [](std::vector<double>& column, double value) {
      column.push_back(std::round(1e6 * value));
    };
    put(s.length, length), put(s.area, section_area(m, id));
    const Point &begin = m.points(id).front(), &end = m.points(id).back();
    put(s.start_diameter, 2. * double(begin.radius)), put(s.end_diameter, 2. * double(end.radius));
    put(s.end_x, double(end.x)), put(s.end_y, double(end.y)), put(s.end_z, double(end.z));
  }
  if (measured) measure(m, rows);
  rows.spines.assign(m.spines().begin(), m.spines().end());
  rows.annotations = m.annotations();
  return rows;
}

Morphology morphology_of(const Rows& rows) {
  MorphologyBuilder builder;
  Soma soma;
  soma.kind = rows.soma_kind;
  soma.points = values_of<Point>(rows.soma_points);
  if (soma.kind == SomaKind::contours)
    soma.contour_starts = values_of<std::uint32_t>(rows.soma_links);
  else
    soma.parents = values_of<std::int32_t>(rows.soma_links);
  builder.set_soma(std::move(soma));

  const auto points = values_of<Point>(rows.points);
  const auto& s = rows.sections;
  builder.reserve(s.size(), points.size());
  for (std::size_t i = 0; i < s.size(); ++i) {
    const auto first = std::size_t(s.first_point[i]), count = std::size_t(s.point_count[i]);
    if (first > points.size() || count > points.size() - first)
      throw Error("a section has points that are not there");
    builder.add_section(s.parent[i] < 0 ? SectionId() : SectionId(std::size_t(s.parent[i])),
                        SectionKind(s.kind[i]), std::span(points).subspan(first, count), s.tag[i],
                        s.soma_point[i]);
  }
  for (const Spine& spine : rows.spines) builder.add_spine(spine);
  for (const auto& [name, value] : rows.annotations) builder.annotate(name, value);
  return builder.build();
}

std::uint64_t checksum(const Rows& rows) {
  std::uint64_t sum = std::uint64_t(rows.soma_kind);
  const auto add = [&sum]<class T>(std::span<const T> values) {
    const std::uint64_t count = values.size();
    sum = hash64(std::as_bytes(std::span(&count, 1)), sum);
    sum = hash64(std::as_bytes(values), sum);
  };
  for (const std::string* blob : {&rows.points, &rows.soma_points, &rows.soma_links})
    add(std::span<const char>(*blob));
  const auto& s = rows.sections;
  for (const auto* column : {&s.parent, &s.kind, &s.tag, &s.soma_point, &s.first_point, &s.point_count})
    add(std::span<const std::int32_t>(*column));
  for (const Spine& spine : rows.spines) {
    const std::array<float, 6> numbers{spine.position, spine.head.x(),      spine.head.y(),
                                       spine.head.z(), spine.head_diameter, spine.neck_diameter};
    const std::array<std::uint32_t, 2> words{spine.section.value(), std::uint32_t(spine.shape)};
    add(std::span<const float>(numbers));
    add(std::span<const std::uint32_t>(words));
  }
  for (const auto& [name, value] : rows.annotations)
    add(std::span<const char>(name)), add(std::span<const char>(value));
  return sum;
}

}  // namespace forest::repository
