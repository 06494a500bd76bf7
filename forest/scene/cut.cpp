// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "forest/core/lent.h"
#include "forest/core/parallel.h"
#include "forest/scene/placed.h"

namespace forest::scene {

float reach_along(const Forest& forest, const Vec3& direction) {
  constexpr float deviations = 3.f, branches = 250.f;  // µm: of branches beyond the somata
  return deviations * std::sqrt(std::max(0.f, direction.dot(forest.soma_spread() * direction))) + branches;
}

// It begins at the front of the forest, or a little before the eye inside it, and takes the forest's own depth.
Fog fog_of(const Forest& forest, const frame::Camera& camera, float strength) {
  const Bounds& bounds = forest.soma_bounds();
  if (!(strength > 0.f) || bounds.empty()) return {};
  const Vec3 &along = camera.axes().col(2), &up = forest.circuit().up;
  const auto neurons = float(forest.instances().size());
  // Few neurons are as deep as their own branches, many as their somata.
  const float own = forest.mean_reach() / std::cbrt(neurons);
  const float extent = std::max(.5f * bounds.extent().norm() + 100.f, 2.f * own);
  const float depth = -along.dot(bounds.centre() - camera.eye);
  const Vec3 level = bounds.extent() - bounds.extent().cwiseProduct(up.cwiseAbs());
  const float high = .5f * bounds.extent().dot(up.cwiseAbs()) * std::abs(along.dot(up.normalized()));
  const float size = std::max({std::min(.5f * level.norm() + 50.f, reach_along(forest, along)), high, own});
  // Within the forest one sees a hundred micrometres or two, whatever its size, and farther where neurons stand farther apart.
  constexpr float seen_inside = 95.f, spacings = 1.25f,
                  box = 41.6f;  // √12³: the volume of a box by its deviations
  const auto volume =
      float(double(box) *
            std::sqrt((forest.soma_spread() + 900.f * Mat3::Identity()).cast<double>().determinant()));
  const float sight = std::max({seen_inside, spacings * std::cbrt(volume / neurons), own});
  const float inside = std::clamp(1.f - (depth - size) / size, 0.f, 1.f);
  const float length = std::max(60.f, std::min(2.f * size, extent) * .9f);
  return {std::max(20.f, depth - size), (length + inside * (std::min(length, sight) - length)) / strength};
}

namespace {

constexpr float dot_limit = 24.f;  // a soma of a larger radius, in pixels, is drawn as a capsule
constexpr float group_limit =
    12.f;               // groups of a cluster of a larger radius, in pixels, are looked at one by one
constexpr int few = 8;  // segments of a cluster; its groups are not looked at for so few
constexpr std::size_t left_out_at_once = 512, neurons_at_once = 64,
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

// Calls take(i) for each of a set, a bit for each.
void each_of(std::uint32_t bits, auto&& take) {
  for (; bits; bits &= bits - 1) take(std::size_t(std::countr_zero(bits)));
}

// The camera of all sights, and that of the pictures before.
struct Cameras {
  Viewer now, before;
  bool same;  // nobody moved

  explicit Cameras(std::span<const Sight> sights) : now(sights.front().eye.viewer()), before(now) {
    for (const Sight& sight : sights)
      if (sight.before) before = sight.before->viewer();
    same = now == before;
  }
};

// What is looked at, by whom, and what is known to be hidden.
struct Look {
  const Forest& forest;
  std::span<const Sight> sights;
  bool keep;  // what is hidden
  const Shown& shown;
  Closeness& closeness;
  Turn turn = {};
  std::span<const Cluster> clusters = forest.clusters();
  std::span<const Neuron> neurons = forest.neurons();
  std::span<const Standing> standing = forest.standing();
  Cameras cameras{sights};
  Fog fog = fog_of(forest, sights.front().eye.camera(), sights.front().eye.detail().fog);
  bool plain = plainly();  // all neurons are visible, whole, and drawn as fits their size

  std::uint32_t all() const { return frame::first_segments(std::uint32_t(sights.size())); }
  // What is read of a neuron, into the cache.
  void fetch(const Standing& one) const {
    const Neuron& neuron = neuron_of(one);
    if (neuron.cluster_count) __builtin_prefetch(&clusters[neuron.first_cluster]);
    if (!plain) __builtin_prefetch(&shown.states[one.index]);
  }
  const Neuron& neuron_of(const Standing& one) const { return neurons[one.instance.morphology]; }
  frame::State state(std::uint32_t index) const { return plain ? frame::State{} : shown.states[index]; }
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
    each_of(of_sights, [&](std::size_t i) { result |= std::uint32_t(straws_do(sights[i], seen)) << i; });
    return result;
  }

