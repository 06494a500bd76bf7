// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "forest/io/asc.h"
#include "forest/io/asc_words.h"
#include "forest/io/numbers.h"
#include "forest/io/own_file.h"
#include "forest/io/placed_words.h"
#include "forest/io/swc_rows.h"

namespace forest::io {
namespace {

constexpr int circle_points = 16;
constexpr std::size_t deepest_indent = 16;  // a long chain of splits would else be written in blanks

float finite(float value) {
  constexpr float most = std::numeric_limits<float>::max();
  return std::clamp(value, -most, most);
}

std::string_view type_word(SectionKind kind) {
  return kind == SectionKind::axon ? "Axon" : kind == SectionKind::apical ? "Apical" : "Dendrite";
}
SectionKind kind_of_word(SectionKind kind) {
  return kind == SectionKind::axon || kind == SectionKind::apical ? kind : SectionKind::basal;
}

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m) {}

  std::string write() {
    text_.reserve(40 * (m_.points().size() + 32));
    text_ = fmt::format("; {}\n", own_line(asc_marker, m_));
    header();
    soma();
    sort_spines();
    for (const SectionId root : m_.roots()) tree(root);
    return std::move(text_);
  }

 private:
  // Annotations --------------------------------------------------------------------------------------------

  /// What belongs to a section waits for it under its place, the others are comments and blocks.
  void header() {
    std::vector<const std::string*> blocks;
    for (const auto& [key, value] : m_.annotations()) {
      if (key == "leaf" || key == "tree") {
        if (wait(key, value)) continue;
      } else if (key == "marker" || key == "contour" || key == "text" || key == "asc") {
        if (asc_reads_as_annotation(value, key, value)) {
          blocks.push_back(&value);
          continue;
        }
      }
      comment(key == "comment" ? value : key + ' ' + value);
    }
    for (const std::string* block : blocks) text_ += *block, text_ += '\n';
  }

