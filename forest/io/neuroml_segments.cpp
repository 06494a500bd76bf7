// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml_segments.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"

namespace forest::io::neuroml {
namespace {

class Reader {
 public:
  explicit Reader(Segments& all)
      : all_(all), document_(all.document), oddities_(all.oddities), segments_(all.list), order_(all.order) {}

  void read(const xml_node& morphology) {
    segments(morphology);
    find_parents();
    find_order();
    ends();
  }

 private:
  Point point(const xml_node& node) const {
    Point p;
    for (const auto& [name, number] :
         {std::pair{"x", &p.x}, {"y", &p.y}, {"z", &p.z}, {"diameter", &p.radius}})
      if (!parse(attribute(node, name), *number)) {
        const std::string word = lower(trimmed(attribute(node, name), xml_blanks));
        if (word != "nan" && word != "inf" && word != "-inf")
          all_.refuse(node,
                      fmt::format("<{}> has {} = \"{}\", which is no number; a point has x y z and diameter",
                                  local(node), name, attribute(node, name).substr(0, 40)));
        *number = std::numeric_limits<float>::quiet_NaN();
      }
    p.radius *= .5f;
    return p;
  }

  void segments(const xml_node& morphology) {
    for (const xml_node& node : morphology.children()) {
      if (local(node) != "segment") continue;
      Segment& s = segments_.emplace_back();
      s.node = node;
      if (!parse(attribute(node, "id"), s.id) || s.id < 0)
        all_.refuse(node, "a segment has no whole number as its id; ids are 0, 1, 2, …");
      bool has_distal = false;
      for (const xml_node& part : node.children()) {
        if (local(part) == "parent") {
          s.has_parent = true;
        } else if (local(part) == "proximal") {
          s.proximal = point(part);
          s.has_proximal = true;
        } else if (local(part) == "distal") {
          s.distal = point(part);
          has_distal = true;
        }
      }
      if (!has_distal) all_.refuse(node, fmt::format("segment {} has no distal point; give it one", s.id));
      if (!all_.by_id.emplace(s.id, segments_.size() - 1).second)
        oddities_.add(NeuromlOddity::duplicate_id, all_.line(s),
                      [&] { return fmt::format("another segment has the id {}", s.id); });
    }
    if (segments_.empty()) all_.refuse(morphology, "the morphology has no segment; a cell has at least one");
    if (!all_.to_the_letter) count_names();
    if (segments_.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
      all_.refuse(morphology, "has more than 2147483647 segments; split the file");
  }

  /// Written anew, segments are numbered from 0 and named by their section.
  void count_names() {
    std::size_t named = 0;
    for (std::size_t i = 0; i < segments_.size(); ++i)
      named += segments_[i].id != std::int64_t(i) || !attribute(segments_[i].node, "name").empty();
    if (named)
      oddities_.add(NeuromlOddity::names_not_kept, all_.line(segments_[0]), [&] {
        return fmt::format("{} segments have names or numbers of their own, and so may groups of them",
                           named);
      });
  }

  void find_parents() {
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      Segment& s = segments_[i];
      if (!s.has_parent) continue;
      xml_node node;
      for (const xml_node& part : s.node.children())
        if (local(part) == "parent") node = part;
      s.parent = all_.find(attribute(node, "segment"));
      if (s.parent == none)
        oddities_.add(NeuromlOddity::missing_parent, document_.line(node),
                      [&] { return fmt::format("the parent of segment {} is not there", s.id); });
      if (s.parent == i) all_.refuse(node, fmt::format("segment {} is its own parent; correct that", s.id));
      if (s.parent != none && s.parent > i)
        oddities_.add(NeuromlOddity::child_first, all_.line(s),
                      [&] { return fmt::format("segment {} comes before its parent", s.id); });
      if (const std::string_view text = attribute(node, "fractionAlong"); !text.empty()) {
        if (!parse(text, s.fraction) || !(s.fraction >= 0.f && s.fraction <= 1.f)) {
          oddities_.add(NeuromlOddity::fraction, document_.line(node),
                        [&] { return fmt::format("segment {} hangs on a fraction outside 0 to 1", s.id); });
          s.fraction = s.fraction < 0.f ? 0.f : 1.f;
        }
      }
    }
  }

  void find_order() {
    enum : std::uint8_t { unseen, waiting, placed };
    std::vector<std::uint8_t> state(segments_.size(), unseen);
    std::vector<std::size_t> path;
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      for (std::size_t at = i; at != none && state[at] != placed; at = segments_[at].parent) {
        if (state[at] == waiting)
          all_.refuse(
              segments_[at].node,
              fmt::format("segment {} is its own ancestor; correct one of the parents", segments_[at].id));
        state[at] = waiting;
        path.push_back(at);
      }
      for (; !path.empty(); path.pop_back()) {
        state[path.back()] = placed;
        order_.push_back(path.back());
      }
    }
  }

  void mend(Point& p, const Point& before, const Segment& s) {
    bool unknown = false;
    for (float Point::*number : {&Point::x, &Point::y, &Point::z, &Point::radius})
      if (!std::isfinite(p.*number)) p.*number = before.*number, unknown = true;
    if (unknown)
      oddities_.add(NeuromlOddity::unknown_number, all_.line(s),
                    [&] { return fmt::format("a number of segment {} is not finite", s.id); });
    if (p.radius < 0.f) {
      oddities_.add(NeuromlOddity::diameter, all_.line(s),
                    [&] { return fmt::format("a diameter of segment {} is negative", s.id); });
      p.radius = before.radius;
    }
    if (p.radius == 0.f)
      oddities_.add(NeuromlOddity::zero_diameter, all_.line(s),
                    [&] { return fmt::format("a diameter of segment {} is 0", s.id); });
  }

  void ends() {
    for (const std::size_t i : order_) {
      Segment& s = segments_[i];
      const Point before = s.parent == none ? Point{} : all_.joint(s);
      if (s.has_proximal) {
        mend(s.proximal, before, s);
        mend(s.distal, s.proximal, s);
      } else if (s.parent != none) {
        s.proximal = before;
        mend(s.distal, s.proximal, s);
      } else {
        mend(s.distal, before, s);
        s.proximal = s.distal;
        oddities_.add(NeuromlOddity::missing_proximal, all_.line(s),
                      [&] { return fmt::format("segment {} has neither parent nor proximal point", s.id); });
      }
    }
  }

  Segments& all_;
  const Document& document_;
  Oddities& oddities_;
  std::vector<Segment>& segments_;
  std::vector<std::size_t>& order_;
};

}  // namespace

std::size_t Segments::find(std::string_view id) const {
  std::int64_t number = 0;
  if (!parse(id, number)) return none;
  const auto found = by_id.find(number);
  return found == by_id.end() ? none : found->second;
}

void Segments::refuse(const xml_node& node, const std::string& sentence) const {
  throw InputError(document.name(), document.line(node), sentence);
}

Point between(const Point& a, const Point& b, float t) {
  if (t == 0.f || t == 1.f) return t == 0.f ? a : b;
  const auto mix = [t](float from, float to) {
    return float(double(from) + double(t) * (double(to) - double(from)));
  };
  return {mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z), mix(a.radius, b.radius)};
}

Point Segments::joint(const Segment& s) const {
  const Segment& parent = list[s.parent];
  return between(parent.proximal, parent.distal, s.fraction);
}

Segments read_segments(const xml_node& morphology, const Document& document, Oddities& oddities,
                       bool to_the_letter) {
  Segments all{document, oddities, to_the_letter};
  Reader(all).read(morphology);
  return all;
}

}  // namespace forest::io::neuroml
