// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

#include "forest/io/numbers.h"
#include "forest/io/own_file.h"
#include "forest/io/soma_place.h"
#include "forest/io/swc.h"
#include "forest/io/swc_rows.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

class Writer {
 public:
  explicit Writer(const Morphology& m, bool extended = false) : m_(m), soma_place_(m), extended_(extended) {}

  std::string write() {
    rows();  // first, since the header names ids
    std::string text = fmt::format("# {}\n", own_line(swc_marker, m_));
    text.reserve(header_.size() + rows_.size() + 4096);
    for (const auto& [key, value] : m_.annotations())
      if (key != "synapse") comment(text, key == "comment" ? value : key + ' ' + value);
    text += header_;
    for (const Spine& spine : m_.spines()) {
      text += fmt::format("# {} {}", swc_spine_key, spine.section.value());
      for (const float number : {spine.position, spine.head.x(), spine.head.y(), spine.head.z(),
                                 spine.head_diameter, spine.neck_diameter, float(spine.shape)})
        text += ' ', append_number(text, number);
      text += '\n';
    }
    text += rows_;
    footer(text);
    return text;
  }

 private:
  void row(std::int64_t type, const Point& p, std::int64_t parent) {
    append_number(rows_, ++id_), rows_ += ' ';
    append_number(rows_, type), rows_ += ' ';
    for (const float number : {p.x, p.y, p.z, p.radius}) append_number(rows_, number), rows_ += ' ';
    append_number(rows_, parent);
    if (extended_) rows_ += fmt::format(" {} {} 0 0 0", segment_, level_);
    rows_ += '\n';
  }

  void rows() {
    rows_.reserve(48 * (m_.points().size() + 16));
    soma();
    std::vector<std::int64_t> last_ids(m_.sections().size());
    std::vector<std::int64_t> levels(m_.sections().size());
    for (std::size_t s = 0; s < m_.sections().size(); ++s) {
      const Section& section = m_.sections()[s];
      const std::span<const Point> points = m_.points(SectionId(s));
      levels[s] = section.parent.valid() ? levels[section.parent.value()] + 1 : 1;
      segment_ = s + 1, level_ = levels[s];
      std::int64_t parent = -1;
      std::size_t first = 0;
      if (!section.parent.valid()) {
        const std::int32_t place = soma_place_(SectionId(s));
        parent = place < 0 ? -1 : 1 + place;
      } else {
        parent = last_ids[section.parent.value()];
        // The joint is the parent's last row, unless reading could not tell this section's first point from
        // it.
        const Point joint = m_.points(section.parent).back();
        const bool said =
            points[0].radius == joint.radius && !(points.size() > 2 && same_place(points[0], points[1]));
        first = said ? 1 : 0;
        const bool only = m_.children(section.parent).size() == 1;
        if (only && swc_type(section) == swc_type(m_.section(section.parent)))
          header_ += fmt::format("# {} {}\n", swc_node_key, id_ + 1);
      }
      for (std::size_t i = first; i < points.size(); ++i)
        row(swc_type(section), points[i], i == first ? parent : id_);
      last_ids[s] = id_;
    }
  }

  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::none) return;
    if (soma.kind == SomaKind::cylinders) {
      for (std::size_t i = 0; i < soma.points.size(); ++i)
        row(swc_soma_type, soma.points[i], soma.parents[i] < 0 ? -1 : soma.parents[i] + 1);
      return;
    }
    row(swc_soma_type, soma.sphere(), -1);
    std::size_t contour = 0;
    if (soma.kind != SomaKind::contours) return;
    for (std::size_t i = 0; i < soma.points.size(); ++i) {
      if (contour + 1 < soma.contour_starts.size() && soma.contour_starts[contour + 1] == i) ++contour;
      header_ += fmt::format("# {} {}", swc_outline_key, contour);
      const Point& p = soma.points[i];
      for (const float number : {p.x, p.y, p.z, p.radius}) header_ += ' ', append_number(header_, number);
      header_ += '\n';
    }
  }

  /// A comment line for each line of the text, written as it will be read.
  static void comment(std::string& text, std::string_view value) {
    while (true) {
      const std::size_t end = std::min(value.find_first_of("\r\n"), value.size());
      const auto [key, rest] = swc_comment(value.substr(0, end));
      const bool ours = own_file(rest, swc_marker).ours || rest == "start synapse" || swc_own_key(key);
      if (!ours) {
        text += '#';
        if (key != "comment") text += ' ', text += key;
        if (!rest.empty()) text += ' ', text += rest;
        text += '\n';
      }
      if (end == value.size()) return;
      value.remove_prefix(end + 1);
    }
  }

  void footer(std::string& text) const {
    std::string lines;
    for (const auto& [key, value] : m_.annotations())
      if (key == "synapse" && value.find_first_of("\r\n") == value.npos && value != "end synapse")
        lines += "# " + value + '\n';
    if (!lines.empty()) text += "# start synapse\n" + lines + "# end synapse\n";
  }

  const Morphology& m_;
  SomaPlaces soma_place_;
  std::string header_, rows_;
  std::int64_t id_ = 0, level_ = 0;
  std::size_t segment_ = 0;
  const bool extended_;  // eSWC
};

}  // namespace

std::string write_swc(const Morphology& morphology) { return Writer(morphology).write(); }
std::string write_eswc(const Morphology& morphology) { return Writer(morphology, true).write(); }

}  // namespace forest::io
