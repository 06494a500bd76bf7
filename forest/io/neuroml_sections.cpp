// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml_sections.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/distinct.h"
#include "forest/io/neuroml_names.h"

namespace forest::io::neuroml {
namespace {

class Assembler {
 public:
  explicit Assembler(Segments& all)
      : all_(all), oddities_(all.oddities), segments_(all.list), order_(all.order) {}

  void add_to(MorphologyBuilder& builder) {
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
  struct Run {  // of segments: a section
    SectionKind kind = SectionKind::undefined;
    std::int32_t tag = 0;
    std::size_t parent = none, section = none;
    std::int32_t soma_point = -1;
    std::vector<Point> points;
  };

  void find_soma() {
    soma_points_.assign(segments_.size(), {});
    std::vector<std::size_t> parts;
    for (const std::size_t i : order_) {
      Segment& s = segments_[i];
      if (s.meaning != Meaning::soma) continue;
      if (s.parent != none && segments_[s.parent].meaning != Meaning::soma) {
        oddities_.add(NeuromlOddity::soma_inside_neurite, all_.line(s),
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
      return s.proximal == s.distal && (!all_.to_the_letter || attribute(s.node, "name") == sphere_name);
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
          oddities_.add(NeuromlOddity::several_somata, all_.line(s),
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
      const bool named =
          all_.to_the_letter && attribute(s.node, "name") == stump_name && s.proximal == s.distal;
      const bool stump = root && (named || (s.parent == none && !s.has_proximal));
      if (root) {
        run = begin_run(none, kind, tag, s.section);
        if (s.parent != none) {
          runs_[run].soma_point = soma_point_of(s);
        } else if (std::exchange(rooted, true) && !all_.to_the_letter) {
          oddities_.add(NeuromlOddity::several_roots, all_.line(s),
                        [&] { return fmt::format("segment {} has no parent either", s.id); });
        }
      } else {
        const Place& place = place_of(s);
        const Run& above = runs_[place.run];
        const bool same =
            place.children == 1 && above.kind == kind && above.tag == tag && above.section == s.section;
        run = same ? place.run : begin_run(place.run, kind, tag, s.section);
        const Point at = all_.joint(s);
        const bool gap = s.proximal.x != at.x || s.proximal.y != at.y || s.proximal.z != at.z;
        if (gap)
          oddities_.add(NeuromlOddity::gap, all_.line(s),
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

  Segments& all_;
  Oddities& oddities_;
  std::vector<Segment>& segments_;
  const std::vector<std::size_t>& order_;
  Soma soma_;
  // Of a soma segment: those of its beginning, of the places where children hang on, and of its end.
  std::vector<std::vector<std::int32_t>> soma_points_;
  std::vector<Run> runs_;
};

}  // namespace

void add_sections(Segments& segments, MorphologyBuilder& builder) { Assembler(segments).add_to(builder); }

}  // namespace forest::io::neuroml
