// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/morphology_string.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/cursor.h"

namespace forest::lsystem {
namespace {

constexpr std::array soma_words{std::pair{SomaKind::sphere, "sphere"},
                                std::pair{SomaKind::cylinders, "cylinders"},
                                std::pair{SomaKind::contours, "contours"}};
constexpr std::int64_t most_index = 1'000'000'000;

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m), spines_of_(m.sections().size()) {
    for (std::size_t i = 0; i < m.spines().size(); ++i)
      spines_of_[m.spines()[i].section.value()].push_back(i);
  }

  std::string text() {
    soma();
    // Sections depth first; a stack instead of recursion, because neurites may be very long.
    struct Open {
      SectionId id;
      std::size_t next_child;
    };
    for (const SectionId root : m_.roots()) {
      std::vector<Open> open{{root, 0}};
      begin(root, 0);
      while (!open.empty()) {
        Open& top = open.back();
        const auto children = m_.children(top.id);
        if (top.next_child == children.size()) {
          out_ += "]";
          open.pop_back();
        } else {
          const SectionId child = children[top.next_child++];
          begin(child, open.size());
          open.push_back({child, 0});
        }
      }
      out_ += "\n";
    }
    return std::move(out_);
  }

 private:
  void append(const Point& p) {
    fmt::format_to(std::back_inserter(out_), " P({},{},{},{})", p.x, p.y, p.z, p.radius);
  }

  void soma() {
    const Soma& soma = m_.soma();
    for (const auto& [kind, word] : soma_words) {
      if (soma.kind != kind) continue;
      out_ += fmt::format("[{}", word);
      for (const Point& p : soma.points) append(p);
      if (!soma.parents.empty()) out_ += fmt::format(" Parents({})", fmt::join(soma.parents, ","));
      if (!soma.contour_starts.empty())
        out_ += fmt::format(" Starts({})", fmt::join(soma.contour_starts, ","));
      out_ += "]\n";
    }
  }

  void begin(SectionId id, std::size_t depth) {
    const Section& s = m_.section(id);
    if (depth) out_ += "\n" + std::string(std::min<std::size_t>(depth, 40), ' ');
    out_ += fmt::format("[{}", name_of(s.kind));
    const bool place = id.value() == sections_++;
    if (!place)
      out_ += fmt::format("({},{},{})", s.tag, s.soma_point, id.value());
    else if (s.soma_point != -1)
      out_ += fmt::format("({},{})", s.tag, s.soma_point);
    else if (s.tag != std::int32_t(s.kind))
      out_ += fmt::format("({})", s.tag);
    for (const Point& p : m_.points(id)) append(p);
    for (const std::size_t i : spines_of_[id.value()]) {
      const Spine& p = m_.spines()[i];
      out_ += fmt::format(" Spine({},{},{},{},{},{},{}", p.position, p.head.x(), p.head.y(), p.head.z(),
                          p.head_diameter, p.neck_diameter, int(p.shape));
      out_ += i == spines_++ ? ")" : fmt::format(",{})", i);
    }
  }

