// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/statements.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/repository/database.h"
#include "forest/repository/names.h"
#include "forest/repository/schema.h"
#include "forest/repository/stored_metrics.h"

namespace forest::repository {
namespace {

long long first_section(long long neuron) { return neuron << section_bits; }

Answer::Value value_of(const InsertColumn& column, std::size_t row) {
  if (column.is_null && column.is_null(row)) return {};
  const auto value = []<class T>(const T& v) -> Answer::Value {
    if constexpr (std::is_integral_v<T>)
      return std::int64_t(v);
    else
      return v;
  };
  return std::visit(
      [&]<class T>(const T* v) {
        if constexpr (requires { typename T::allocator_type; } && !std::is_same_v<T, std::string>)
          return value((*v)[row]);
        else
          return value(*v);
      },
      column.values);
}

/// Sums of another compiler's order may differ in their last digits; so may a half be rounded up or down.
bool same(const Answer::Value& a, const Answer::Value& b, bool whole) {
  const double *x = std::get_if<double>(&a), *y = std::get_if<double>(&b);
  if (!x || !y) return a == b;
  const double larger = std::max({1., std::abs(*x), std::abs(*y)});
  return *x == *y || std::abs(*x - *y) <= (whole ? 1. : 0.) + 1e-9 * larger;
}

/// A float in a column from which the very same is read. SQLite keeps no -0, so it becomes the number next to it, too small to
/// be any other float.
double exactly(float number) {
  return number == 0.f && std::signbit(number) ? -std::numeric_limits<double>::denorm_min() : double(number);
}

std::string shown(const Answer::Value& value) {
  return std::visit(
      []<class T>(const T& v) -> std::string {
        if constexpr (std::is_same_v<T, std::monostate>)
          return "nothing";
        else
          return fmt::format("{}", v);
      },
      value);
}

}  // namespace

std::string of_sections(long long neuron) {
  return fmt::format("sections where id >= {} and id < {}", first_section(neuron), first_section(neuron + 1));
}

std::string of_metrics(long long neuron) {
  return fmt::format("neuron_metrics where metric in (select id from metrics) and neuron = {}", neuron);
}

Statements::Statements(Database& database)
    : program_(FOREST_VERSION),
      neuron_(database, "neurons"),
      provenance_(database, "provenance"),
      soma_(database, "somata"),
      points_(database, "points"),
      arbors_(database, "arbors"),
      sections_(database, "sections"),
      metrics_(database, "neuron_metrics"),
      spines_(database, "spines"),
      annotations_(database, "annotations") {
  neuron_.with("id", id).with("population", population).with("name", name).with("fingerprint", fingerprint);
  neuron_.with("species", about.species).with("region", about.region).with("layer", about.layer);
  neuron_.with("type", about.type).with("stems", stems_).with("sections", section_count_);
  neuron_.with("points", point_count_).with("spines", spine_count_).with("length", length_);
  neuron_.with("checksum", checksum);
  const auto unless_traced = [this](std::size_t) {
    return !std::holds_alternative<Traced>(about.provenance);
  };
  const auto unless_grown = [this](std::size_t) { return !std::holds_alternative<Grown>(about.provenance); };
  provenance_.with("neuron", id).with("origin", origin_).with("source_file", file_, unless_traced);
  provenance_.with("source_hash", hash_, unless_traced).with("grammar", grammar, unless_grown);
  provenance_.with("seed", seed_, unless_grown).with("number", index_, unless_grown);
  provenance_.with("program", program_);
  soma_.with("neuron", id).with("kind", soma_kind_).with("x", sphere_[0]).with("y", sphere_[1]);
  soma_.with("z", sphere_[2]).with("radius", sphere_[3]).with("area", area_);
  soma_.with_bytes("points", rows.soma_points).with_bytes("links", rows.soma_links);
  points_.with("neuron", id).with_bytes("data", data_).with("packing", packing_);
  const auto& a = rows.arbors;
  arbors_.with("neuron", id).with("number", numbers_).with("root", a.root).with("kind", a.kind);
  arbors_.with("sections", a.sections).with("terminals", a.terminals).with("max_order", a.order);
  arbors_.with("length", a.length);
  const auto& s = rows.sections;
  sections_.with("id", section_ids_);
  sections_.with("parent", s.parent, [&s](std::size_t row) { return s.parent[row] < 0; });
  sections_.with("arbor", s.arbor).with("branch_order", s.order).with("kind", s.kind).with("tag", s.tag);
  sections_.with("soma_point", s.soma_point).with("points", s.point_count).with("daughters", s.daughters);
  sections_.with_whole("length_pm", s.length).with_whole("area_nm2", s.area);
  sections_.with_whole("start_diameter_pm", s.start_diameter).with_whole("end_diameter_pm", s.end_diameter);
  sections_.with_whole("end_x_pm", s.end_x).with_whole("end_y_pm", s.end_y).with_whole("end_z_pm", s.end_z);
  metrics_.with("neuron", metric_neuron_).with("metric", metric_).with("value", metric_value_);
  spines_.with("neuron", id).with("number", numbers_).with("section", spine_section_);
  constexpr const char* spine_columns[] = {"position", "head_x",        "head_y",
                                           "head_z",   "head_diameter", "neck_diameter"};
  for (std::size_t i = 0; i < spine_.size(); ++i) spines_.with(spine_columns[i], spine_[i]);
  spines_.with("shape", spine_shape_);
  annotations_.with("neuron", id).with("number", numbers_).with("name", key_).with("value", value_);
}

bool Statements::run(const Morphology& m) {
  fill(m);
  if (!neuron_.run()) return false;
  provenance_.run();
  soma_.run();
  run_shape();
  run(spines_, rows.spines.size());
  run(annotations_, rows.annotations.size());
  return true;
}

void Statements::run(Insert& insert, std::size_t count) {
  number(count);
  insert.run(count);
}

void Statements::number(std::size_t count) {
  for (std::size_t i = numbers_.size(); i < count; ++i) numbers_.push_back(int(i));
}

void Statements::run_shape() {
  fill_shape();
  if (!data_.empty()) points_.run();
  run(arbors_, rows.arbors.size());
  sections_.run(rows.sections.size());
  run_metrics();
}

void Statements::wait_metrics() {
  for (std::size_t i = 0; i < rows.metric.size(); ++i)
    waiting_.push_back({rows.metric[i], id, rows.metric_value[i]});
}

void Statements::run_metrics() {
  constexpr std::size_t enough = 1 << 16;  // a megabyte
  wait_metrics();
  if (waiting_.size() >= enough) finish();
}

void Statements::finish() {
  take_waiting();
  metrics_.run(metric_.size());
}

void Statements::take_waiting() {
  std::ranges::stable_sort(waiting_, {}, &Value::metric);
  metric_.clear(), metric_neuron_.clear(), metric_value_.clear();
  for (const Value& v : waiting_) {
    metric_.push_back(v.metric);
    metric_neuron_.push_back(v.neuron);
    metric_value_.push_back(v.value);
  }
  waiting_.clear();
}

std::string Statements::deviation(Database& database, const Morphology& m) {
  fill(m), fill_shape(), wait_metrics(), take_waiting();
  number(std::max(rows.arbors.size(), rows.spines.size()));
  struct Part {
    const Insert& insert;
    std::size_t rows;
    std::string from;
    std::string_view columns = {};  // all when empty, the others are no numbers of the shape
  };
  const auto of = [&](const char* table, const char* order) {
    return fmt::format("{} where neuron = {}{}", table, id, order);
  };
  std::string first;
  std::size_t more = 0;
  for (const Part& part :
       {Part{neuron_, 1, fmt::format("neurons where id = {}", id), " stems sections points spines length "},
        Part{soma_, 1, of("somata", "")}, Part{arbors_, rows.arbors.size(), of("arbors", " order by number")},
        Part{sections_, rows.sections.size(), of_sections(id) + " order by id"},
        Part{metrics_, rows.metric.size(),
             fmt::format("{} and metric < {} order by metric", of_metrics(id), first_further_number)},
        Part{spines_, rows.spines.size(), of("spines", " order by number")}}) {
    std::vector<const InsertColumn*> columns;
    std::vector<std::string_view> names;
    for (const InsertColumn& c : part.insert.columns())
      if (!c.bytes &&
          (part.columns.empty() || part.columns.find(fmt::format(" {} ", c.name)) != part.columns.npos))
        columns.push_back(&c), names.emplace_back(c.name);
    const Answer answer = database.ask(fmt::format("select {} from {}", fmt::join(names, ", "), part.from));
    if (answer.rows.size() != part.rows) {
      if (first.empty())
        first = fmt::format("{} has {} rows, not {}", part.insert.table(), answer.rows.size(), part.rows);
      ++more;
      continue;
    }
    for (std::size_t row = 0; row < part.rows; ++row)
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const Answer::Value &stored = answer.rows[row][c], expected = value_of(*columns[c], row);
        if (same(stored, expected, columns[c]->whole)) continue;
        if (first.empty())
          first = fmt::format("{} of {} is {} in row {}, not {}", names[c], part.insert.table(),
                              shown(stored), row, shown(expected));
        ++more;
      }
  }
  return more > 1 ? fmt::format("{}, and {} more values", first, more - 1) : first;
}

