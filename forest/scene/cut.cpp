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
  const Vec3 level = bounds.extent() - bounds.extent().cwiseProduct(forest.circuit().up.cwiseAbs());
  const float size = .5f * level.norm() + 50.f;
  // Within the forest one sees a hundred micrometres or two, whatever its size.
  const float inside = std::clamp(1.f - (depth - size) / size, 0.f, 1.f);
  const float length = std::max(60.f, std::min(2.f * size, extent) * .9f);
  return {std::max(20.f, depth - size),
          (length + inside * (std::min(length, seen_inside) - length)) / strength};
}

namespace {

constexpr float dot_limit = 24.f;  // a soma of a larger radius, in pixels, is drawn as a capsule
constexpr float group_limit =
    12.f;               // groups of a cluster of a larger radius, in pixels, are looked at one by one
constexpr int few = 8;  // segments of a cluster; its groups are not looked at for so few
constexpr std::size_t left_out_at_once = 64, neurons_at_once = 64,
                      bricks_at_least = 128;  // fixed, so that the result does not depend on threads

frame::Item item(std::uint32_t instance, std::uint32_t first, std::uint32_t drawn, const Sphere& sphere) {
  return {instance, first, drawn, 0, sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), sphere.radius};
}

// Into the cache.
void fetch(const Cluster& cluster) {
  const auto* bytes = reinterpret_cast<const char*>(&cluster);
  __builtin_prefetch(bytes), __builtin_prefetch(bytes + sizeof cluster - 1);
}

constexpr std::uint32_t every_group = (1u << Cluster::group_count) - 1u;

// The camera of all sights, and that of the pictures before.
struct Cameras {
  Viewer now, before;
  bool same;  // nobody moved

  explicit Cameras(std::span<const Sight> sights) : now(sights.front().eye.viewer()), before(now) {
    for (const Sight& sight : sights)
      if (sight.before) before = sight.before->viewer();
    same = now == before;
  }
  // For spheres of a neuron.
  Cameras within(const Placed& placed) const {
    Cameras cameras = *this;
    cameras.now = now.within(placed.position, placed.turn);
    cameras.before = same ? cameras.now : before.within(placed.position, placed.turn);
    return cameras;
  }
};

// What is looked at, by whom, and what is known to be hidden.
struct Look {
  const Forest& forest;
  std::span<const Sight> sights;
  bool keep;  // what is hidden
  const Shown& shown;
  Cameras cameras{sights};
  Fog fog = fog_of(forest, sights.front().eye.camera(), sights.front().eye.detail().fog);
  bool plain = plainly();  // all neurons are visible, whole, and drawn as fits their size

  std::uint32_t all() const { return frame::first_segments(std::uint32_t(sights.size())); }
  // What is read of a neuron, into the cache.
  void fetch(const Standing& one) const {
    const Neuron& neuron = neuron_of(one);
    if (neuron.cluster_count) __builtin_prefetch(&forest.clusters()[neuron.first_cluster]);
    if (!plain) __builtin_prefetch(&shown.states[one.index]);
  }
  const Neuron& neuron_of(const Standing& one) const { return forest.neurons()[one.instance.morphology]; }
  frame::State state(std::uint32_t index) const { return plain ? frame::State{} : shown.states[index]; }
  bool in_sight(const Sight& sight, const Seen& seen) const {
    return seen.nearest < fog.end() && sight.eye.may_see(seen);
  }
  // For the eye, through what fog there is.
  bool good_enough(const Sight& sight, const Seen& seen, float error) const {
    return sight.eye.good_enough(seen, error) ||
           (seen.nearest > fog.start && sight.eye.good_enough(seen, error / fog.forgives(seen.nearest)));
  }

  bool has_straws() const { return !forest.bricks().empty(); }
  // Whether straws that are so large, µm, do for what lies within: as large as the thinnest line that is drawn for its like, or
  // small within a pixel. They are no worse than thinning is, but a drawing of every branch is better.
  bool straws_do(const Sight& sight, const Seen& seen, float size) const {
    const Detail& d = sight.eye.detail();
    return good_enough(sight, seen, size * d.error / std::max(d.thinnest, .125f * d.error));
  }
  bool straws_do(const Sight& sight, const Seen& seen) const {
    return has_straws() && straws_do(sight, seen, forest.bricks().back().error());
  }
  // For which of some sights a neuron is drawn by straws.
  std::uint32_t far(std::uint32_t index, const Sphere& sphere, std::uint32_t of_sights) const {
    const frame::State s = state(index);
    if (!has_straws() || !s.is(frame::State::visible) || s.is(frame::State::parted)) return 0;
    if (s.kind == frame::Kind::bricks) return of_sights;
    if (s.kind != frame::Kind::any) return 0;
    const Seen seen = sights.front().eye.see(sphere);
    std::uint32_t result = 0;
    for (std::uint32_t rest = of_sights; rest; rest &= rest - 1)
      if (const auto i = std::size_t(std::countr_zero(rest)); straws_do(sights[i], seen)) result |= 1u << i;
    return result;
  }

