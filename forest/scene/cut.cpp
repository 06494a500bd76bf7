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

// It begins at the front of the forest, or a little before the eye inside it, and takes the forest's own depth.
Fog fog_of(const Forest& forest, const frame::Camera& camera, float strength) {
  constexpr float seen_inside = 95.f;  // µm: how far one sees between branches
  const Bounds& bounds = forest.soma_bounds();
  if (!(strength > 0.f) || bounds.empty()) return {};
  const float extent = .5f * bounds.extent().norm() + 100.f;
  const float depth = -camera.axes().col(2).dot(bounds.centre() - camera.eye);
  const float size = .5f * std::hypot(bounds.extent().x(), bounds.extent().z()) + 50.f;
  // Within the forest one sees a hundred micrometres or two, whatever its size.
  const float inside = std::clamp(1.f - (depth - size) / size, 0.f, 1.f);
  const float length = std::max(60.f, std::min(2.f * size, extent) * .9f);
  return {std::max(20.f, depth - size), (length + inside * (std::min(length, seen_inside) - length)) / strength};
}

namespace {

constexpr float dot_limit = 24.f;  // a soma of a larger radius, in pixels, is drawn as a capsule
constexpr float group_limit =
    12.f;  // groups of a cluster of a larger radius, in pixels, are looked at one by one
constexpr std::size_t chunk = 64;  // things; fixed, so that the result does not depend on threads
constexpr std::size_t neurons_a_part = 64, bricks_a_part = 64;

frame::Item item(std::uint32_t instance, std::uint32_t first, std::uint32_t drawn, const Sphere& sphere) {
  return {instance, first, drawn, 0, sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), sphere.radius};
}

// Whether its branches are so thin that they are drawn as lines.
bool is_thin(const Cluster& c, float magnification, const Detail& detail) {
  return 2.f * c.thickness * magnification <= detail.surface_width;
}

constexpr std::uint32_t every_group = (1u << Cluster::group_count) - 1u;

// What is looked at, and what is known to be hidden.
struct Look {
  const Forest& forest;
  const Eye& eye;
  const frame::Frustum& frustum;
  const Sight& sight;
  bool keep;  // what is hidden
  const Shown& shown;
  Fog fog = fog_of(forest, eye.camera(), eye.detail().fog);
  bool plain = plainly();  // all neurons are visible, whole, and drawn as fits their size

  frame::State state(std::uint32_t index) const {
    return shown.states.empty() ? frame::State{} : shown.states[index];
  }
  // Good enough for the eye through what fog there is.
  bool good_enough(const Sphere& sphere, float error) const {
    return error * eye.magnification(sphere) <= eye.acceptable(sphere) * fog.forgives(eye.nearest_depth(sphere));
  }
  bool in_sight(const Sphere& sphere) const {
    return frustum.may_see(sphere) && eye.nearest_depth(sphere) < fog.end();
  }
  bool hides(const Sphere& sphere) const { return sight.occluders && sight.occluders->hide(sphere); }
  // Whether it is left out for now, or for good.
  bool leaves_out(const Sphere& sphere, const LeftOut& what, Cut& cut) const {
    if (const bool far = eye.nearest_depth(sphere) > sight.horizon; far || hides(sphere)) {
      if (far || keep) cut.left_out.push_back(what);
      return true;
    }
    return false;
  }
  float straw_width() const { return forest.bricks().back().width; }
  /// Whether a neuron is drawn by straws.
  bool far(std::uint32_t index) const {
    if (forest.bricks().empty()) return false;
    const frame::State s = state(index);
    if (!s.is(frame::State::visible) || s.is(frame::State::parted)) return false;
    return s.kind == frame::Kind::bricks ||
           (s.kind == frame::Kind::any && good_enough(forest.spheres()[index], straw_width()));
  }

 private:
  bool plainly() const {
    std::uint32_t kinds = 0, flags = frame::State::visible, parted = 0;
    for (const frame::State& s : shown.states)
      kinds |= std::uint32_t(s.kind), flags &= s.flags, parted |= s.flags;
    return !kinds && flags && !(parted & frame::State::parted);
  }
};