void Statements::fill(const Morphology& m) {
  stems_ = int(m.roots().size());
  section_count_ = int(m.sections().size());
  point_count_ = int(m.points().size());
  spine_count_ = int(m.spines().size());
  length_ = 0.;
  for (const double length : rows.arbors.length) length_ += length;

  const auto* traced = std::get_if<Traced>(&about.provenance);
  const auto* grown = std::get_if<Grown>(&about.provenance);
  origin_ = traced ? "traced" : "grown";
  if (traced) file_ = escaped(traced->file), hash_ = escaped(traced->hash);
  if (grown) seed_ = std::bit_cast<long long>(grown->seed), index_ = std::bit_cast<long long>(grown->index);

  const Point sphere = m.soma().sphere();
  soma_kind_ = name_of(rows.soma_kind);
  sphere_ = {sphere.x, sphere.y, sphere.z, sphere.radius};
  area_ = m.soma().area();

  spine_section_.clear(), spine_shape_.clear();
  for (Reals& column : spine_) column.clear();
  for (const Spine& s : rows.spines) {
    const std::array<float, 6> numbers{s.position, s.head.x(),      s.head.y(),
                                       s.head.z(), s.head_diameter, s.neck_diameter};
    for (std::size_t i = 0; i < 6; ++i) spine_[i].push_back(exactly(numbers[i]));
    spine_section_.push_back(int(s.section.value()));
    spine_shape_.push_back(int(s.shape));
  }

  key_.clear(), value_.clear();
  for (const auto& [key, value] : rows.annotations)
    key_.push_back(escaped(key)), value_.push_back(escaped(value));
}

void Statements::fill_shape() {
  packing_ = packed_points.empty() ? 0 : 2;
  data_ = packing_ ? packed_points : rows.points;
  section_ids_.resize(rows.sections.size());
  std::iota(section_ids_.begin(), section_ids_.end(), first_section(id));
}

}  // namespace forest::repository