 private:
  bool plainly() const {
    const auto [any, all] = frame::bits_of(shown.states);
    return any.kind == frame::Kind::any && all.is(frame::State::visible) && !any.is(frame::State::parted);
  }
};

// A neuron where it stands, and as its own coordinates are seen.
class Turned {
 public:
  std::uint32_t standing, index;  // of the instance
  Placed placed;
  Cameras cameras;

  Turned(const Look& look, std::uint32_t number)
      : standing(number),
        index(look.forest.standing()[number].index),
        placed(look.forest.standing()[number].instance),
        cameras(look.cameras.within(placed)),
        look_(look),
        neuron_(look.neuron_of(look.forest.standing()[number])),
        first_(neuron_.first_cluster) {}

  // What decides which thin branches of a cluster are drawn: its closeness (Seen::closeness), or that of something it grows
  // into, where that is closer. So nothing that is drawn ends where a branch goes into the depth and gets thin there. It
  // depends on the camera alone, not on what is chosen or hidden.
  float closeness(std::uint32_t cluster) {
    if (!whole_) look_at_all();
    return cluster == first_ || close_.empty() ? *whole_ : close_[cluster - first_];
  }

 private:
  // Most neurons are so far that one end of them is as close as the other.
  void look_at_all() {
    constexpr float flat = .1f, deep = .2f;  // radius by distance
    const frame::Camera& camera = look_.sights.front().eye.camera();
    const auto clusters = look_.forest.clusters().subspan(first_, neuron_.cluster_count);
    const Seen seen = cameras.now(clusters.front().sphere());
    whole_ = seen.closeness(camera.near);
    const float depth = seen.at.z() > seen.radius ? seen.radius / seen.at.z() : 1.f;
    if (seen.orthographic || depth < flat) return;
    const float share = std::min(1.f, (depth - flat) / (deep - flat));
    // The leaves lie behind all others, the last of them first.
    const std::size_t count = clusters.size(), leaves = (count + 1) / 2, first_leaf = count - leaves;
    const auto place_of = [&](std::size_t leaf) { return count - 1 - leaf; };
    close_.resize(count);
    thread_local std::vector<std::size_t> behind;  // of a leaf, the next that it does not lead to
    behind.resize(leaves);
    for (std::size_t leaf = leaves; leaf-- > 0;) {
      const Cluster& c = clusters[place_of(leaf)];
      const Seen one = cameras.now(c.sphere());
      float close = 0.f;
      if (look_.sights.front().eye.may_be_in_picture(one))
        close = *whole_ + share * (one.closeness(camera.near) - *whole_);
      const std::size_t end = std::min<std::size_t>(leaf + 1 + c.outgrowth, leaves);
      std::size_t next = leaf + 1;
      for (; next < end; next = behind[next]) close = std::max(close, close_[place_of(next)]);
      behind[leaf] = next, close_[place_of(leaf)] = close;
    }
    for (std::size_t at = first_leaf; at-- > 0;) {
      const auto [a, b] = clusters[at].children;
      close_[at] = std::max(close_[a - first_], close_[b - first_]);
    }
  }

