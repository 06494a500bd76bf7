// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

constexpr float dot_limit = 24.f;  // a soma of a larger radius, in pixels, is drawn as a capsule
constexpr float group_limit =
    12.f;               // groups of a cluster of a larger radius, in pixels, are looked at one by one
constexpr int few = 8;  // segments of a cluster; its groups are not looked at for so few
constexpr std::size_t chunk = 64;  // neurons; fixed, so that the result does not depend on threads

frame::Item item(std::uint32_t instance, std::uint32_t first, std::uint32_t drawn, const Sphere& sphere) {
  return {instance, first, drawn, 0, sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), sphere.radius};
}

constexpr std::uint32_t soma = 0xffffffffu;  // LeftOut::cluster
constexpr std::uint32_t every_group = (1u << Cluster::group_count) - 1u;

// What is looked at, by whom, and what is known to be hidden.
struct Look {
  const Forest& forest;
  std::span<const Sight> sights;
  bool keep;  // what is hidden
  const Shown& shown;

  frame::State state(std::uint32_t index) const {
    return shown.states.empty() ? frame::State{} : shown.states[index];
  }
};

// Adds a run to the list that it belongs to, drawn as `kind` or, for `any`, by its width in pixels.
void add(Cut& cut, const frame::Item& run, frame::Kind kind, bool thin) {
  if (!run.drawn) return;
  switch (kind) {
    case frame::Kind::somata:
      return;
    case frame::Kind::dots:
      for (std::uint32_t drawn = run.drawn; drawn; drawn &= drawn - 1) {
        cut.dots.push_back(run);
        cut.dots.back().first_segment += std::uint32_t(std::countr_zero(drawn)), cut.dots.back().drawn = 1;
      }
      break;
    default:
      (kind == frame::Kind::lines || (kind == frame::Kind::any && thin) ? cut.lines : cut.capsules)
          .push_back(run);
  }
  cut.segments += std::uint32_t(std::popcount(run.drawn));
}

// A leaf of a neuron with parts: runs of segments of one state.
void add_parts(const Look& look, std::uint32_t index, const Cluster& leaf, const Sphere& sphere, bool thin,
               std::span<const frame::State* const> states, Cut& cut) {
  const Neuron& neuron = look.forest.neurons()[look.forest.instances()[index].morphology];
  const frame::State whole = look.state(index);
  const auto state_of = [&](std::uint32_t segment) -> const frame::State* {
    const std::uint32_t section =
        look.forest.section_of_segment()[neuron.first_original + segment - neuron.first_segment];
    return section == soma_section ? nullptr : states[section];
  };
  for (std::uint32_t rest = leaf.all(), drawn; rest; rest &= ~drawn) {
    const frame::State* state = state_of(leaf.first_segment + std::uint32_t(std::countr_zero(rest)));
    drawn = 0;
    for (std::uint32_t i = 0; i < leaf.segment_count; ++i)
      drawn |= std::uint32_t(state_of(leaf.first_segment + i) == state) << i;
    if (!(state ? *state : whole).is(frame::State::visible)) continue;
    frame::Item run = item(index, leaf.first_segment, drawn, sphere);
    if (state) run.state = frame::packed(*state);
    add(cut, run, (state ? *state : whole).kind, thin);
  }
}

// A sphere as all sights see it, and as the camera of the pictures before saw it; that once somebody asks.
class Judged {
 public:
  Judged(const Look& look, const Sphere& sphere)
      : sphere_(sphere), seen_(look.sights.front().eye.see(sphere)) {}

  const Seen& seen() const { return seen_; }
  bool hidden(const Sight& sight) {
    if (!sight.before) return false;
    if (!before_) before_ = sight.before->see(sphere_);
    return sight.before->hide(*before_);
  }

 private:
  const Sphere& sphere_;
  Seen seen_;
  std::optional<Seen> before_;
};

