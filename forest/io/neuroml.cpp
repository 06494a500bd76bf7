// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "forest/core/distinct.h"
#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/io/neuroml_names.h"
#include "forest/io/oddity.h"
#include "forest/io/plain_text.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

enum class NeuromlOddity : std::uint8_t {
  several_cells,
  several_documents,
  elsewhere,
  include,
  not_kept,
  groups_not_kept,
  duplicate_id,
  missing_parent,
  child_first,
  several_roots,
  missing_proximal,
  unknown_number,
  diameter,
  zero_diameter,
  fraction,
  gap,
  several_somata,
  soma_inside_neurite,
  group,
  names_not_kept,
  count
};

constexpr std::string_view keep_the_file = "keep the file beside what is made of it";

constexpr std::array<Oddity, static_cast<std::size_t>(NeuromlOddity::count)> table{{
    {"several-cells", false, "only the first is read here; import the file to have all"},
    {"several-documents", false, "the first one is read", "split the file"},
    {"morphology-elsewhere", true, "left out; read that file for its shape", "give the file that holds it"},
    {"include", false, "included files are not opened; name them as well",
     "give the included files as well, where they hold cells"},
    {"not-kept", false, "left out: shapes are read, not what they do", keep_the_file, true},
    {"groups-not-kept", false, "used as far as they say kinds and sections, else left out", keep_the_file,
     true},
    {"duplicate-id", true, "children hang on the first segment of that number",
     "give each segment a number of its own"},
    {"missing-parent", true, "read as a root", "give it the parent it was traced from"},
    {"child-first", false, "the order of segments does not matter"},
    {"several-roots", true, "kept as a tree of its own, attached to no soma point",
     "give it a parent if it belongs to the cell"},
    {"missing-proximal", true, "read as a neurite that begins with a single point",
     "give it a proximal point or a parent"},
    {"unknown-number", true, "read as that of the point before", "look it up in the tracing"},
    {"diameter", true, "read as that of the point before", "measure it where thickness matters"},
    {"zero-diameter", true, "kept as 0", "give the measured one"},
    {"fraction", true, "read as the nearest of 0 and 1"},
    {"gap", true, "the point it hangs on is put in front"},
    {"several-somata", true, "joined to the first point of the soma", "split the cell if it is several"},
    {"soma-inside-neurite", true, "read as a neurite of undefined kind"},
    {"group", true, "the reference is skipped"},
    {"names-not-kept", false, "left out: a section has a number and no name", keep_the_file, true},
}};

using namespace neuroml;
using Oddities = OddityList<NeuromlOddity>;
using pugi::xml_node;

// What a group says of its segments, in rising order of what wins where several do.
enum class Meaning : std::uint8_t { none, dendrite, basal, apical, axon, soma };

struct GroupWord {
  std::string_view word;  // neuroLexId, or the group's name in lower case
  Meaning meaning;
};
constexpr std::array group_words{
    GroupWord{"sao1044911821", Meaning::soma},
    GroupWord{"go:0043025", Meaning::soma},
    GroupWord{"sao1770195789", Meaning::axon},
    GroupWord{"go:0030424", Meaning::axon},
    GroupWord{"sao1211023249", Meaning::dendrite},
    GroupWord{"go:0030425", Meaning::dendrite},
    GroupWord{"sao273773228", Meaning::apical},
    GroupWord{"go:0097440", Meaning::apical},
    GroupWord{"sao1079900774", Meaning::basal},
    GroupWord{"go:0097441", Meaning::basal},
    GroupWord{"soma_group", Meaning::soma},
    GroupWord{"somatic", Meaning::soma},
    GroupWord{"soma", Meaning::soma},
    GroupWord{"axon_group", Meaning::axon},
    GroupWord{"axonal", Meaning::axon},
    GroupWord{"axon", Meaning::axon},
    GroupWord{"axons", Meaning::axon},
    GroupWord{"dendrite_group", Meaning::dendrite},
    GroupWord{"dendrite", Meaning::dendrite},
    GroupWord{"dendrites", Meaning::dendrite},
    GroupWord{"apical", Meaning::apical},
    GroupWord{"apical_group", Meaning::apical},
    GroupWord{"apical_dendrite", Meaning::apical},
    GroupWord{"apical_dendrites", Meaning::apical},
    GroupWord{"apical_dends", Meaning::apical},
    GroupWord{"apical_dendrite_group", Meaning::apical},
    GroupWord{"basal", Meaning::basal},
    GroupWord{"basal_group", Meaning::basal},
    GroupWord{"basal_dendrite", Meaning::basal},
    GroupWord{"basal_dendrites", Meaning::basal},
    GroupWord{"basal_dends", Meaning::basal},
    GroupWord{"basal_dendrite_group", Meaning::basal},
};
// How names of sections and segments begin, where no group says what they are.
constexpr std::array name_beginnings{
    GroupWord{"soma", Meaning::soma},    GroupWord{"axon", Meaning::axon},
    GroupWord{"hillock", Meaning::axon}, GroupWord{"apic", Meaning::apical},
    GroupWord{"basal", Meaning::basal},  GroupWord{"dend", Meaning::dendrite},
};