  const Look& look_;
  const Neuron& neuron_;
  std::uint32_t first_;  // of its clusters
  std::optional<float> whole_;
  std::vector<float> close_;  // of every cluster but the first; empty: as the whole neuron
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
void add_parts(const Look& look, std::uint32_t index, const Cluster& leaf, std::uint32_t shown,
               const Sphere& sphere, bool thin, std::span<const frame::State* const> states, Cut& cut) {
  const Neuron& neuron = look.forest.neurons()[look.forest.instances()[index].morphology];
  const frame::State whole = look.state(index);
  const auto state_of = [&](std::uint32_t segment) -> const frame::State* {
    const std::uint32_t section =
        look.forest.section_of_segment()[neuron.first_original + segment - neuron.first_segment];
    return section == soma_section ? nullptr : states[section];
  };
  for (std::uint32_t rest = shown, drawn; rest; rest &= ~drawn) {
    const frame::State* state = state_of(leaf.first_segment + std::uint32_t(std::countr_zero(rest)));
    drawn = 0;
    for (std::uint32_t i = 0; i < leaf.segment_count; ++i)
      drawn |= std::uint32_t(state_of(leaf.first_segment + i) == state) << i;
    drawn &= rest;
    if (!(state ? *state : whole).is(frame::State::visible)) continue;
    frame::Item run = item(index, leaf.first_segment, drawn, sphere);
    if (state) run.state = frame::packed(*state);
    add(cut, run, (state ? *state : whole).kind, thin);
  }
}

// A sphere as all sights see it, and as the camera of the pictures before saw it; that once somebody asks.
class Judged {
 public:
  Judged(const Cameras& cameras, const Sphere& sphere)
      : cameras_(cameras), sphere_(sphere), seen_(cameras.now(sphere)) {}

  const Seen& seen() const { return seen_; }
  bool hidden(const Sight& sight) {
    if (!sight.before) return false;
    if (cameras_.same) return sight.before->hide(seen_);
    if (!before_) before_ = cameras_.before(sphere_);
    return sight.before->hide(*before_);
  }
  // Whether it is left out for now, or for good.
  bool left_out(const Look& look, const Sight& sight, const LeftOut& what, Cut& cut) {
    const bool far = seen_.nearest > sight.horizon;
    if (!far && !hidden(sight)) return false;
    if (far || look.keep) cut.left_out.push_back(what);
    return true;
  }