// Calls take(i) for each of a set of sights, a bit for each.
void each_of(std::uint32_t sights, auto&& take) {
  for (; sights; sights &= sights - 1) take(std::size_t(std::countr_zero(sights)));
}

// Of a cluster that is good enough, these groups.
void choose_groups(const Look& look, const Sight& sight, std::uint32_t index, std::uint32_t at,
                   std::uint32_t groups, const Placed& placed, const Sphere& sphere, const Seen& seen,
                   Cut& cut) {
  const Cluster& c = look.forest.clusters()[at];
  const frame::Kind kind = look.state(index).kind;
  const auto shown = [&](const Seen& where) {
    const float thinnest = sight.eye.detail().thinnest;
    return thinnest > 0.f ? c.visible_at(sight.eye.magnification(where) / thinnest) : c.all();
  };
  const std::uint32_t all = shown(seen);
  if (groups == every_group &&
      (std::popcount(all) <= few || sphere.radius * sight.eye.magnification(seen) <= group_limit))
    return add(cut, item(index, c.first_segment, all, sphere), kind, sight.eye.thin(seen, c.thickness));
  std::uint32_t hidden = 0;
  for (std::uint32_t g = 0; g < Cluster::group_count; ++g) {
    const std::uint32_t first = g * Cluster::group_size;
    if (!(groups >> g & 1u) || first >= c.segment_count) continue;
    const Sphere around = placed(c.group(g));
    Judged judged(look, around);
    if (!sight.eye.may_see(judged.seen())) continue;
    const std::uint32_t drawn = shown(judged.seen()) >> first & 255u;
    if (!drawn) continue;
    if (judged.hidden(sight))
      hidden |= 1u << g;
    else
      add(cut, item(index, c.first_segment + first, drawn, around), kind,
          sight.eye.thin(judged.seen(), c.thickness));
  }
  if (hidden && look.keep) cut.left_out.push_back({index, at, hidden});
}

// For each sight, from one cluster on; returns which of them may see it.
std::uint32_t choose_clusters(const Look& look, std::uint32_t index, std::uint32_t from,
                              std::span<Cut> cuts) {
  const std::uint32_t all = frame::first_segments(look.sights.size());
  const Placed placed(look.forest.instances()[index]);
  const auto clusters = look.forest.clusters();
  const frame::State state = look.state(index);
  const bool parted =
      state.is(frame::State::parted);  // drawn in full: coarse clusters do not know their branches
  const auto states =
      parted ? section_states(look.forest, look.shown, index) : std::vector<const frame::State*>();
  if (state.kind == frame::Kind::somata && !parted) return all;
  struct Open {
    std::uint32_t cluster, sights;  // those for which its parent was too coarse
  };
  std::array<Open, 64> open;
  std::size_t depth = 0;
  std::uint32_t may_see = 0;
  open[depth++] = {from, all};
  while (depth) {
    const auto [at, sights] = open[--depth];
    const Cluster& c = clusters[at];
    const Sphere sphere = placed(c);
    Judged judged(look, sphere);
    const Seen& seen = judged.seen();
    std::uint32_t finer = 0;
    each_of(sights, [&](std::size_t s) {
      const Sight& sight = look.sights[s];
      Cut& cut = cuts[s];
      if (!sight.eye.may_see(seen)) return;
      if (at == from) may_see |= 1u << s;
      if (judged.hidden(sight)) {
        if (look.keep) cut.left_out.push_back({index, at, 0});
      } else if (!c.is_leaf() && depth + 2 <= open.size() &&
                 (parted || !sight.eye.good_enough(seen, c.error))) {
        finer |= 1u << s;
      } else if (parted) {
        add_parts(look, index, c, sphere, sight.eye.thin(seen, c.thickness), states, cut);
      } else {
        choose_groups(look, sight, index, at, every_group, placed, sphere, seen, cut);
      }
    });
    if (!finer) continue;
    open[depth++] = {c.children[1], finer};
    open[depth++] = {c.children[0], finer};
  }
  return may_see;
}