 private:
  bool plainly() const {
    const auto [any, all] = shown.states.bits();
    return any.kind == frame::Kind::any && all.is(frame::State::visible) && !any.is(frame::State::parted);
  }
};

// A neuron that is looked at.
class Subject {
 public:
  std::uint32_t standing, index;  // of the instance
  std::uint32_t root;             // of its clusters
  Placed placed;
  frame::State state;
  std::vector<const frame::State*> parts;  // of its sections; empty: it is shown as one
  std::uint32_t seen_by = 0;               // sights that may see its root

  Subject(const Look& look, std::uint32_t number)
      : standing(number),
        index(look.standing[number].index),
        root(look.neuron_of(look.standing[number]).first_cluster),
        placed(look.standing[number].instance),
        state(look.state(index)),
        look_(&look) {
    if (parted()) parts = section_states(look.forest, look.shown, index);
  }

  bool parted() const { return state.is(frame::State::parted); }

  // As Closeness has it.
  float closeness(std::uint32_t cluster) {
    if (!closeness_) closeness_ = look_->closeness.of(standing, placed);
    return (*closeness_)(cluster - root);
  }

 private:
  const Look* look_;
  std::optional<Closeness::OfNeuron> closeness_;
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
  const Neuron& neuron = look.neurons[look.forest.instances()[index].morphology];
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

// Spheres as all sights see them, and as the camera of the pictures before saw them; that once somebody asks.
class Judged {
 public:
  Judged(const Cameras& cameras, const Spheres& spheres) : cameras_(cameras), spheres_(spheres) {
    cameras.now(spheres_, seen_);
  }
  Judged(const Cameras& cameras, const Sphere& sphere) : Judged(cameras, Spheres(sphere)) {}

  Seen seen(std::size_t i = 0) const { return seen_[i]; }
  std::uint32_t may_see(const Sight& sight) const { return sight.eye.may_see(seen_); }
  bool in_fog(const Look& look, std::size_t i = 0) const { return !(seen_.nearest[i] < look.fog.end()); }
  bool in_sight(const Look& look, const Sight& sight) const { return !in_fog(look) && (may_see(sight) & 1u); }
  bool hidden(const Sight& sight, std::size_t i = 0) {
    if (!sight.before) return false;
    if (cameras_.same) return sight.before->hide(seen_.glimpse(i));
    if (!before_) cameras_.before(spheres_, before_.emplace());
    return sight.before->hide(before_->glimpse(i));
  }
  // Whether it is left out for now, or for good.
  bool left_out(const Look& look, const Sight& sight, const LeftOut& what, Cut& cut, std::size_t i = 0) {
    const bool far = seen_.nearest[i] > sight.horizon;
    if (!far && !hidden(sight, i)) return false;
    if (far || look.keep) leave_out(what, cut, i);
    return true;
  }
  void leave_out(LeftOut what, Cut& cut, std::size_t i = 0) const {
    what.seen = seen_.glimpse(i);
    cut.left_out.push_back(what);
  }

 private:
  const Cameras& cameras_;
  Spheres spheres_;
  SeenTogether seen_;
  std::optional<SeenTogether> before_;
};

// Which segments of a cluster are wide enough to be drawn, or drawn for their like.
std::uint32_t shown_of(const Sight& sight, Subject& neuron, const Cluster& c, std::uint32_t at) {
  const float thinnest = sight.eye.detail().thinnest;
  return thinnest > 0.f
             ? c.visible_at(sight.eye.magnification(neuron.closeness(at)) / thinnest, order_of(neuron.index))
             : c.all();
}

// Of a cluster that is good enough, these groups.
void choose_groups(const Look& look, const Sight& sight, Subject& neuron, std::uint32_t at,
                   std::uint32_t groups, const Seen& seen, Cut& cut) {
  const std::uint32_t index = neuron.index;
  const Cluster& c = look.clusters[at];
  const frame::Kind kind = neuron.state.kind;
  const std::uint32_t all = shown_of(sight, neuron, c, at);
  if (groups == every_group &&
      (std::popcount(all) <= few || seen.radius * sight.eye.magnification(seen) <= group_limit))
    return add(cut, item(index, c.first_segment, all, neuron.placed(c)), kind,
               sight.eye.thin(seen, c.thickness));
  const Spheres spheres(Cluster::group_count,
                        [&](std::size_t g) { return neuron.placed(c.group(std::uint32_t(g))); });
  Judged judged(look.cameras, spheres);
  each_of(groups & judged.may_see(sight), [&](std::size_t g) {
    const auto first = std::uint32_t(g) * Cluster::group_size, drawn = all >> first & 255u;
    if (!drawn) return;
    if (!judged.hidden(sight, g))
      add(cut, item(index, c.first_segment + first, drawn, spheres[g]), kind,
          sight.eye.thin(judged.seen(g), c.thickness));
    else if (look.keep)
      judged.leave_out({LeftOut::cluster, neuron.standing, at, 1u << g}, cut, g);
  });
}

// Some neurons on their way down from the coarsest clusters, all together, so that vectors are full.
class Descent {
 public:
  Descent(const Look& look, std::span<Cut> cuts) : look_(look), cuts_(cuts) {}