 private:
  const Cameras& cameras_;
  const Sphere& sphere_;
  Seen seen_;
  std::optional<Seen> before_;
};

// Calls take(i) for each of a set of sights, a bit for each.
void each_of(std::uint32_t sights, auto&& take) {
  for (; sights; sights &= sights - 1) take(std::size_t(std::countr_zero(sights)));
}

// Which segments of a cluster are wide enough to be drawn, or drawn for their like.
std::uint32_t shown_of(const Sight& sight, Turned& neuron, const Cluster& c, std::uint32_t at) {
  const float thinnest = sight.eye.detail().thinnest;
  return thinnest > 0.f ? c.visible_at(sight.eye.magnification(neuron.closeness(at)) / thinnest) : c.all();
}

// Of a cluster that is good enough, these groups.
void choose_groups(const Look& look, const Sight& sight, Turned& neuron, std::uint32_t at,
                   std::uint32_t groups, const Seen& seen, Cut& cut) {
  const std::uint32_t index = neuron.index;
  const Cluster& c = look.forest.clusters()[at];
  const frame::Kind kind = look.state(index).kind;
  const std::uint32_t all = shown_of(sight, neuron, c, at);
  if (groups == every_group &&
      (std::popcount(all) <= few || seen.radius * sight.eye.magnification(seen) <= group_limit))
    return add(cut, item(index, c.first_segment, all, neuron.placed(c)), kind,
               sight.eye.thin(seen, c.thickness));
  std::uint32_t hidden = 0;
  for (std::uint32_t g = 0; g < Cluster::group_count; ++g) {
    const std::uint32_t first = g * Cluster::group_size, drawn = all >> first & 255u;
    if (!(groups >> g & 1u) || !drawn) continue;
    const Sphere around = c.group(g);
    Judged judged(neuron.cameras, around);
    if (!sight.eye.may_see(judged.seen())) continue;
    if (judged.hidden(sight))
      hidden |= 1u << g;
    else
      add(cut, item(index, c.first_segment + first, drawn, neuron.placed(around)), kind,
          sight.eye.thin(judged.seen(), c.thickness));
  }
  if (hidden && look.keep) cut.left_out.push_back({LeftOut::cluster, neuron.standing, at, hidden});
}

// For each sight, from one cluster on; returns which of them may see it.
std::uint32_t choose_clusters(const Look& look, Turned& neuron, std::uint32_t from, std::uint32_t of_sights,
                              std::span<Cut> cuts) {
  const std::uint32_t index = neuron.index;
  const auto clusters = look.forest.clusters();
  const frame::State state = look.state(index);
  const bool parted =
      state.is(frame::State::parted);  // drawn in full: coarse clusters do not know their branches
  const auto states =
      parted ? section_states(look.forest, look.shown, index) : std::vector<const frame::State*>();
  if (state.kind == frame::Kind::somata && !parted) return of_sights;
  struct Open {
    std::uint32_t cluster, sights;  // those for which its parent was too coarse
  };
  // Level by level: until a cluster's turn comes it has been fetched.
  thread_local std::vector<Open> open;
  open.assign(1, {from, of_sights});
  std::uint32_t may_see = 0;
  for (std::size_t next = 0; next < open.size(); ++next) {
    const auto [at, sights] = open[next];
    const Cluster& c = clusters[at];
    const Sphere sphere = c.sphere();
    Judged judged(neuron.cameras, sphere);
    const Seen& seen = judged.seen();
    std::uint32_t finer = 0;
    each_of(sights, [&](std::size_t s) {
      const Sight& sight = look.sights[s];
      Cut& cut = cuts[s];
      // Fog takes whole neurons: a branch that goes on into it is not to come apart there.
      if (!sight.eye.may_see(seen)) return;
      if (at == from) may_see |= 1u << s;
      if (judged.left_out(look, sight, {LeftOut::cluster, neuron.standing, at, 0}, cut)) {
      } else if (!c.is_leaf() && (parted || !look.good_enough(sight, seen, c.error))) {
        finer |= 1u << s;
      } else if (parted) {
        add_parts(look, index, c, shown_of(sight, neuron, c, at), neuron.placed(c),
                  sight.eye.thin(seen, c.thickness), states, cut);
      } else {
        choose_groups(look, sight, neuron, at, every_group, seen, cut);
      }
    });
    if (!finer) continue;
    for (const std::uint32_t child : c.children) {
      fetch(clusters[child]);
      open.push_back({child, finer});
    }
  }
  return may_see;
}

void choose_soma(const Look& look, std::uint32_t number, std::uint32_t sights, std::span<Cut> cuts) {
  const Standing& one = look.forest.standing()[number];
  const auto& [around, instance, index] = one;
  const Neuron& neuron = look.neuron_of(one);
  const Sphere sphere{{instance.x, instance.y, instance.z}, neuron.soma_radius};
  if (!(neuron.soma_radius > 0.f)) return;
  frame::Item ball = item(index, neuron.first_segment, 1, sphere);
  const frame::State state = look.state(index);
  if (state.is(frame::State::parted)) {
    for (const Part& part : std::ranges::equal_range(look.shown.parts, index, {}, &Part::instance))
      if (part.section == soma_section) ball.state = frame::packed(part.state);
    if (!(ball.state ? frame::unpacked(ball.state) : state).is(frame::State::visible)) return;
  }
  Judged judged(look.cameras, sphere);
  each_of(sights, [&](std::size_t s) {
    const Sight& sight = look.sights[s];
    if (!look.in_sight(sight, judged.seen())) return;
    if (judged.left_out(look, sight, {LeftOut::soma, number, 0, 0}, cuts[s])) return;
    const bool large = neuron.soma_radius * sight.eye.magnification(judged.seen()) > dot_limit;
    (large ? cuts[s].capsules : cuts[s].dots).push_back(ball);
    ++cuts[s].segments;
  });
}

void choose_neuron(const Look& look, std::uint32_t number, std::uint32_t sights, std::span<Cut> cuts) {
  const Standing& one = look.forest.standing()[number];
  if (!(look.state(one.index).flags & (frame::State::visible | frame::State::parted))) return;
  const Neuron& neuron = look.neuron_of(one);
  if (!neuron.cluster_count) return;
  if (const std::uint32_t far = look.far(one.index, one.sphere, sights)) {
    each_of(far, [&](std::size_t s) { ++cuts[s].far; });
    if (!(sights &= ~far)) return;
  }
  // The soma lies within its root.
  Turned turned(look, number);
  choose_soma(look, number, choose_clusters(look, turned, neuron.first_cluster, sights, cuts), cuts);
}

struct Open {
  std::uint32_t number, sights;  // of a grove or a brick; those that are to look at it
};

// The neurons of a grove, and of all below it.
void choose_grove(const Look& look, Open from, std::span<Cut> cuts) {
  const Groves& groves = look.forest.groves();
  std::vector<Open> open{from};
  while (!open.empty()) {
    const auto [at, sights] = open.back();
    open.pop_back();
    const Groves::Node& node = groves.nodes()[at];
    Judged judged(look.cameras, node.sphere);
    std::uint32_t within = 0;
    each_of(sights, [&](std::size_t s) {
      const Sight& sight = look.sights[s];
      if (!look.in_sight(sight, judged.seen())) return;
      if (look.plain && look.straws_do(sight, judged.seen())) {
        cuts[s].far += node.count;
        return;
      }
      if (!judged.left_out(look, sight, {LeftOut::grove, 0, at, 0}, cuts[s])) within |= 1u << s;
    });
    if (!within) continue;
    for (std::uint32_t c = node.child_count; c-- > 0;) open.push_back({node.first_child + c, within});
    if (node.child_count) continue;
    const auto standing = look.forest.standing();
    for (std::uint32_t i = node.first, end = node.first + node.count; i < end; ++i) {
      if (i + 2 < end) look.fetch(standing[i + 2]);
      choose_neuron(look, i, within, cuts);
    }
  }
}

// Of a brick, these groups of straws, but for those whose neurons are near.
void choose_straws(const Look& look, std::size_t s, std::uint32_t at, std::uint32_t groups, Cut& cut) {
  const Brick& b = look.forest.bricks()[at];
  const Sight& sight = look.sights[s];
  const Sphere sphere = b.sphere();
  const float magnification = sight.eye.magnification(sphere), thinnest = sight.eye.detail().thinnest;
  std::uint32_t shown = thinnest > 0.f ? b.shown(magnification / thinnest) : b.all();
  const Sphere wide{sphere.centre, b.neurons};
  if (!look.plain || !look.straws_do(sight, sight.eye.see(wide))) {
    const auto owners = look.forest.owners().subspan(b.first_segment - look.forest.places().size());
    for (std::uint32_t rest = shown; rest; rest &= rest - 1) {
      const int i = std::countr_zero(rest);
      const std::uint32_t owner = owners[std::size_t(i)].instance;
      if (!look.far(owner, look.forest.spheres()[owner], 1u << s)) shown &= ~(1u << i);
    }
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
    Judged judged(look.cameras, around);
    if (!look.in_sight(sight, judged.seen())) continue;
    if (judged.hidden(sight))
      hidden |= 1u << g;
    else
      put(drawn, around);
  }
  if (hidden && look.keep) cut.left_out.push_back({LeftOut::brick, 0, at, hidden});
}

void choose_bricks(const Look& look, Open from, std::span<Cut> cuts) {
  const auto bricks = look.forest.bricks();
  std::vector<Open> open{from};
  while (!open.empty()) {
    const auto [at, sights] = open.back();
    open.pop_back();
    const Brick& b = bricks[at];
    const Sphere sphere = b.sphere();
    Judged judged(look.cameras, sphere);
    const Seen& seen = judged.seen();
    std::uint32_t finer = 0;
    each_of(sights, [&](std::size_t s) {
      const Sight& sight = look.sights[s];
      if (!look.in_sight(sight, seen) || judged.left_out(look, sight, {LeftOut::brick, 0, at, 0}, cuts[s]))
        return;
      if (b.child_count && !look.straws_do(sight, seen, b.error()))
        finer |= 1u << s;
      else if (!look.plain ||
               look.straws_do(sight, seen))  // else its neurons, which are nearer, are near, too
        choose_straws(look, s, at, every_group, cuts[s]);
    });
    if (!finer) continue;
    for (std::uint32_t c = b.child_count; c-- > 0;) open.push_back({b.first_child + c, finer});
  }
}

// Bricks that hold all others.
std::vector<std::uint32_t> parts_of(std::span<const Brick> bricks) {
  std::vector<std::uint32_t> parts;
  if (!bricks.empty()) parts.push_back(0);
  while (!parts.empty() && parts.size() < bricks_at_least && bricks[parts.front()].child_count) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t at : parts)
      for (std::uint32_t c = 0; c < bricks[at].child_count; ++c) next.push_back(bricks[at].first_child + c);
    parts = std::move(next);
  }
  return parts;
}