void choose_soma(const Look& look, std::uint32_t index, std::uint32_t sights, std::span<Cut> cuts) {
  const frame::Instance& instance = look.forest.instances()[index];
  const Neuron& neuron = look.forest.neurons()[instance.morphology];
  const Sphere sphere{{instance.x, instance.y, instance.z}, neuron.soma_radius};
  if (!(neuron.soma_radius > 0.f)) return;
  frame::Item ball = item(index, neuron.first_segment, 1, sphere);
  const frame::State state = look.state(index);
  if (state.is(frame::State::parted)) {
    for (const Part& part : std::ranges::equal_range(look.shown.parts, index, {}, &Part::instance))
      if (part.section == soma_section) ball.state = frame::packed(part.state);
    if (!(ball.state ? frame::unpacked(ball.state) : state).is(frame::State::visible)) return;
  }
  Judged judged(look, sphere);
  each_of(sights, [&](std::size_t s) {
    const Sight& sight = look.sights[s];
    if (!sight.eye.may_see(judged.seen())) return;
    if (judged.hidden(sight)) {
      if (look.keep) cuts[s].left_out.push_back({index, soma, 0});
      return;
    }
    const bool large = neuron.soma_radius * sight.eye.magnification(judged.seen()) > dot_limit;
    (large ? cuts[s].capsules : cuts[s].dots).push_back(ball);
    ++cuts[s].segments;
  });
}

void choose_neuron(const Look& look, std::uint32_t index, std::span<Cut> cuts) {
  if (!(look.state(index).flags & (frame::State::visible | frame::State::parted))) return;
  const Neuron& neuron = look.forest.neurons()[look.forest.instances()[index].morphology];
  if (!neuron.cluster_count) return;
  std::array<std::uint64_t, most_sights> before;
  std::ranges::transform(cuts, before.begin(), &Cut::segments);
  // The soma lies within its root.
  choose_soma(look, index, choose_clusters(look, index, neuron.first_cluster, cuts), cuts);
  for (std::size_t s = 0; s < cuts.size(); ++s) cuts[s].neurons += cuts[s].segments > before[s];
}

void append(auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); }

// What `choose_one(i, cuts)` adds to each of so many cuts for each i below `count`, in this order.
std::vector<Cut> in_chunks(std::size_t count, std::size_t cuts, auto&& choose_one) {
  std::vector<Cut> parts((count + chunk - 1) / chunk * cuts);
  parallel_for(parts.size() / cuts, 1, [&](std::size_t p) {
    for (std::size_t i = p * chunk; i < std::min(count, (p + 1) * chunk); ++i)
      choose_one(i, std::span(parts).subspan(p * cuts, cuts));
  });
  std::vector<Cut> whole(cuts);
  parallel_for(cuts, 1, [&](std::size_t c) {
    for (std::size_t p = c; p < parts.size(); p += cuts) {
      append(whole[c].dots, parts[p].dots);
      append(whole[c].lines, parts[p].lines);
      append(whole[c].capsules, parts[p].capsules);
      append(whole[c].left_out, parts[p].left_out);
      whole[c].segments += parts[p].segments;
      whole[c].neurons += parts[p].neurons;
    }
  });
  return whole;
}

// Sorts a list from near to far, in steps of a 1/64 octave, and returns where each step begins.
constexpr std::size_t steps = 64 * 24;
using Starts = std::array<std::uint32_t, steps + 1>;

// By the centre: a large sphere around the eye says little of where its branches are.
std::size_t step_of(const frame::Item& item, const Eye& eye) {
  const float depth = eye.nearest_depth({{item.x, item.y, item.z}, 0.f});
  return std::size_t(std::clamp(64.f * std::log2(depth / eye.camera().near), 0.f, float(steps - 1)));
}