  void add(std::uint32_t standing) { subjects_.emplace_back(look_, standing); }
  std::span<const Subject> subjects() const { return subjects_; }
  Subject& last() { return subjects_.back(); }
  // Of the neuron added last.
  void add(std::uint32_t cluster, std::uint32_t sights) {
    open_.push_back({std::uint32_t(subjects_.size() - 1), cluster, sights});
  }

  // Level by level: until a cluster's turn comes it has been fetched.
  void run() {
    for (std::size_t next = 0; next < open_.size();) {
      const std::size_t first = next, count = std::min(Spheres::most, open_.size() - next);
      next += count;
      std::uint32_t of_sights = 0;
      for (std::size_t i = first; i < next; ++i) of_sights |= open_[i].sights;
      Judged judged(look_.cameras, Spheres(count, [&](std::size_t i) {
                      const Open& o = open_[first + i];
                      return subjects_[o.subject].placed(look_.clusters[o.cluster]);
                    }));
      std::array<std::uint32_t, Spheres::most> finer{};
      each_of(of_sights, [&](std::size_t s) {
        // Fog takes whole neurons: a branch that goes on into it is not to come apart there.
        const std::uint32_t seen = ((1u << count) - 1u) & judged.may_see(look_.sights[s]);
        each_of(seen, [&](std::size_t i) {
          if (const Open& o = open_[first + i]; o.sights >> s & 1u)
            finer[i] |= std::uint32_t(too_coarse(o, judged, i, s)) << s;
        });
      });
      for (std::size_t i = 0; i < count; ++i) {
        if (!finer[i]) continue;
        const auto [subject, cluster, sights] = open_[first + i];
        for (const std::uint32_t child : look_.clusters[cluster].children) {
          fetch(look_.clusters[child]);
          open_.push_back({subject, child, finer[i]});
        }
      }
    }
  }

 private:
  struct Open {
    std::uint32_t subject, cluster, sights;  // those for which its parent was too coarse
  };
  const Look& look_;
  std::span<Cut> cuts_;
  std::vector<Subject> subjects_;
  std::vector<Open> open_;

  // One that a sight may see: it is drawn, or left out, or its children are to be looked at.
  bool too_coarse(const Open& o, Judged& judged, std::size_t i, std::size_t s) {
    const std::uint32_t at = o.cluster;
    const Cluster& c = look_.clusters[at];
    const Sight& sight = look_.sights[s];
    Subject& neuron = subjects_[o.subject];
    Cut& cut = cuts_[s];
    if (at == neuron.root) neuron.seen_by |= 1u << s;
    if (judged.left_out(look_, sight, {LeftOut::cluster, neuron.standing, at, 0}, cut, i)) return false;
    const Seen seen = judged.seen(i);
    // Those with parts are drawn in full: coarse clusters do not know their branches.
    if (!c.is_leaf() && (neuron.parted() || !look_.good_enough(sight, seen, c.error))) return true;
    if (neuron.parted())
      add_parts(look_, neuron.index, c, shown_of(sight, neuron, c, at), neuron.placed(c),
                sight.eye.thin(seen, c.thickness), neuron.parts, cut);
    else
      choose_groups(look_, sight, neuron, at, every_group, seen, cut);
    return false;
  }
};

void choose_soma(const Look& look, std::uint32_t number, std::uint32_t sights, std::span<Cut> cuts) {
  const Standing& one = look.standing[number];
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
    if (!judged.in_sight(look, sight)) return;
    if (judged.left_out(look, sight, {LeftOut::soma, number, 0, 0}, cuts[s])) return;
    const bool large = neuron.soma_radius * sight.eye.magnification(judged.seen()) > dot_limit;
    (large ? cuts[s].capsules : cuts[s].dots).push_back(ball);
    ++cuts[s].segments;
  });
}