// One member of every so many-th cut from `first` on, behind one another.
template <class Thing>
void join(std::vector<Thing>& to, std::vector<Thing> Cut::*member, std::span<const Cut> cuts,
          std::size_t first, std::size_t stride) {
  std::size_t count = 0;
  for (std::size_t p = first; p < cuts.size(); p += stride) count += (cuts[p].*member).size();
  to.reserve(count);
  for (std::size_t p = first; p < cuts.size(); p += stride)
    to.insert(to.end(), (cuts[p].*member).begin(), (cuts[p].*member).end());
}

// What `choose_some(begin, end, cuts)` adds to each of so many cuts for those below `count`, in this order; `chunk` of them at
// a time.
std::vector<Cut> in_chunks(std::size_t count, std::size_t chunk, std::size_t cuts, auto&& choose_some) {
  std::vector<Cut> parts((count + chunk - 1) / chunk * cuts);
  parallel_for(parts.size() / cuts, 1, [&](std::size_t p) {
    choose_some(p * chunk, std::min(count, (p + 1) * chunk), std::span(parts).subspan(p * cuts, cuts));
  });
  std::vector<Cut> whole(cuts);
  parallel_for(cuts, 1, [&](std::size_t c) {
    const auto take = [&](auto member) {
      join(whole[c].*member, member, std::span(std::as_const(parts)), c, cuts);
    };
    take(&Cut::dots), take(&Cut::lines), take(&Cut::capsules), take(&Cut::left_out);
    for (std::size_t p = c; p < parts.size(); p += cuts) {
      whole[c].segments += parts[p].segments;
      whole[c].far += parts[p].far;
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

void NeuronsInSight::add(const Cut& cut) {
  count_ += cut.far;
  for (const auto* list : {&cut.capsules, &cut.lines, &cut.dots})
    for (const frame::Item& item : *list) {
      if (item.instance == FOREST_IN_WORLD || marked_[item.instance]) continue;
      marked_[item.instance] = true;
      ++count_;
    }
}

std::vector<Cut> choose(const Forest& forest, std::span<const Sight> sights, const Shown& shown) {
  const Look look{forest, sights, true, shown};
  const auto groves = forest.groves().parts(neurons_at_once), bricks = parts_of(forest.bricks());
  std::vector<Cut> cuts = in_chunks(groves.size() + bricks.size(), 1, sights.size(),
                                    [&](std::size_t i, std::size_t, std::span<Cut> parts) {
                                      if (i < groves.size())
                                        choose_grove(look, {groves[i], look.all()}, parts);
                                      else
                                        choose_bricks(look, {bricks[i - groves.size()], look.all()}, parts);
                                    });
  parallel_for(cuts.size(), 1, [&](std::size_t s) { arrange(cuts[s], sights[s].eye); });
  return cuts;
}

Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport&, const Shown& shown) {
  const Sight sight{eye};
  return std::move(choose(forest, std::span(&sight, 1), shown).front());
}

Cut revealed(const Forest& forest, const Sight& now, std::span<const LeftOut> left_out, const Shown& shown) {
  const Look look{forest, std::span(&now, 1), false, shown};
  const auto reveal = [&](std::size_t begin, std::size_t end, std::span<Cut> cuts) {
    std::optional<Turned> turned;  // what was left out of a neuron lies together
    for (std::size_t n = begin; n < end; ++n) {
      if (const LeftOut& soon = left_out[std::min(n + 4, left_out.size() - 1)];
          soon.what == LeftOut::cluster) {
        look.fetch(look.forest.standing()[soon.standing]);
        fetch(forest.clusters()[soon.number]);
      }
      const LeftOut& l = left_out[n];
      switch (l.what) {
        case LeftOut::grove:
          choose_grove(look, {l.number, 1}, cuts);
          break;
        case LeftOut::soma:
          choose_soma(look, l.standing, 1, cuts);
          break;
        case LeftOut::brick:
          l.groups ? choose_straws(look, 0, l.number, l.groups, cuts.front())
                   : choose_bricks(look, {l.number, 1}, cuts);
          break;
        case LeftOut::cluster:
          if (!turned || turned->standing != l.standing) turned.emplace(look, l.standing);
          if (l.groups)
            choose_groups(look, now, *turned, l.number, l.groups,
                          turned->cameras.now(forest.clusters()[l.number].sphere()), cuts.front());
          else
            choose_clusters(look, *turned, l.number, 1, cuts);
      }
    }
  };
  Cut cut = std::move(in_chunks(left_out.size(), left_out_at_once, 1, reveal).front());
  arrange(cut, now.eye);
  return cut;
}

}  // namespace forest::scene