// Adds a run to the list that it belongs to, drawn as `kind` or, for `any`, by its width in pixels.
void add(Cut& cut, const frame::Item& run, frame::Kind kind, bool thin) {
  if (!run.drawn) return;
  switch (kind) {
    case frame::Kind::somata:
    case frame::Kind::bricks:
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

// Of a cluster that is good enough, these groups.
void choose_groups(const Look& look, std::uint32_t index, std::uint32_t at, std::uint32_t groups,
                   const Placed& placed, const Sphere& sphere, Cut& cut) {
  const Cluster& c = look.forest.clusters()[at];
  const float magnification = look.eye.magnification(sphere);
  const Detail& detail = look.eye.detail();
  const frame::Kind kind = look.state(index).kind;
  const bool thin = is_thin(c, magnification, detail);
  const std::uint32_t shown = detail.thinnest > 0.f ? c.visible_at(magnification / detail.thinnest) : c.all();
  if (groups == every_group && sphere.radius * magnification <= group_limit)
    return add(cut, item(index, c.first_segment, shown, sphere), kind, thin);
  std::uint32_t hidden = 0;
  for (std::uint32_t g = 0; g < Cluster::group_count; ++g) {
    const std::uint32_t first = g * Cluster::group_size, drawn = shown >> first & 255u;
    if (!drawn || !(groups >> g & 1u)) continue;
    const Sphere around = placed(c.group(g));
    if (!look.in_sight(around)) continue;
    if (look.hides(around))
      hidden |= 1u << g;
    else
      add(cut, item(index, c.first_segment + first, drawn, around), kind, thin);
  }
  if (hidden && look.keep) cut.left_out.push_back({LeftOut::cluster, index, at, hidden});
}

void choose_clusters(const Look& look, std::uint32_t index, std::uint32_t from, Cut& cut) {
  const Placed placed(look.forest.instances()[index]);
  const auto clusters = look.forest.clusters();
  const Eye& eye = look.eye;
  const frame::State state = look.state(index);
  const bool parted =
      state.is(frame::State::parted);  // drawn in full: coarse clusters do not know their branches
  const auto states =
      parted ? section_states(look.forest, look.shown, index) : std::vector<const frame::State*>();
  if (state.kind == frame::Kind::somata && !parted) return;
  std::uint32_t open[64];
  int depth = 0;
  open[depth++] = from;
  while (depth) {
    const std::uint32_t at = open[--depth];
    const Cluster& c = clusters[at];
    const Sphere sphere = placed(c);
    if (!look.in_sight(sphere)) continue;
    if (look.leaves_out(sphere, {LeftOut::cluster, index, at, 0}, cut)) continue;
    if (!c.is_leaf() && depth + 2 <= 64 && (parted || !look.good_enough(sphere, c.error))) {
      open[depth++] = c.children[1];
      open[depth++] = c.children[0];
      continue;
    }
    if (parted)
      add_parts(look, index, c, sphere, is_thin(c, eye.magnification(sphere), eye.detail()), states, cut);
    else
      choose_groups(look, index, at, every_group, placed, sphere, cut);
  }
}

void choose_soma(const Look& look, std::uint32_t index, Cut& cut) {
  const frame::Instance& instance = look.forest.instances()[index];
  const Neuron& neuron = look.forest.neurons()[instance.morphology];
  const Sphere sphere{{instance.x, instance.y, instance.z}, neuron.soma_radius};
  if (!(neuron.soma_radius > 0.f) || !look.in_sight(sphere)) return;
  if (look.leaves_out(sphere, {LeftOut::soma, index, 0, 0}, cut)) return;
  frame::Item ball = item(index, neuron.first_segment, 1, sphere);
  const frame::State state = look.state(index);
  if (state.is(frame::State::parted)) {
    for (const Part& part : std::ranges::equal_range(look.shown.parts, index, {}, &Part::instance))
      if (part.section == soma_section) ball.state = frame::packed(part.state);
    if (!(ball.state ? frame::unpacked(ball.state) : state).is(frame::State::visible)) return;
  }
  const bool large = neuron.soma_radius * look.eye.magnification(sphere) > dot_limit;
  (large ? cut.capsules : cut.dots).push_back(ball);
  ++cut.segments;
}

void choose_neuron(const Look& look, std::uint32_t index, Cut& cut) {
  if (!(look.state(index).flags & (frame::State::visible | frame::State::parted)) || look.far(index)) return;
  const Neuron& neuron = look.forest.neurons()[look.forest.instances()[index].morphology];
  if (!neuron.cluster_count) return;
  const std::uint64_t before = cut.segments;
  choose_clusters(look, index, neuron.first_cluster, cut);
  choose_soma(look, index, cut);
  cut.neurons += cut.segments > before;
}

// The neurons of a grove, and of all below it.
void choose_grove(const Look& look, std::uint32_t from, Cut& cut) {
  const Groves& groves = look.forest.groves();
  std::vector<std::uint32_t> open{from};
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    open.pop_back();
    const Groves::Node& node = groves.nodes()[at];
    if (!look.in_sight(node.sphere)) continue;
    if (look.plain && !look.forest.bricks().empty() && look.good_enough(node.sphere, look.straw_width()))
      continue;
    if (look.leaves_out(node.sphere, {LeftOut::grove, 0, at, 0}, cut)) continue;
    for (std::uint32_t c = node.child_count; c-- > 0;) open.push_back(node.first_child + c);
    if (node.child_count) continue;
    for (const std::uint32_t i : groves.members().subspan(node.first, node.count)) choose_neuron(look, i, cut);
  }
}

// Of a brick, these groups of straws, but for those whose neurons are near.
void choose_straws(const Look& look, std::uint32_t at, std::uint32_t groups, Cut& cut) {
  const Brick& b = look.forest.bricks()[at];
  const Sphere sphere = b.sphere();
  const float magnification = look.eye.magnification(sphere), thinnest = look.eye.detail().thinnest;
  std::uint32_t shown = thinnest > 0.f ? b.shown(b.width * magnification / thinnest) : b.all();
  // Within the reach of a neuron around, all may be known to be far.
  const Sphere wide{sphere.centre, sphere.radius + 2.f * look.forest.reach()};
  if (!look.plain || !look.good_enough(wide, look.straw_width())) {
    const auto owners = look.forest.owners().subspan(b.first_segment - look.forest.places().size());
    for (std::uint32_t rest = shown; rest; rest &= rest - 1)
      if (const int i = std::countr_zero(rest); !look.far(owners[std::size_t(i)].instance)) shown &= ~(1u << i);
  }
  const auto put = [&](std::uint32_t drawn, const Sphere& around) {
    if (!drawn) return;
    cut.lines.push_back(item(FOREST_IN_WORLD, b.first_segment, drawn, around));
    cut.segments += std::uint32_t(std::popcount(drawn));
  };
  if (groups == every_group && sphere.radius * magnification <= group_limit) return put(shown, sphere);
  std::uint32_t hidden = 0;
  for (std::uint32_t g = 0; g < Brick::group_count; ++g) {
    const std::uint32_t drawn = shown & 255u << g * Brick::group_size;
    if (!drawn || !(groups >> g & 1u)) continue;
    const Sphere around = b.group(g);
    if (!look.in_sight(around)) continue;
    if (look.hides(around))
      hidden |= 1u << g;
    else
      put(drawn, around);
  }
  if (hidden && look.keep) cut.left_out.push_back({LeftOut::brick, 0, at, hidden});
}

// The finest straws are drawn however near they are, where their neuron is far: the nearest point of a sphere is nearer.
void choose_bricks(const Look& look, std::uint32_t from, Cut& cut) {
  const auto bricks = look.forest.bricks();
  std::vector<std::uint32_t> open{from};
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    open.pop_back();
    const Brick& b = bricks[at];
    const Sphere sphere = b.sphere();
    if (!look.in_sight(sphere)) continue;
    if (look.leaves_out(sphere, {LeftOut::brick, 0, at, 0}, cut)) continue;
    if (b.child_count && !look.good_enough(sphere, b.width)) {
      for (std::uint32_t c = b.child_count; c-- > 0;) open.push_back(b.first_child + c);
      continue;
    }
    // Its neurons are near when they are nearer than it: nothing to draw.
    if (look.plain && !look.good_enough(sphere, look.straw_width())) continue;
    choose_straws(look, at, every_group, cut);
  }
}

