// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml_groups.h"

#include <algorithm>
#include <array>
#include <span>

#include <fmt/format.h>

#include "forest/core/lower.h"
#include "forest/io/neuroml_names.h"

namespace forest::io::neuroml {
namespace {

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

struct Group {
  xml_node node;
  std::string id, lex;
  std::vector<std::size_t> segments;
};

class Reader {
 public:
  explicit Reader(Segments& all)
      : all_(all), document_(all.document), oddities_(all.oddities), segments_(all.list), order_(all.order) {}

  void read(const xml_node& morphology) {
    groups(morphology);
    kinds();
  }

 private:
  void add_segment(Group& group, const xml_node& part, const char* name) {
    const std::size_t segment = all_.find(attribute(part, name));
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
          all_.refuse(groups_[g].node,
                      "has groups that include one another too often; remove those not needed");
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
      if (local(part) == "from") from = all_.find(attribute(part, "segment"));
      if (local(part) == "to") to = all_.find(attribute(part, "segment"));
    }
    if ((to_steps_ += 1) > 100'000)
      all_.refuse(node, "has more than 100000 paths and subtrees; list segments as members");
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
      all_.refuse(node, "has too many long paths and subtrees; list segments as members");
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
      if (named == Meaning::none && !all_.to_the_letter) named = beginning(attribute(s.node, "name"));
      const bool dendrite = named == Meaning::apical || named == Meaning::basal;
      if (s.meaning == Meaning::none || dendrite) s.meaning = std::max(s.meaning, named);
    }
    // A lone ball that nothing is said of: a soma.
    const bool said =
        std::ranges::any_of(segments_, [](const Segment& s) { return s.meaning == Meaning::soma; });
    if (said || all_.to_the_letter) return;
    for (Segment& s : segments_)
      if (s.parent == none && s.meaning == Meaning::none && s.has_proximal && s.proximal == s.distal) {
        s.meaning = Meaning::soma;
        return;
      }
  }

  Segments& all_;
  const Document& document_;
  Oddities& oddities_;
  std::vector<Segment>& segments_;
  const std::vector<std::size_t>& order_;
  std::vector<Group> groups_;
  std::size_t to_steps_ = 0, walked_ = 0;
};

}  // namespace

void read_groups(const xml_node& morphology, Segments& segments) { Reader(segments).read(morphology); }

}  // namespace forest::io::neuroml