void choose_neurons(const Look& look, std::uint32_t first, std::uint32_t end, std::uint32_t of_sights,
                    std::span<Cut> cuts) {
  const auto standing = look.standing;
  Descent descent(look, cuts);
  for (std::uint32_t i = first; i < end; ++i) {
    if (i + 2 < end) look.fetch(standing[i + 2]);
    const Standing& one = standing[i];
    const frame::State state = look.state(one.index);
    if (!(state.flags & (frame::State::visible | frame::State::parted))) continue;
    if (!look.neuron_of(one).cluster_count || !look.turn.has(i, one.index)) continue;
    const std::uint32_t far = look.far(one.index, one.sphere, of_sights), near = of_sights & ~far;
    each_of(far, [&](std::size_t s) { ++cuts[s].far; });
    if (!near) continue;
    descent.add(i);
    if (state.kind == frame::Kind::somata && !descent.last().parted())
      descent.last().seen_by = near;
    else
      descent.add(descent.last().root, near);
  }
  descent.run();
  // The soma lies within its root.
  for (const Subject& neuron : descent.subjects())
    if (neuron.seen_by) choose_soma(look, neuron.standing, neuron.seen_by, cuts);
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
      if (!judged.in_sight(look, sight)) return;
      if (look.plain && look.straws_do(sight, judged.seen())) {
        cuts[s].far += node.count;
        return;
      }
      if (!judged.left_out(look, sight, {LeftOut::grove, 0, at, 0}, cuts[s])) within |= 1u << s;
    });
    if (!within) continue;
    for (std::uint32_t c = node.child_count; c-- > 0;) open.push_back({node.first_child + c, within});
    if (!node.child_count) choose_neurons(look, node.first, node.first + node.count, within, cuts);
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
  const Spheres spheres(Brick::group_count, [&](std::size_t g) { return b.group(std::uint32_t(g)); });
  Judged judged(look.cameras, spheres);
  each_of(groups & judged.may_see(sight), [&](std::size_t g) {
    const std::uint32_t drawn = shown & 255u << g * Brick::group_size;
    if (!drawn || judged.in_fog(look, g)) return;
    if (!judged.hidden(sight, g))
      put(drawn, spheres[g]);
    else if (look.keep)
      judged.leave_out({LeftOut::brick, 0, at, 1u << g}, cut, g);
  });
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
    const Seen seen = judged.seen();
    std::uint32_t finer = 0;
    each_of(sights, [&](std::size_t s) {
      const Sight& sight = look.sights[s];
      if (!judged.in_sight(look, sight) || judged.left_out(look, sight, {LeftOut::brick, 0, at, 0}, cuts[s]))
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

// So many cuts of nothing, with the memory that they had.
std::span<Cut> emptied(std::vector<Cut>& cuts, std::size_t count) {
  if (cuts.size() < count) cuts.resize(count);
  for (Cut& cut : std::span(cuts).first(count)) {
    cut.dots.clear(), cut.lines.clear(), cut.capsules.clear(), cut.left_out.clear();
    cut.segments = 0, cut.far = 0;
  }
  return std::span(cuts).first(count);
}

// What `choose_some(p, cuts)` adds to each of so many cuts for every p below `count`, in this order.
std::vector<Cut> in_parts(std::size_t count, std::size_t cuts, auto&& choose_some) {
  Lent<std::vector<Cut>> lent;
  const std::span<Cut> parts = emptied(*lent, count * cuts);
  parallel_for(count, 1, [&](std::size_t p) { choose_some(p, parts.subspan(p * cuts, cuts)); });
  std::vector<Cut> whole(cuts);
  parallel_for(4 * cuts, 1, [&](std::size_t n) {
    const std::size_t c = n / 4;
    const auto take = [&](auto member) {
      join(whole[c].*member, member, std::span<const Cut>(parts), c, cuts);
    };
    switch (n % 4) {
      case 0:
        return take(&Cut::dots);
      case 1:
        return take(&Cut::lines);
      case 2:
        return take(&Cut::capsules);
      default:
        take(&Cut::left_out);
    }
  });
  for (std::size_t p = 0; p < parts.size(); ++p) {
    whole[p % cuts].segments += parts[p].segments;
    whole[p % cuts].far += parts[p].far;
  }
  return whole;
}

// Where each of so many portions begins that may take about as long as one another, and where the last one ends.
std::vector<std::size_t> portions(const Forest& forest, std::span<const LeftOut> left_out) {
  std::vector<std::size_t> bounds{0};
  std::size_t weight = 0;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    const LeftOut& l = left_out[i];
    const std::size_t more = l.what == LeftOut::grove
                                 ? 8 * std::size_t(forest.groves().nodes()[l.number].count)
                             : l.what == LeftOut::brick && !l.groups ? 64
                                                                     : 1;
    if (weight > 0 && weight + more > left_out_at_once) bounds.push_back(i), weight = 0;
    weight += more;
  }
  if (!left_out.empty()) bounds.push_back(left_out.size());
  return bounds;
}

// Sorts a list from near to far, in 64 steps an octave, and returns where each step begins.
constexpr std::size_t octaves = 24, steps = 64 * octaves;
using Starts = std::array<std::uint32_t, steps + 1>;

// By the centre: a large sphere around the eye says little of where its branches are. Of a float the highest bits are its octave,
// and the next six a 64th of it.
std::size_t step_of(const frame::Item& item, const Eye& eye) {
  const float depth = eye.nearest_depth({{item.x, item.y, item.z}, 0.f}) / eye.camera().near;
  constexpr std::uint32_t from = std::bit_cast<std::uint32_t>(1.f) >> 17;
  const std::uint32_t at = std::bit_cast<std::uint32_t>(std::max(depth, 1.f)) >> 17;
  return std::min<std::size_t>(at - from, steps - 1);
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

// What is given, or else one of its own.
class KnownCloseness {
 public:
  KnownCloseness(const Forest& forest, const Eye& eye, Closeness* given) : given_(given) {
    if (!given) own_.emplace(forest).seen_by(eye);
  }
  Closeness& operator*() { return given_ ? *given_ : *own_; }

 private:
  Closeness* given_;
  std::optional<Closeness> own_;
};

// From near to far, in bands.
void arrange(Cut& cut, const Eye& eye) {
  std::array<std::vector<frame::Item>*, 3> lists{&cut.dots, &cut.lines, &cut.capsules};
  std::array<Starts, 3> starts;
  parallel_for(3, 1, [&](std::size_t i) { starts[i] = sort_near_to_far(*lists[i], eye); });
  cut.bands = bands_of(starts[0], starts[1], starts[2]);
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

std::vector<Cut> choose(const Forest& forest, std::span<const Sight> sights, const Shown& shown,
                        Closeness* closeness, const Turn& turn) {
  KnownCloseness known(forest, sights.front().eye, closeness);
  const Look look{forest, sights, true, shown, *known, turn};
  const auto groves = forest.groves().parts(neurons_at_once), bricks = parts_of(forest.bricks());
  std::vector<Cut> cuts =
      in_parts(groves.size() + bricks.size(), sights.size(), [&](std::size_t i, std::span<Cut> parts) {
        if (i < groves.size())
          choose_grove(look, {groves[i], look.all()}, parts);
        else
          choose_bricks(look, {bricks[i - groves.size()], look.all()}, parts);
      });
  parallel_for(cuts.size(), 1, [&](std::size_t s) { arrange(cuts[s], sights[s].eye); });
  return cuts;
}

Cut choose(const Forest& forest, const Eye& eye, const Shown& shown) {
  const Sight sight{eye};
  return std::move(choose(forest, std::span(&sight, 1), shown).front());
}

Cut revealed(const Forest& forest, const Sight& now, std::span<const LeftOut> left_out, const Shown& shown,
             Closeness* closeness) {
  KnownCloseness known(forest, now.eye, closeness);
  const Look look{forest, std::span(&now, 1), false, shown, *known};
  const std::vector<std::size_t> bounds = portions(forest, left_out);
  const auto reveal = [&](std::size_t portion, std::span<Cut> cuts) {
    Descent descent(look, cuts);
    for (const LeftOut& l : left_out.subspan(bounds[portion], bounds[portion + 1] - bounds[portion])) {
      // Most are asked no more than this: the camera is that of the cut.
      if (l.seen.nearest > now.horizon) cuts.front().left_out.push_back(l);
      if (l.seen.nearest > now.horizon || (now.before && now.before->hide(l.seen))) continue;
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
          if (descent.subjects().empty() || descent.last().standing != l.standing) descent.add(l.standing);
          if (!l.groups) {
            descent.add(l.number, 1);
            break;
          }
          const Sphere sphere = descent.last().placed(look.clusters[l.number]);
          choose_groups(look, now, descent.last(), l.number, l.groups, look.cameras.now(sphere),
                        cuts.front());
      }
    }
    descent.run();
  };
  Cut cut = std::move(in_parts(bounds.size() - 1, 1, reveal).front());
  arrange(cut, now.eye);
  return cut;
}

}  // namespace forest::scene