  bool wait(std::string_view key, std::string_view value) {
    const bool leaf = key == "leaf";
    PlacedWords& words = leaf ? leaves_ : trees_;
    if (!words.offered())
      for (std::size_t s = 0; s < m_.sections().size(); ++s) {
        const auto points = m_.points(SectionId(s));
        if (leaf || !m_.section(SectionId(s)).parent.valid())
          words.offer(leaf ? points.back() : points.front());
      }
    std::string_view word, place;
    if (leaf) {
      word = value.substr(0, value.find(' '));
      place = value.substr(std::min(word.size() + 1, value.size()));
      const bool letters = !word.empty() && std::ranges::all_of(word, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      });
      if (!letters || word == "Normal") return false;
    } else {
      std::size_t end = 0;
      for (int blanks = 0; blanks < 3 && end != value.npos; ++blanks)
        end = value.find(' ', end + (blanks > 0));
      if (end == value.npos) return false;
      place = value.substr(0, end), word = value.substr(end + 1);
      if (!asc_reads_as_annotation(fmt::format("({} (Dendrite) (0 0 0 0))", word), "tree",
                                   fmt::format("0 0 0 {}", word)))
        return false;
    }
    return words.add(std::string(place), std::string(word));
  }

  /// A comment line for each line of the text, written as it will be read.
  void comment(std::string_view value) {
    while (true) {
      const std::size_t end = std::min(value.find_first_of("\r\n"), value.size());
      const auto [key, rest] = swc_comment(asc_comment(value.substr(0, end)));
      const std::string_view said = asc_comment(rest);
      if (const bool named = key != "comment"; named || (!said.empty() && !own_file(said, asc_marker).ours)) {
        text_ += ';';
        if (named) text_ += ' ', text_ += key;
        if (!rest.empty()) text_ += ' ', text_ += named ? rest : said;
        text_ += '\n';
      }
      if (end == value.size()) return;
      value.remove_prefix(end + 1);
    }
  }

  // Geometry -----------------------------------------------------------------------------------------------

  void numbers(std::initializer_list<float> values) {
    for (const float value : values) text_ += ' ', append_number(text_, finite(value));
  }
  void point(const Point& p) {
    text_ += '(';
    append_number(text_, p.x);
    numbers({p.y, p.z, 2.f * p.radius});
    text_ += ')';
  }
  void indent(std::size_t depth) { text_.append(2 * std::min(depth, deepest_indent), ' '); }

  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::none) return;
    if (soma.kind == SomaKind::contours) {
      for (std::size_t i = 0; i < soma.contour_starts.size(); ++i) outline(soma.contour(i), {});
      return;
    }
    const Point sphere = soma.sphere();
    std::vector<Point> circle;
    for (int i = 0; i < circle_points; ++i) {
      const double angle = 2. * std::numbers::pi * i / circle_points;
      circle.push_back({finite(sphere.x + sphere.radius * float(std::cos(angle))),
                        finite(sphere.y + sphere.radius * float(std::sin(angle))), finite(sphere.z), 0.f});
    }
    outline(circle, soma);
  }

  void outline(std::span<const Point> points, const Soma& stands_for) {
    text_ += "(\"CellBody\"\n  (CellBody)\n";
    for (std::size_t i = 0; i < stands_for.points.size(); ++i) {
      const bool sphere = stands_for.kind == SomaKind::sphere;
      text_ += fmt::format("  ; {}", sphere ? asc_sphere_key : asc_cylinder_key);
      const Point& p = stands_for.points[i];
      numbers({p.x, p.y, p.z, p.radius});
      if (!sphere) text_ += fmt::format(" {}", stands_for.parents[i]);
      text_ += '\n';
    }
    for (const Point& p : points) text_ += "  ", point(p), text_ += '\n';
    text_ += ")\n";
  }

  void sort_spines() {
    for (std::size_t i = 0; i < m_.spines().size(); ++i) spines_.push_back(&m_.spines()[i]);
    std::ranges::stable_sort(spines_, [](const Spine* a, const Spine* b) {
      return a->section != b->section ? a->section.value() < b->section.value()
                                      : finite(a->position) < finite(b->position);
    });
  }

  void tree(SectionId root) {
    const std::string properties = trees_.take(m_.points(root)[0]);
    text_ += "( ";
    if (!properties.empty()) text_ += properties, text_ += ' ';
    text_ += fmt::format("({})\n", type_word(m_.section(root).kind));
    struct Open {
      SectionId section;
      std::size_t next = 0;  // daughter
    };
    std::vector<Open> open{{root}};
    branch(root, 1);
    while (!open.empty()) {
      const auto daughters = m_.children(open.back().section);
      if (open.back().next == daughters.size()) {
        if (!daughters.empty()) indent(open.size()), text_ += ")\n";
        if (const std::string word = leaves_.take(m_.points(open.back().section).back()); !word.empty())
          indent(open.size()), text_ += word, text_ += '\n';
        else if (daughters.empty())
          indent(open.size()), text_ += "Normal\n";
        open.pop_back();
      } else {
        indent(open.size()), text_ += open.back().next == 0 ? "(\n" : "|\n";
        const SectionId daughter = daughters[open.back().next++];
        open.push_back({daughter});
        branch(daughter, open.size());
      }
    }
    text_ += ")\n";
  }

  /// The points of a section.
  void branch(SectionId id, std::size_t depth) {
    const Section& s = m_.section(id);
    const bool is_root = !s.parent.valid();
    const SectionKind kind = is_root ? kind_of_word(s.kind) : m_.section(s.parent).kind;
    const std::int32_t tag = is_root ? std::int32_t(kind) : m_.section(s.parent).tag;
    if (s.kind != kind || s.tag != tag || s.soma_point >= 0) {
      indent(depth);
      text_ += fmt::format("; {} {} {} {}\n", asc_section_key, int(s.kind), s.tag, s.soma_point);
    }
    const auto points = m_.points(id);
    float position = 0.f;
    for (std::size_t i = 0; i < points.size(); ++i) {
      indent(depth), point(points[i]), text_ += '\n';
      const bool last = i + 1 == points.size();
      const float next =
          last ? position : finite(position + (points[i + 1].position() - points[i].position()).norm());
      for (; spine_ < spines_.size() && spines_[spine_]->section == id &&
             (last || finite(spines_[spine_]->position) < next);
           ++spine_)
        spine(*spines_[spine_], points[i], depth);
      position = next;
    }
  }

  void spine(const Spine& s, const Point& base, std::size_t depth) {
    indent(depth), text_ += "< ; ", text_ += asc_spine_key;
    numbers({s.position, s.head.x(), s.head.y(), s.head.z(), s.head_diameter, s.neck_diameter});
    text_ += fmt::format(" {}\n", int(s.shape));
    indent(depth + 1);
    const Vec3 head = base.position() + s.head;
    point({finite(head.x()), finite(head.y()), finite(head.z()), .5f * s.head_diameter});
    text_ += ">\n";
  }

  const Morphology& m_;
  std::string text_;
  PlacedWords leaves_, trees_;
  std::vector<const Spine*> spines_;
  std::size_t spine_ = 0;
};

}  // namespace

std::string write_asc(const Morphology& morphology) { return Writer(as_kept(morphology, asc_keeps)).write(); }

}  // namespace forest::io