/// The part of an element's name after its namespace's prefix.
std::string_view local(const xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);  // npos + 1 == 0
}

std::string_view attribute(const xml_node& node, const char* name) { return node.attribute(name).value(); }

template <class T>
bool parse(std::string_view text, T& value) {
  const auto found = number_of<T>(trimmed(text, xml_blanks));
  if (found) value = *found;
  return found.has_value();
}

/// The text as XML, and where its nodes stand.
class Document {
 public:
  Document(std::string_view bytes, const std::string& name) : name_(name) {
    const auto result = document_.load_buffer(bytes.data(), bytes.size(), pugi::parse_default);
    lines_ = newlines(bytes);
    if (!result)
      throw InputError(
          name, line_of(result.offset),
          fmt::format("is not XML ({}); write or copy the file again", lower(result.description())));
    root_ = document_.document_element();
    if (local(root_) != "neuroml")
      throw NotANeuron(name, line(root_),
                       fmt::format("is not NeuroML: its first element is <{}>, not <neuroml>",
                                   std::string_view(root_.name()).substr(0, 40)));
    if (root_.child("cells") ||
        std::string_view(root_.attribute("xmlns").value()).find("morphml.org") != std::string_view::npos)
      throw InputError(name, line(root_),
                       "is NeuroML 1; convert it to version 2 with the tools of neuroml.org");
  }

  const xml_node& root() const { return root_; }
  const std::string& name() const { return name_; }
  std::size_t line(const xml_node& node) const { return line_of(node.offset_debug()); }

 private:
  static std::vector<std::ptrdiff_t> newlines(std::string_view bytes) {
    std::vector<std::ptrdiff_t> lines;
    for (std::size_t at = bytes.find('\n'); at != bytes.npos; at = bytes.find('\n', at + 1))
      lines.push_back(std::ptrdiff_t(at));
    return lines;
  }
  std::size_t line_of(std::ptrdiff_t offset) const {
    return std::size_t(std::ranges::lower_bound(lines_, offset) - lines_.begin()) + 1;
  }

  pugi::xml_document document_;
  const std::string& name_;
  std::vector<std::ptrdiff_t> lines_;
  xml_node root_;
};

constexpr std::size_t none = std::size_t(-1);

/// A <morphology> to sections, in the order of the functions below.
class Assembler {
 public:
  Assembler(const Document& document, Oddities& oddities, bool to_the_letter)
      : document_(document), oddities_(oddities), to_the_letter_(to_the_letter) {}

  void read(const xml_node& morphology, MorphologyBuilder& builder) {
    segments(morphology);
    find_parents();
    find_order();
    ends();
    groups(morphology);
    kinds();
    find_soma();
    sections();
    builder.set_soma(std::move(soma_));
    std::vector<SectionId> ids;
    for (const Run& run : runs_) {
      const SectionId parent = run.parent == none ? SectionId() : ids[run.parent];
      ids.push_back(builder.add_section(parent, run.kind, run.points, run.tag, run.soma_point));
    }
  }

 private:
  struct Segment {
    xml_node node;
    std::int64_t id = 0;
    std::size_t parent = none;
    float fraction = 1.f;
    bool has_parent = false, has_proximal = false;
    Point proximal, distal;
    Meaning meaning = Meaning::none;
    std::optional<std::pair<SectionKind, std::int32_t>> kind;  // as our own groups say
    std::size_t section = none;                                // the group that marks it
    std::vector<float> splits;                                 // fractions at which children hang, in (0, 1)
  };
  struct Group {
    xml_node node;
    std::string id, lex;
    std::vector<std::size_t> segments;
  };
  struct Run {  // of segments: a section
    SectionKind kind = SectionKind::undefined;
    std::int32_t tag = 0;
    std::size_t parent = none, section = none;
    std::int32_t soma_point = -1;
    std::vector<Point> points;
  };