Starts sort_near_to_far(std::vector<frame::Item>& list, const Eye& eye) {
  std::vector<std::uint16_t> step(list.size());
  parallel_for(list.size(), 4096, [&](std::size_t i) { step[i] = std::uint16_t(step_of(list[i], eye)); });
  Starts starts{};
  for (const std::uint16_t s : step) ++starts[s + 1u];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  Starts next = starts;
  std::vector<frame::Item> sorted(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) sorted[next[step[i]]++] = list[i];
  list = std::move(sorted);
  return starts;
}

// Bands grow by half each: what the near ones hide is then left out of the far ones.
std::vector<frame::Band> bands_of(const Starts& dots, const Starts& lines, const Starts& capsules) {
  const auto items_before = [&](std::size_t s) { return std::size_t(dots[s]) / 16 + lines[s] + capsules[s]; };
  const std::size_t total = items_before(steps);
  std::vector<frame::Band> bands;
  std::size_t next = std::max<std::size_t>(total / 24, 64);
  for (std::size_t s = 1; s <= steps; ++s) {
    if (s < steps && items_before(s) < next) continue;
    bands.push_back({dots[s], lines[s], capsules[s]});
    next = std::max(next + next / 2, items_before(s) + total / 24);
  }
  return bands;
}

}  // namespace

std::vector<const frame::State*> section_states(const Forest& forest, const Shown& shown,
                                                std::uint32_t index) {
  const Neuron& neuron = forest.neurons()[forest.instances()[index].morphology];
  std::vector<const frame::State*> states(neuron.section_count, nullptr);
  for (const Part& part : std::ranges::equal_range(shown.parts, index, {}, &Part::instance)) {
    if (part.section == soma_section) {
      std::ranges::fill(states, &part.state);
      continue;
    }
    std::vector<bool> inside(neuron.section_count);
    for (std::uint32_t s = part.section; s < neuron.section_count; ++s) {  // parents come first
      const std::uint32_t parent = forest.sections()[neuron.first_section + s].parent;
      inside[s] = s == part.section || (parent != 0xffffffffu && inside[parent]);
      if (inside[s]) states[s] = &part.state;
    }
  }
  return states;
}

std::vector<Cut> choose(const Forest& forest, std::span<const Sight> sights, const Shown& shown) {
  const Look look{forest, sights, true, shown};
  std::vector<Cut> cuts = in_chunks(forest.instances().size(), sights.size(), [&](std::size_t i, auto parts) {
    choose_neuron(look, std::uint32_t(i), parts);
  });
  parallel_for(cuts.size(), 1, [&](std::size_t s) {
    Cut& cut = cuts[s];
    const Eye& eye = sights[s].eye;
    const Starts dots = sort_near_to_far(cut.dots, eye), lines = sort_near_to_far(cut.lines, eye),
                 capsules = sort_near_to_far(cut.capsules, eye);
    cut.bands = bands_of(dots, lines, capsules);
  });
  return cuts;
}

Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport&, const Occluders* before,
           const Shown& shown) {
  const Sight sight{eye, before};
  return std::move(choose(forest, std::span(&sight, 1), shown).front());
}

Cut revealed(const Forest& forest, const Eye& eye, const frame::Viewport&, std::span<const LeftOut> left_out,
             const Occluders& now, const Shown& shown) {
  const Sight sight{eye, &now};
  const Look look{forest, std::span(&sight, 1), false, shown};
  return std::move(in_chunks(left_out.size(), 1, [&](std::size_t i, std::span<Cut> cut) {
                     const auto [instance, cluster, groups] = left_out[i];
                     if (cluster == soma) {
                       choose_soma(look, instance, 1, cut);
                     } else if (groups) {
                       const Placed placed(forest.instances()[instance]);
                       const Sphere sphere = placed(forest.clusters()[cluster]);
                       choose_groups(look, sight, instance, cluster, groups, placed, sphere, eye.see(sphere),
                                     cut.front());
                     } else {
                       choose_clusters(look, instance, cluster, cut);
                     }
                   }).front());
}

}  // namespace forest::scene