// Bricks that hold all others, some hundreds where there are as many.
std::vector<std::uint32_t> parts_of(std::span<const Brick> bricks) {
  std::vector<std::uint32_t> parts;
  if (!bricks.empty()) parts.push_back(0);
  while (!parts.empty() && parts.size() < 128 && bricks[parts.front()].child_count) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t at : parts)
      for (std::uint32_t c = 0; c < bricks[at].child_count; ++c) next.push_back(bricks[at].first_child + c);
    parts = std::move(next);
  }
  return parts;
}

void append(auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); }

// What `choose_one(i, cut)` adds for each i below `count`, in this order; `each` at a time.
Cut in_chunks(std::size_t count, std::size_t each, auto&& choose_one) {
  std::vector<Cut> parts((count + each - 1) / each);
  parallel_for(parts.size(), 1, [&](std::size_t p) {
    for (std::size_t i = p * each; i < std::min(count, (p + 1) * each); ++i) choose_one(i, parts[p]);
  });
  Cut whole;
  for (Cut& part : parts) {
    append(whole.dots, part.dots);
    append(whole.lines, part.lines);
    append(whole.capsules, part.capsules);
    append(whole.left_out, part.left_out);
    whole.segments += part.segments;
    whole.neurons += part.neurons;
    part = {};
  }
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

// From near to far, in bands.
void arrange(Cut& cut, const Eye& eye) {
  const Starts dots = sort_near_to_far(cut.dots, eye), lines = sort_near_to_far(cut.lines, eye),
               capsules = sort_near_to_far(cut.capsules, eye);
  cut.bands = bands_of(dots, lines, capsules);
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

Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport&, const Sight& guess,
           const Shown& shown) {
  const Look look{forest, eye, eye.frustum(), guess, true, shown};
  const auto groves = forest.groves().parts(neurons_a_part), bricks = parts_of(forest.bricks());
  Cut cut = in_chunks(groves.size() + bricks.size(), 1, [&](std::size_t i, Cut& part) {
    i < groves.size() ? choose_grove(look, groves[i], part) : choose_bricks(look, bricks[i - groves.size()], part);
  });
  arrange(cut, eye);
  return cut;
}

Cut revealed(const Forest& forest, const Eye& eye, const frame::Viewport&, std::span<const LeftOut> left_out,
             const Sight& now, const Shown& shown) {
  const Look look{forest, eye, eye.frustum(), now, false, shown};
  Cut cut = in_chunks(left_out.size(), chunk, [&](std::size_t n, Cut& part) {
    const LeftOut& l = left_out[n];
    switch (l.what) {
      case LeftOut::grove:
        return choose_grove(look, l.number, part);
      case LeftOut::soma:
        return choose_soma(look, l.instance, part);
      case LeftOut::brick:
        return l.groups ? choose_straws(look, l.number, l.groups, part) : choose_bricks(look, l.number, part);
      case LeftOut::cluster:
        break;
    }
    if (!l.groups) return choose_clusters(look, l.instance, l.number, part);
    const Placed placed(forest.instances()[l.instance]);
    choose_groups(look, l.instance, l.number, l.groups, placed, placed(forest.clusters()[l.number]), part);
  });
  arrange(cut, eye);
  return cut;
}

}  // namespace forest::scene