  std::size_t line(const Segment& s) const { return document_.line(s.node); }

  [[noreturn]] void refuse(const xml_node& node, const std::string& sentence) const {
    throw InputError(document_.name(), document_.line(node), sentence);
  }

  Point point(const xml_node& node) const {
    Point p;
    for (const auto& [name, number] :
         {std::pair{"x", &p.x}, {"y", &p.y}, {"z", &p.z}, {"diameter", &p.radius}})
      if (!parse(attribute(node, name), *number)) {
        const std::string word = lower(trimmed(attribute(node, name), xml_blanks));
        if (word != "nan" && word != "inf" && word != "-inf")
          refuse(node, fmt::format("<{}> has {} = \"{}\", which is no number; a point has x y z and diameter",
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
        refuse(node, "a segment has no whole number as its id; ids are 0, 1, 2, …");
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
      if (!has_distal) refuse(node, fmt::format("segment {} has no distal point; give it one", s.id));
      if (!index_.emplace(s.id, segments_.size() - 1).second)
        oddities_.add(NeuromlOddity::duplicate_id, line(s),
                      [&] { return fmt::format("another segment has the id {}", s.id); });
    }
    if (segments_.empty()) refuse(morphology, "the morphology has no segment; a cell has at least one");
    if (!to_the_letter_) count_names();
    if (segments_.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
      refuse(morphology, "has more than 2147483647 segments; split the file");
  }

  /// Written anew, segments are numbered from 0 and named by their section.
  void count_names() {
    std::size_t named = 0;
    for (std::size_t i = 0; i < segments_.size(); ++i)
      named += segments_[i].id != std::int64_t(i) || !attribute(segments_[i].node, "name").empty();
    if (named)
      oddities_.add(NeuromlOddity::names_not_kept, line(segments_[0]), [&] {
        return fmt::format("{} segments have names or numbers of their own, and so may groups of them",
                           named);
      });
  }

  std::size_t find(std::string_view id) const {
    std::int64_t number = 0;
    if (!parse(id, number)) return none;
    const auto found = index_.find(number);
    return found == index_.end() ? none : found->second;
  }

  void find_parents() {
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      Segment& s = segments_[i];
      if (!s.has_parent) continue;
      xml_node node;
      for (const xml_node& part : s.node.children())
        if (local(part) == "parent") node = part;
      s.parent = find(attribute(node, "segment"));
      if (s.parent == none)
        oddities_.add(NeuromlOddity::missing_parent, document_.line(node),
                      [&] { return fmt::format("the parent of segment {} is not there", s.id); });
      if (s.parent == i) refuse(node, fmt::format("segment {} is its own parent; correct that", s.id));
      if (s.parent != none && s.parent > i)
        oddities_.add(NeuromlOddity::child_first, line(s),
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
          refuse(segments_[at].node,
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

  static Point between(const Point& a, const Point& b, float t) {
    if (t == 0.f || t == 1.f) return t == 0.f ? a : b;
    const auto mix = [t](float from, float to) {
      return float(double(from) + double(t) * (double(to) - double(from)));
    };
    return {mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z), mix(a.radius, b.radius)};
  }
  Point joint(const Segment& s) const {
    const Segment& parent = segments_[s.parent];
    return between(parent.proximal, parent.distal, s.fraction);
  }

  void mend(Point& p, const Point& before, const Segment& s) {
    bool unknown = false;
    for (float Point::*number : {&Point::x, &Point::y, &Point::z, &Point::radius})
      if (!std::isfinite(p.*number)) p.*number = before.*number, unknown = true;
    if (unknown)
      oddities_.add(NeuromlOddity::unknown_number, line(s),
                    [&] { return fmt::format("a number of segment {} is not finite", s.id); });
    if (p.radius < 0.f) {
      oddities_.add(NeuromlOddity::diameter, line(s),
                    [&] { return fmt::format("a diameter of segment {} is negative", s.id); });
      p.radius = before.radius;
    }
    if (p.radius == 0.f)
      oddities_.add(NeuromlOddity::zero_diameter, line(s),
                    [&] { return fmt::format("a diameter of segment {} is 0", s.id); });
  }

  void ends() {
    for (const std::size_t i : order_) {
      Segment& s = segments_[i];
      const Point before = s.parent == none ? Point{} : joint(s);
      if (s.has_proximal) {
        mend(s.proximal, before, s);
        mend(s.distal, s.proximal, s);
      } else if (s.parent != none) {
        s.proximal = before;
        mend(s.distal, s.proximal, s);
      } else {
        mend(s.distal, before, s);
        s.proximal = s.distal;
        oddities_.add(NeuromlOddity::missing_proximal, line(s),
                      [&] { return fmt::format("segment {} has neither parent nor proximal point", s.id); });
      }
    }
  }

  void add_segment(Group& group, const xml_node& part, const char* name) {
    const std::size_t segment = find(attribute(part, name));
    if (segment == none)
      oddities_.add(NeuromlOddity::group, document_.line(part),
                    [&] { return fmt::format("a segment that group {} names is not there", group.id); });
    else
      group.segments.push_back(segment);
  }

  void groups(const xml_node& morphology) {
    std::unordered_map<std::string, std::size_t> by_id;
    for (const xml_node& node : morphology.children()) {
      if (local(node) != "segmentGroup") continue;
      by_id.emplace(std::string(attribute(node, "id")), groups_.size());
      groups_.push_back(
          {node, std::string(attribute(node, "id")), std::string(attribute(node, "neuroLexId")), {}});
    }
    std::vector<std::vector<std::size_t>> included(groups_.size());
    std::vector<std::vector<std::size_t>> children;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      Group& group = groups_[g];
      for (const xml_node& part : group.node.children()) {
        const std::string_view kind = local(part);
        if (kind == "member") {
          add_segment(group, part, "segment");
        } else if (kind == "include") {
          const auto other = by_id.find(std::string(attribute(part, "segmentGroup")));
          if (other == by_id.end())
            oddities_.add(NeuromlOddity::group, document_.line(part), [&] {
              return fmt::format("a group that group {} includes is not there", group.id);
            });
          else
            included[g].push_back(other->second);
        } else if (kind == "path" || kind == "subTree") {
          if (children.empty()) {
            children.resize(segments_.size());
            for (const std::size_t i : order_)
              if (segments_[i].parent != none) children[segments_[i].parent].push_back(i);
          }
          path(group, part, kind == "path", children);
        }
      }
    }
    // The groups that a group includes, and those that they include, each once.
    std::vector<std::size_t> own(groups_.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) own[g] = groups_[g].segments.size();
    constexpr std::size_t most_steps = 20'000'000;  // groups that include each other many times over
    std::size_t steps = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      std::vector<std::size_t> stack = included[g];
      std::vector<bool> seen(stack.empty() ? 0 : groups_.size(), false);
      if (!stack.empty()) seen[g] = true, steps += groups_.size() / 64;
      while (!stack.empty()) {
        const std::size_t other = stack.back();
        stack.pop_back();
        if (seen[other]) continue;
        seen[other] = true;
        if ((steps += 1 + own[other] + included[other].size()) > most_steps)
          refuse(groups_[g].node, "has groups that include one another too often; remove those not needed");
        // Only its own: what it took from others is reached through them.
        for (std::size_t k = 0; k < own[other]; ++k) {
          const std::size_t segment = groups_[other].segments[k];
          groups_[g].segments.push_back(segment);
        }
        stack.insert(stack.end(), included[other].begin(), included[other].end());
      }
    }
  }

  /// path: from one segment down to another. subTree: a segment and all that hangs on it.
  void path(Group& group, const xml_node& node, bool is_path,
            const std::vector<std::vector<std::size_t>>& children) {
    std::size_t from = none, to = none;
    for (const xml_node& part : node.children()) {
      if (local(part) == "from") from = find(attribute(part, "segment"));
      if (local(part) == "to") to = find(attribute(part, "segment"));
    }
    if ((to_steps_ += 1) > 100'000)
      refuse(node, "has more than 100000 paths and subtrees; list segments as members");
    if (!is_path || to == none) {
      if (from == none) return;
      std::vector<std::size_t> stack{from};
      while (!stack.empty()) {
        const std::size_t at = stack.back();
        stack.pop_back();
        group.segments.push_back(at);
        walked(node);
        stack.insert(stack.end(), children[at].begin(), children[at].end());
      }
      return;
    }
    for (std::size_t at = to; at != none; at = segments_[at].parent) {
      group.segments.push_back(at);
      walked(node);
      if (at == from) return;
    }
  }
  void walked(const xml_node& node) {
    if (++walked_ > 50'000'000)
      refuse(node, "has too many long paths and subtrees; list segments as members");
  }

  static Meaning look_up(std::span<const GroupWord> words, std::string_view text) {
    const auto row = std::ranges::find(words, text, &GroupWord::word);
    return row == words.end() ? Meaning::none : row->meaning;
  }
  static Meaning beginning(std::string_view text) {
    const std::string name = lower(text);
    for (const GroupWord& row : name_beginnings)
      if (name.starts_with(row.word)) return row.meaning;
    return Meaning::none;
  }

  /// "custom_9_group", as write_neuroml names what others have no word for.
  static std::optional<std::pair<SectionKind, std::int32_t>> own_kind(std::string_view id) {
    constexpr std::string_view end = "_group";
    if (!id.ends_with(end)) return std::nullopt;
    id.remove_suffix(end.size());
    const std::size_t bar = id.rfind('_');
    if (bar == id.npos) return std::nullopt;
    std::string_view number = id.substr(bar + 1);
    const bool minus = number.starts_with('m');
    if (minus) number.remove_prefix(1);
    std::int64_t tag = 0;
    const SectionKind kind = section_kind(id.substr(0, bar));
    if (name_of(kind) != id.substr(0, bar) || !parse(number, tag) || tag < 0 || tag > 0x80000000ll - !minus)
      return std::nullopt;
    return std::pair{kind, std::int32_t(minus ? -tag : tag)};
  }

  void kinds() {
    std::size_t others = 0;
    xml_node other;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const Group& group = groups_[g];
      const bool section = group.lex == section_lex;
      const Meaning by_lex = look_up(group_words, lower(group.lex));
      const Meaning meaning = section                   ? Meaning::none
                              : by_lex != Meaning::none ? by_lex
                                                        : look_up(group_words, lower(group.id));
      const auto kind = own_kind(group.id);
      if (!section && !kind && meaning == Meaning::none && lower(group.id) != "all") {
        if (others++ == 0) other = group.node;
      }
      for (const std::size_t i : group.segments) {
        Segment& s = segments_[i];
        if (section) s.section = g;
        if (kind) s.kind = kind;
        s.meaning = std::max(s.meaning, meaning);
      }
    }
    if (others)
      oddities_.add(NeuromlOddity::groups_not_kept, document_.line(other), [&] {
        return fmt::format("{} groups of segments, {} and others, mean no kind", others,
                           attribute(other, "id").substr(0, 40));
      });
    for (Segment& s : segments_) {
      if (s.kind || s.meaning > Meaning::dendrite) continue;
      Meaning named = s.section == none ? Meaning::none : beginning(groups_[s.section].id);
      if (named == Meaning::none && !to_the_letter_) named = beginning(attribute(s.node, "name"));
      const bool dendrite = named == Meaning::apical || named == Meaning::basal;
      if (s.meaning == Meaning::none || dendrite) s.meaning = std::max(s.meaning, named);
    }
    // A lone ball that nothing is said of: a soma.
    const bool said =
        std::ranges::any_of(segments_, [](const Segment& s) { return s.meaning == Meaning::soma; });
    if (said || to_the_letter_) return;
    for (Segment& s : segments_)
      if (s.parent == none && s.meaning == Meaning::none && s.has_proximal && s.proximal == s.distal) {
        s.meaning = Meaning::soma;
        return;
      }
  }

  void find_soma() {
    soma_points_.assign(segments_.size(), {});
    std::vector<std::size_t> parts;
    for (const std::size_t i : order_) {
      Segment& s = segments_[i];
      if (s.meaning != Meaning::soma) continue;
      if (s.parent != none && segments_[s.parent].meaning != Meaning::soma) {
        oddities_.add(NeuromlOddity::soma_inside_neurite, line(s),
                      [&] { return fmt::format("segment {} of the soma hangs on a neurite", s.id); });
        s.meaning = Meaning::none;
        continue;
      }
      parts.push_back(i);
    }
    if (parts.empty()) return;
    for (const Segment& s : segments_)
      if (s.parent != none && is_soma(s.parent) && s.fraction > 0.f && s.fraction < 1.f)
        segments_[s.parent].splits.push_back(s.fraction);
    const auto is_ball = [&](const Segment& s) {
      return s.proximal == s.distal && (!to_the_letter_ || attribute(s.node, "name") == sphere_name);
    };
    if (parts.size() == 1 && is_ball(segments_[parts[0]])) {
      soma_ = {.kind = SomaKind::sphere,
               .points = {segments_[parts[0]].distal},
               .parents = {},
               .contour_starts = {}};
      soma_points_[parts[0]].assign(segments_[parts[0]].splits.size() + 2, 0);
      return;
    }
    soma_.kind = SomaKind::cylinders;
    const auto add = [&](const Point& p, std::int32_t parent) {
      soma_.points.push_back(p);
      soma_.parents.push_back(parent);
      return std::int32_t(soma_.points.size()) - 1;
    };
    for (const std::size_t i : parts) {
      Segment& s = segments_[i];
      sort_splits(s);
      std::int32_t begin = -1;
      if (s.parent != none) {
        begin = soma_point_of(s);
        if (!(soma_.points[std::size_t(begin)] == s.proximal)) begin = add(s.proximal, begin);
      } else {
        if (!soma_.points.empty())
          oddities_.add(NeuromlOddity::several_somata, line(s),
                        [&] { return fmt::format("segment {} is a second soma", s.id); });
        begin = add(s.proximal, soma_.points.empty() ? -1 : 0);
      }
      std::vector<std::int32_t>& along = soma_points_[i];
      along.push_back(begin);
      for (const float split : s.splits)
        along.push_back(add(between(s.proximal, s.distal, split), along.back()));
      along.push_back(add(s.distal, along.back()));
    }
  }

  static void sort_splits(Segment& s) { s.splits = distinct(std::move(s.splits)); }

  /// The soma point that a child of the soma hangs on.
  std::int32_t soma_point_of(const Segment& child) const {
    const auto& along = soma_points_[child.parent];
    if (child.fraction <= 0.f) return along.front();
    const auto& splits = segments_[child.parent].splits;
    return along[1 + std::size_t(std::ranges::lower_bound(splits, child.fraction) - splits.begin())];
  }

  /// The kind and number of a segment.
  static std::pair<SectionKind, std::int32_t> kind_of(const Segment& s) {
    if (s.kind) return *s.kind;
    const SectionKind kind = s.meaning == Meaning::axon     ? SectionKind::axon
                             : s.meaning == Meaning::apical ? SectionKind::apical
                             : s.meaning == Meaning::none   ? SectionKind::undefined
                                                            : SectionKind::basal;
    return {kind, std::int32_t(kind)};
  }

  bool is_soma(std::size_t i) const { return segments_[i].meaning == Meaning::soma; }

  /// Segments are cut where children hang on them; pieces that continue one another make a section.
  void sections() {
    // At the beginning of a segment is the end of its parent, or the beginning of a tree.
    for (const std::size_t i : order_) {
      Segment& s = segments_[i];
      while (s.parent != none && s.fraction == 0.f && !is_soma(s.parent)) {
        const Segment& parent = segments_[s.parent];
        s.fraction = parent.fraction;
        s.parent = parent.parent;
      }
      if (s.parent != none && !is_soma(s.parent) && s.fraction < 1.f)
        segments_[s.parent].splits.push_back(s.fraction);
    }
    struct Place {
      std::size_t run = none;
      std::size_t children = 0;
    };
    std::vector<std::vector<Place>> places(segments_.size());  // after each piece
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      auto& splits = segments_[i].splits;
      sort_splits(segments_[i]);
      places[i].resize(splits.size() + 1);
      for (std::size_t k = 0; k < splits.size(); ++k)
        places[i][k].children = 1;  // what is left of the segment
    }
    const auto place_of = [&](const Segment& s) -> Place& {
      const auto& splits = segments_[s.parent].splits;
      return places[s.parent][std::size_t(std::ranges::lower_bound(splits, s.fraction) - splits.begin())];
    };
    for (const Segment& s : segments_)
      if (s.parent != none && !is_soma(s.parent) && !is_soma(std::size_t(&s - segments_.data())))
        ++place_of(s).children;

    bool rooted = soma_.kind != SomaKind::none;
    for (const std::size_t i : order_) {
      const Segment& s = segments_[i];
      if (is_soma(i)) continue;
      const auto [kind, tag] = kind_of(s);
      std::size_t run = none;
      const bool root = s.parent == none || is_soma(s.parent);
      const bool named = to_the_letter_ && attribute(s.node, "name") == stump_name && s.proximal == s.distal;
      const bool stump = root && (named || (s.parent == none && !s.has_proximal));
      if (root) {
        run = begin_run(none, kind, tag, s.section);
        if (s.parent != none) {
          runs_[run].soma_point = soma_point_of(s);
        } else if (std::exchange(rooted, true) && !to_the_letter_) {
          oddities_.add(NeuromlOddity::several_roots, line(s),
                        [&] { return fmt::format("segment {} has no parent either", s.id); });
        }
      } else {
        const Place& place = place_of(s);
        const Run& above = runs_[place.run];
        const bool same =
            place.children == 1 && above.kind == kind && above.tag == tag && above.section == s.section;
        run = same ? place.run : begin_run(place.run, kind, tag, s.section);
        const Point at = joint(s);
        const bool gap = s.proximal.x != at.x || s.proximal.y != at.y || s.proximal.z != at.z;
        if (gap)
          oddities_.add(NeuromlOddity::gap, line(s),
                        [&] { return fmt::format("segment {} does not begin where it hangs on", s.id); });
        if (run != place.run && gap) runs_[run].points.push_back(at);
      }
      auto& points = runs_[run].points;
      if (points.empty() || !(points.back() == s.proximal)) points.push_back(s.proximal);
      for (std::size_t k = 0; k <= s.splits.size(); ++k) {
        if (k)
          run = begin_run(run, kind, tag, s.section),
          runs_[run].points.push_back(runs_[runs_[run].parent].points.back());
        const bool last = k == s.splits.size();
        if (!stump) runs_[run].points.push_back(last ? s.distal : between(s.proximal, s.distal, s.splits[k]));
        places[i][k].run = run;
      }
    }
  }

  std::size_t begin_run(std::size_t parent, SectionKind kind, std::int32_t tag, std::size_t section) {
    runs_.push_back({kind, tag, parent, section, -1, {}});
    return runs_.size() - 1;
  }

  const Document& document_;
  Oddities& oddities_;
  const bool to_the_letter_;
  std::vector<Segment> segments_;
  std::unordered_map<std::int64_t, std::size_t> index_;
  std::vector<std::size_t> order_;
  std::vector<Group> groups_;
  std::size_t to_steps_ = 0, walked_ = 0;
  Soma soma_;
  // Of a soma segment: those of its beginning, of the places where children hang on, and of its end.
  std::vector<std::vector<std::int32_t>> soma_points_;
  std::vector<Run> runs_;
};

void read_notes(const xml_node& owner, MorphologyBuilder& builder) {
  for (const xml_node& node : owner.children())
    if (local(node) == "notes")
      if (const std::string_view text = trimmed(node.text().get(), xml_blanks); !text.empty())
        builder.annotate("notes", std::string(text));
}

void read_properties(const xml_node& owner, MorphologyBuilder& builder, std::vector<Spine>& spines) {
  for (const xml_node& node : owner.children()) {
    if (local(node) != "property") continue;
    const std::string_view tag = attribute(node, "tag"), value = attribute(node, "value");
    if (tag == marker_tag) continue;
    if (tag == encoded_tag) {
      const std::size_t blank = value.find(' ');
      builder.annotate(percent_decoded(value.substr(0, blank)),
                       blank == value.npos ? "" : percent_decoded(value.substr(blank + 1)));
    } else if (tag == spine_tag) {
      std::array<float, 8> n{};
      std::size_t count = 0;
      for (std::string_view rest = value; !rest.empty() && count < n.size(); ++count) {
        const std::size_t blank = std::min(rest.find(' '), rest.size());
        if (!parse(rest.substr(0, blank), n[count]) || !std::isfinite(n[count])) break;
        rest.remove_prefix(std::min(blank + 1, rest.size()));
      }
      if (count != n.size() || n[0] < 0.f || n[0] > 1e7f || n[7] < 0.f ||
          n[7] > float(SpineShape::branched)) {
        builder.annotate(std::string(tag), std::string(value));
        continue;
      }
      spines.push_back({SectionId(std::size_t(n[0])), n[1], Vec3(n[2], n[3], n[4]), n[5], n[6],
                        static_cast<SpineShape>(n[7])});
    } else {
      builder.annotate(std::string(tag), std::string(value));
    }
  }
}

bool has_marker(const xml_node& cell) {
  for (const xml_node& node : cell.children())
    if (local(node) == "property" && attribute(node, "tag") == marker_tag &&
        attribute(node, "value") == marker_value)
      return true;
  return false;
}

/// A cell with its morphology, which may stand elsewhere in the file, or a morphology alone.
struct Place {
  xml_node cell, morphology;
};

ReadResult read_cell(const Document& document, const Place& place, Oddities& oddities) {
  try {
    MorphologyBuilder builder;
    std::vector<Spine> spines;
    const bool ours = has_marker(place.cell);
    read_notes(document.root(), builder);  // what is said of the file is said of each of its cells
    for (const xml_node& owner : {place.cell, place.morphology})
      if (owner) {
        read_notes(owner, builder);
        read_properties(owner, builder, spines);
        for (const xml_node& node : owner.children()) {
          const std::string_view kind = local(node);
          if (node.type() == pugi::node_element && kind != "notes" && kind != "property" &&
              kind != "morphology" && kind != "segment" && kind != "segmentGroup")
            oddities.add(NeuromlOddity::not_kept, document.line(node),
                         [&] { return fmt::format("there is <{}>", kind.substr(0, 40)); });
        }
      }
    if (place.morphology) Assembler(document, oddities, ours).read(place.morphology, builder);
    for (const Spine& s : spines) builder.add_spine(s);
    Morphology morphology = builder.build();
    return {std::move(morphology), oddities.take()};
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(document.name(), document.line(place.morphology), error.what());
  }
}

/// What of the file can be read as neurons; tells what cannot.
std::vector<Place> find_cells(const Document& document, Oddities& oddities) {
  std::map<std::string_view, xml_node> loose;
  std::map<std::string_view, bool> used;
  std::vector<Place> places;
  for (xml_node next = document.root().next_sibling(); next; next = next.next_sibling())
    if (next.type() == pugi::node_element)
      oddities.add(NeuromlOddity::several_documents, document.line(next),
                   "another document follows the first");
  for (const xml_node& node : document.root().children())
    if (local(node) == "morphology") loose.emplace(attribute(node, "id"), node);
  for (const xml_node& node : document.root().children()) {
    const std::string_view kind = local(node);
    if (kind == "cell" || kind == "cell2CaPools") {
      xml_node morphology;
      for (const xml_node& part : node.children())
        if (local(part) == "morphology") morphology = part;
      const std::string_view reference = attribute(node, "morphology");
      if (const auto found = loose.find(reference);
          !morphology && !reference.empty() && found != loose.end()) {
        morphology = found->second;
        used[reference] = true;
      }
      if (morphology || has_marker(node))
        places.push_back({node, morphology});
      else
        oddities.add(NeuromlOddity::elsewhere, document.line(node), [&] {
          return fmt::format("the morphology of cell {} is not in this file",
                             attribute(node, "id").substr(0, 40));
        });
    } else if (kind == "include") {
      oddities.add(NeuromlOddity::include, document.line(node),
                   [&] { return fmt::format("{} is included", attribute(node, "href").substr(0, 80)); });
    } else if (node.type() == pugi::node_element && kind != "morphology" && kind != "notes") {
      oddities.add(NeuromlOddity::not_kept, document.line(node),
                   [&] { return fmt::format("there is <{}>", kind.substr(0, 40)); });
    }
  }
  for (const xml_node& node : document.root().children())
    if (local(node) == "morphology" && !used.contains(attribute(node, "id"))) places.push_back({{}, node});
  if (places.empty())
    throw NotANeuron(document.name(), 0,
                     oddities.has(NeuromlOddity::elsewhere)
                         ? "holds cells whose morphology is in another file; read that one"
                         : "holds no cell with a morphology; give a file that does");
  return places;
}

}  // namespace

std::span<const Oddity> neuroml_oddities() { return table; }

bool recognises_neuroml(std::string_view bytes) { return first_element(bytes) == "neuroml"; }

ReadResult read_neuroml(std::string_view bytes, const std::string& name) {
  const Document document(bytes, name);
  Oddities oddities(table);
  const std::vector<Place> places = find_cells(document, oddities);
  if (places.size() > 1)
    oddities.add(NeuromlOddity::several_cells, 0,
                 [&] { return fmt::format("there are {} cells", places.size()); });
  return read_cell(document, places[0], oddities);
}

std::vector<Cell> read_all_neuroml(std::string_view bytes, const std::string& name) {
  const Document document(bytes, name);
  Oddities first(table);
  const std::vector<Place> places = find_cells(document, first);
  std::vector<Cell> cells;
  for (const Place& place : places) {
    Oddities others(table);
    const std::string_view id = attribute(place.cell ? place.cell : place.morphology, "id");
    cells.push_back({std::string(id), read_cell(document, place, cells.empty() ? first : others)});
  }
  return cells;
}

}  // namespace forest::io