  const Morphology& m_;
  std::vector<std::vector<std::size_t>> spines_of_;
  std::size_t sections_ = 0, spines_ = 0;
  std::string out_;
};

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text, file) {}

  Morphology morphology() {
    std::vector<std::size_t> open;  // sections whose bracket is not closed
    while (text_.more()) {
      const std::size_t place = text_.at();
      if (text_.takes("]")) {
        if (open.empty()) text_.fail_at(place, "a ] closes nothing");
        open.pop_back();
      } else if (text_.takes("[")) {
        if (!(open.empty() && soma())) section(open, place);
      } else if (!open.empty() && text_.takes("P")) {
        sections_[open.back()].points.push_back(point());
      } else if (!open.empty() && text_.takes("Spine")) {
        spine(open.back(), place);
      } else {
        text_.fail("a section [kind …], a point P(x,y,z,radius) or a Spine(…) is missing here");
      }
    }
    if (!open.empty()) text_.fail("a [ is not closed; the string is cut off");
    return build();
  }

 private:
  struct Read {
    std::size_t parent, index, place;
    SectionKind kind;
    std::int32_t tag, soma_point;
    std::vector<Point> points;
  };
  struct ReadSpine {
    std::size_t section, index, place;
    Spine spine;
  };

  std::int64_t whole() {
    const std::size_t place = (text_.more(), text_.at());
    const double value = text_.signed_number();
    if (!(value >= -2147483648. && value <= 2147483647. && value == std::floor(value)))
      text_.fail_at(place, "a whole number is missing here");
    return std::int64_t(value);
  }
  std::vector<std::int64_t> whole_numbers() {
    std::vector<std::int64_t> values;
    text_.expect("(", "before numbers");
    do values.push_back(whole());
    while (text_.takes(","));
    text_.expect(")", "after numbers");
    return values;
  }
  template <std::size_t count>
  std::array<float, count> floats() {
    std::array<float, count> values;
    for (std::size_t i = 0; i < count; ++i) {
      if (i) text_.expect(",", "between numbers");
      values[i] = text_.exact_float();
    }
    return values;
  }
  Point point() {
    text_.expect("(", "after P");
    const auto v = floats<4>();
    text_.expect(")", "after x, y, z and radius");
    return {v[0], v[1], v[2], v[3]};
  }

  bool soma() {
    const auto row = std::ranges::find_if(soma_words, [&](const auto& r) { return text_.sees(r.second); });
    if (row == soma_words.end()) return false;
    if (soma_.kind != SomaKind::none) text_.fail("there are two somata; a neuron has one");
    text_.takes(row->second);
    soma_.kind = row->first;
    while (!text_.takes("]")) {
      if (text_.takes("Parents")) {
        for (const std::int64_t v : whole_numbers()) soma_.parents.push_back(std::int32_t(v));
      } else if (text_.takes("Starts")) {
        for (const std::int64_t v : whole_numbers()) soma_.contour_starts.push_back(std::uint32_t(v));
      } else {
        text_.expect("P", "to give a point of the soma");
        soma_.points.push_back(point());
      }
    }
    return true;
  }

  void section(std::vector<std::size_t>& open, std::size_t place) {
    const std::string word = text_.name("of the kind of a section");
    const SectionKind kind = section_kind(word);
    if (name_of(kind) != word)
      text_.fail_at(place,
                    "there is no such kind of section; write axon, basal, apical, custom, undefined, "
                    "unspecified or glia");
    Read s{.parent = open.empty() ? none : open.back(),
           .index = sections_.size(),
           .place = place,
           .kind = kind,
           .tag = std::int32_t(kind),
           .soma_point = -1,
           .points = {}};
    if (text_.sees("(")) {
      const auto values = whole_numbers();
      if (values.size() > 3) text_.fail("a section has a tag, a soma point and an index, no more");
      s.tag = std::int32_t(values[0]);
      if (values.size() > 1) s.soma_point = std::int32_t(values[1]);
      if (values.size() > 2) s.index = index(values[2]);
    }
    open.push_back(sections_.size());
    sections_.push_back(std::move(s));
  }

  std::size_t index(std::int64_t value) const {
    if (value < 0 || value > most_index) text_.fail("an index is a whole number from 0");
    return std::size_t(value);
  }

  void spine(std::size_t section, std::size_t place) {
    text_.expect("(", "after Spine");
    const auto v = floats<6>();
    text_.expect(",", "before the shape of a spine");
    const std::int64_t shape = whole();
    if (shape < 0 || shape > std::int64_t(SpineShape::branched))
      text_.fail("the shape of a spine is a number from 0 to 5");
    const std::size_t at = text_.takes(",") ? index(whole()) : spines_.size();
    text_.expect(")", "after a spine");
    spines_.push_back({section,
                       at,
                       place,
                       {.section = {},
                        .position = v[0],
                        .head = {v[1], v[2], v[3]},
                        .head_diameter = v[4],
                        .neck_diameter = v[5],
                        .shape = SpineShape(shape)}});
  }

  // The elements in the order of their indices, which must be 0 to n - 1.
  template <class T>
  std::vector<std::size_t> by_index(const std::vector<T>& elements) const {
    std::vector<std::size_t> order(elements.size(), none);
    for (std::size_t i = 0; i < elements.size(); ++i) {
      if (elements[i].index >= order.size() || order[elements[i].index] != none)
        text_.fail_at(elements[i].place,
                      fmt::format("index {} is there twice or too large", elements[i].index));
      order[elements[i].index] = i;
    }
    return order;
  }

  Morphology build() {
    MorphologyBuilder builder;
    std::size_t place = 0;
    try {
      builder.set_soma(std::move(soma_));
      for (const std::size_t i : by_index(sections_)) {
        const Read& s = sections_[i];
        place = s.place;
        const std::size_t parent = s.parent == none ? none : sections_[s.parent].index;
        if (parent != none && parent >= s.index)
          text_.fail_at(place, "a section must have a greater index than its parent");
        builder.add_section(parent == none ? SectionId() : SectionId(parent), s.kind, s.points, s.tag,
                            s.soma_point);
      }
      for (const std::size_t i : by_index(spines_)) {
        Spine spine = spines_[i].spine;
        spine.section = SectionId(sections_[spines_[i].section].index);
        builder.add_spine(spine);
      }
    } catch (const InputError&) {
      throw;
    } catch (const Error& error) {
      text_.fail_at(place, error.what());
    }
    return builder.build();
  }

  static constexpr std::size_t none = std::size_t(-1);
  Cursor text_;
  Soma soma_;
  std::vector<Read> sections_;
  std::vector<ReadSpine> spines_;
};

}  // namespace

std::string to_string(const Morphology& morphology) { return Writer(morphology).text(); }

Morphology morphology_from_string(std::string_view text, const std::string& file) {
  return Reader(text, file).morphology();
}

}  // namespace forest::lsystem
