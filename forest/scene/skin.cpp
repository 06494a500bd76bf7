// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/skin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/scene/placed.h"
#include "forest/scene/surfaces.h"

namespace forest::scene {
namespace {

constexpr int coarsest = -2, finest = 6;      // levels: voxels of 4 µm to 1/64 µm
constexpr float thickest_voxels = 2.f;        // a section is in the skin from a radius of so many voxels on
constexpr float gap_voxels = .1f;             // further out than the cones, for triangles cut corners
constexpr float spine_voxel = .25f;           // µm: coarser pieces have none
constexpr float thinnest_voxels = .75f;       // thinner branches would break (geometry/polygonise.h)
constexpr std::size_t most_kept = 6'000'000;  // triangles

// Of spines a µm, by section kind.
constexpr std::array<float, 8> spine_density{0, 0, 0, 1, 1, 0, 0, 0};
constexpr float spineless = 20.f;  // µm from the soma

float voxel_of(int level) { return std::exp2(-float(level)); }

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.f, 1.f);
  return t * t * (3.f - 2.f * t);
}

Sphere around(const BranchCone& c) {
  return {.5f * (c.shape.a + c.shape.b),
          .5f * (c.shape.b - c.shape.a).norm() + std::max(c.shape.radius_a, c.shape.radius_b)};
}

// Depth of a sphere's farthest point.
float farthest_depth(const Eye& eye, const Sphere& s) {
  return eye.nearest_depth({s.centre, 0.f}) + s.radius;
}

// Pixels a µm where a sphere is nearest, but for what lies so near that it has no skin.
float magnification_of(const Eye& eye, const Sphere& s) {
  const float magnification = eye.magnification(s);
  return eye.camera().orthographic() ? magnification
                                     : magnification * std::min(1.f, eye.nearest_depth(s) / skin_nearest);
}

bool meet(const Sphere& a, const Sphere& b) { return (a.centre - b.centre).norm() <= a.radius + b.radius; }

}  // namespace

// A distinct neuron as it is needed for pieces.
struct Skin::Shape {
  std::vector<BranchCone>
      cones;  // the original segments; branch 0 the soma, section s branch s + 1, label its kind
  std::vector<float> widths;  // of branches: the largest diameter, µm
  struct BranchPoint {
    Joint joint;
    float width = 0.f;  // of its thinnest branch
  };
  std::vector<BranchPoint> joints;
  std::vector<Spine> spines;
  bool grown = false;  // they are
  Vec3 origin = Vec3::Zero();

  Shape(const Forest& forest, std::uint32_t which) {
    const Neuron& neuron = forest.neurons()[which];
    const auto sections = forest.sections().subspan(neuron.first_section, neuron.section_count);
    widths.assign(neuron.section_count + 1, 0.f);
    Bounds bounds;
    std::vector<std::uint32_t> first(sections.size() + 1, 0xffffffffu), last = first;
    for (std::uint32_t i = 0; i < neuron.original_count; ++i) {
      const frame::Segment& s = forest.segments()[neuron.first_segment + i];
      const std::uint32_t section = forest.section_of_segment()[neuron.first_original + i];
      BranchCone& cone = cones.emplace_back();
      cone.shape = {{s.ax, s.ay, s.az}, {s.bx, s.by, s.bz}, from_half(s.radii), from_half(s.radii >> 16)};
      cone.branch = section == soma_section ? 0 : section + 1;
      cone.label = std::uint8_t(s.meta & 7u);
      bounds.add(cone.shape.a, cone.shape.radius_a), bounds.add(cone.shape.b, cone.shape.radius_b);
      // A stem is fastened by a cone within the soma, which says nothing of its width.
      const bool inside = cone.branch && cone.shape.a.norm() < .5f * neuron.soma_radius;
      float& width = widths[cone.branch];
      width = std::max(
          width, 2.f * (inside ? cone.shape.radius_b : std::max(cone.shape.radius_a, cone.shape.radius_b)));
      if (first[cone.branch] == 0xffffffffu) first[cone.branch] = i;
      last[cone.branch] = i;
    }
    origin = bounds.empty()
                 ? Vec3::Zero()
                 : Vec3(bounds.low - Vec3::Constant(PieceLattice::margin_voxels * voxel_of(coarsest)));
    add_joints(sections, first, last, neuron.soma_radius);
  }

  // Once pieces are so fine that they have some.
  void grow_spines(const Forest& forest, std::uint32_t which) {
    if (grown) return;
    grown = true;
    const Neuron& neuron = forest.neurons()[which];
    if (spiny(forest, which))
      add_spines(forest.sections().subspan(neuron.first_section, neuron.section_count), which);
  }

 private:
  static bool spiny(const Forest& forest, std::uint32_t which) {
    for (std::size_t i = 0; i < forest.instances().size(); ++i)
      if (forest.instances()[i].morphology == which) {
        const auto type = forest.types()[i];
        const auto& types = forest.circuit().types;
        return type < types.size() && types[type].excitatory && !types[type].glia;
      }
    return false;
  }

  // As of a whole neuron (morphology/surface.cpp): as far as three radii they are rounded, by half a radius.
  void add_joints(std::span<const SectionFacts> sections, std::span<const std::uint32_t> first,
                  std::span<const std::uint32_t> last, float soma_radius) {
    std::vector<std::vector<std::uint32_t>> children(sections.size());
    for (std::uint32_t s = 0; s < sections.size(); ++s)
      if (sections[s].parent < sections.size()) children[sections[s].parent].push_back(s);
    const auto add = [&](const Vec3& centre, float radius, std::vector<std::uint32_t> branches) {
      BranchPoint point{{centre, 3.f * radius, .5f * radius, std::move(branches)}, INFINITY};
      for (const std::uint32_t branch : point.joint.branches)
        point.width = std::min(point.width, widths[branch]);
      if (radius > 0.f) joints.push_back(std::move(point));
    };
    for (std::uint32_t s = 0; s < sections.size(); ++s) {
      if (!children[s].empty() && last[s + 1] < cones.size()) {
        std::vector<std::uint32_t> branches{s + 1};
        for (const std::uint32_t child : children[s]) branches.push_back(child + 1);
        const RoundCone& end = cones[last[s + 1]].shape;
        add(end.b, end.radius_b, std::move(branches));
      }
      if (sections[s].parent < sections.size() || !(soma_radius > 0.f) || first[s + 1] >= cones.size())
        continue;
      const RoundCone& stem = cones[first[s + 1]].shape;
      const Vec3 out = stem.b - stem.a;
      if (stem.a.norm() < 1.5f * soma_radius && out.norm() > 0.f)
        add(stem.a.norm() < .5f * soma_radius ? Vec3(soma_radius * stem.b.normalized()) : stem.a,
            std::min(stem.radius_b, soma_radius), {0, s + 1});
    }
  }

  void add_spines(std::span<const SectionFacts> sections, std::uint32_t which) {
    std::vector<float> begun(sections.size(), 0.f);  // path within the section so far
    std::vector<std::uint32_t> count(sections.size(), 0);
    for (std::uint32_t i = 0; i < cones.size(); ++i) {
      if (cones[i].branch == 0) continue;
      const std::uint32_t s = cones[i].branch - 1;
      const RoundCone& cone = cones[i].shape;
      const Vec3 way = cone.b - cone.a;
      const float length = way.norm(), density = spine_density[sections[s].kind & 7u];
      const float from = begun[s];
      begun[s] += length;
      if (!(density > 0.f) || !(length > 0.f)) continue;
      const float before = sections[s].path_distance - sections[s].length;  // from the soma to the section
      const Vec3 along = way / length, side = along.unitOrthogonal(), other = along.cross(side);
      for (;; ++count[s]) {
        // One in each piece of the path as long as they lie apart, anywhere in it.
        Random random(0x5b1e5, std::uint64_t(which) << 32 | s, count[s]);
        const float at = (float(count[s]) + float(random.uniform())) / density;
        if (at >= from + length) break;
        const float t = (at - from) / length, turn = float(random.uniform(0., 2. * double(pi)));
        if (at < from || before + at < spineless) continue;
        const float shaft = cone.radius_a + t * (cone.radius_b - cone.radius_a);
        const auto spread = [&](double mean, double sd, double low, double high) {
          return float(random.truncated_normal(mean, sd, low, high));
        };
        Spine spine;
        spine.base = cone.a + t * way;
        spine.head = spread(.19, .06, .11, .36);
        spine.neck = std::min(spread(.08, .03, .05, .16), .7f * spine.head);
        const float reach = shaft + std::max(spread(.85, .3, .35, 1.9) - spine.head, .5f * spine.head);
        const float lean = spread(0., .25, -.6, .6);
        spine.tip = spine.base + reach * (std::cos(turn) * side + std::sin(turn) * other + lean * along);
        spine.segment = i;
        spines.push_back(spine);
      }
    }
  }
};

Skin::Skin(Forest forest) : forest_(std::move(forest)) {}
Skin::~Skin() = default;
Skin::Skin(Skin&&) noexcept = default;
Skin& Skin::operator=(Skin&&) noexcept = default;

// Of a section, or of half the soma, whose skin begins at twice the width; µm.
float Skin::widest(std::uint32_t which) {
  if (widest_.empty()) widest_.assign(forest_.neurons().size(), -1.f);
  float& known = widest_[which];
  if (known < 0.f) {
    const Neuron& neuron = forest_.neurons()[which];
    known = neuron.soma_radius;
    for (const SectionFacts& s : forest_.sections().subspan(neuron.first_section, neuron.section_count))
      known = std::max({known, s.diameter_start, s.diameter_end});
  }
  return known;
}

Skin::Shape& Skin::shape(std::uint32_t neuron) {
  auto& known = shapes_[neuron];
  if (!known) known = std::make_unique<Shape>(forest_, neuron);
  return *known;
}

const std::vector<Spine>& Skin::spines(std::uint32_t neuron) {
  shape(neuron).grow_spines(forest_, neuron);
  return shape(neuron).spines;
}

PieceLattice Skin::lattice(std::uint32_t neuron, int level) {
  return {shape(neuron).origin, voxel_of(level)};
}

std::unique_ptr<Skin::Made> Skin::make(const Shape& shape, const PieceLattice& lattice, const Key& key) {
  const auto& [neuron, level, cell] = key;
  const float voxel = lattice.voxel, gap = gap_voxels * voxel;
  Sphere near = lattice.around(cell);
  near.radius += piece_band * voxel;
  const auto within = [&](std::uint32_t branch) {
    return .5f * shape.widths[branch] >= thickest_voxels * voxel;
  };
  std::vector<BranchCone> cones;
  std::vector<Joint> joints;
  std::vector<std::uint32_t> segments;  // of cones
  Sphere wide = near;                   // what is rounded reaches further
  for (const Shape::BranchPoint& point : shape.joints)
    if (.5f * point.width >= thickest_voxels * voxel && meet(near, {point.joint.centre, point.joint.reach})) {
      joints.push_back(point.joint);
      wide.radius = std::max(wide.radius, near.radius + point.joint.rounding);
    }
  const auto add = [&](BranchCone cone, std::uint32_t segment) {
    for (float* radius : {&cone.shape.radius_a, &cone.shape.radius_b})
      *radius = std::max(*radius + gap, thinnest_voxels * voxel);
    cones.push_back(cone), segments.push_back(segment);
  };
  for (std::uint32_t i = 0; i < shape.cones.size(); ++i)
    if (within(shape.cones[i].branch) && meet(wide, around(shape.cones[i]))) add(shape.cones[i], i);
  const std::size_t shafts = cones.size();
  if (voxel <= spine_voxel) {
    auto branch = std::uint32_t(shape.widths.size());
    for (const Spine& spine : shape.spines) {
      const BranchCone& shaft = shape.cones[spine.segment];
      ++branch;
      if (!within(shaft.branch) ||
          !meet(near, {spine.tip, (spine.tip - spine.base).norm() + spine.head + .5f}))
        continue;
      const Vec3 out = spine.tip - spine.base;
      add({{spine.base, spine.tip, spine.neck, spine.neck}, branch, shaft.label}, spine.segment);
      add({{spine.tip, spine.tip, spine.head, spine.head}, branch, shaft.label}, spine.segment);
      // Where the neck leaves the shaft; and the head.
      const float radius = std::max(spine.neck, thinnest_voxels * voxel),
                  shaft_radius = std::max(shaft.shape.radius_a, shaft.shape.radius_b);
      joints.push_back({spine.base + std::min(1.f, shaft_radius / out.norm()) * out,
                        3.f * radius + gap,
                        1.2f * radius,
                        {shaft.branch, branch}});
    }
  }
  auto made = std::make_unique<Made>();
  made->version = next_version();
  if (cones.empty()) return made;
  made->piece = polygonise_piece(cones, joints, lattice, cell);
  for (const std::uint32_t cone : made->piece.cones) {
    const BranchCone& shaft = shape.cones[segments[cone]];
    const float width = shape.widths[shaft.branch];
    made->segment.push_back(segments[cone]);
    made->kind.push_back(shaft.label);
    made->width.push_back(cone < shafts ? width : -width);
  }
  return made;
}

const Skin::Shape& Skin::prepared(const Key& key) {
  const auto& [neuron, level, cell] = key;
  Shape& of = shape(neuron);
  if (voxel_of(level) <= spine_voxel) of.grow_spines(forest_, neuron);
  return of;
}

const Skin::Made& Skin::piece(const Key& key) {
  auto& known = made_[key];
  if (!known) {
    const Shape& of = prepared(key);
    known = make(of, lattice(std::get<0>(key), std::get<1>(key)), key);
    kept_ += known->piece.mesh.triangles.size();
  }
  return *known;
}

namespace {

// A neuron near the eye.
struct Near {
  std::uint32_t instance = 0;
  float share = 1.f;                       // of the widths from which it has a skin
  std::vector<std::uint32_t> segments;     // wide enough, among the neuron's original ones
  std::vector<const frame::State*> parts;  // of its sections; null: its own
};

// Where a piece is needed.
struct Wanted {
  Skin::Key key;
  std::size_t near;  // which neuron
  float magnification;
  bool operator<(const Wanted& o) const {
    return std::tuple(-magnification, key, near) < std::tuple(-o.magnification, o.key, o.near);
  }
};

}  // namespace

void Skin::show(frame::Frame& frame, const Cut& cut, const Eye& eye, const Colouring& colouring,
                const Chooser::Painter& painter, const SkinLimits& limits) {
  ++picture_;
  figures_ = {};
  const auto instances = forest_.instances();
  const Shown shown = colouring.shown();
  const auto state_of = [&](std::uint32_t instance) {
    return shown.states.empty() ? frame::State{} : shown.states[instance];
  };
  const auto share_of = [](frame::Kind kind) {
    return kind == frame::Kind::any ? 1.f : kind == frame::Kind::skin ? .5f : 0.f;
  };

  // Who is near: those with capsules that stand for original segments wide enough.
  std::vector<Near> list;
  std::unordered_map<std::uint32_t, std::size_t> places;
  for (const frame::Item& item : cut.capsules) {
    const frame::State state = item.state ? frame::unpacked(item.state) : state_of(item.instance);
    const float share = share_of(state.kind);
    if (share == 0.f) continue;
    const Sphere sphere{{item.x, item.y, item.z}, item.radius};
    const float magnification = eye.magnification(sphere);
    const std::uint32_t which = instances[item.instance].morphology;
    if (1.5f * magnification * widest(which) < skin_begins * share)
      continue;  // between its ends a section may be wider
    const Neuron& neuron = forest_.neurons()[which];
    const std::uint32_t first = item.first_segment - neuron.first_segment;
    if (first >= neuron.original_count) continue;
    const Shape& of = shape(which);
    const Placed place(instances[item.instance]);
    std::optional<std::size_t> at;
    for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1) {
      const std::uint32_t segment = first + std::uint32_t(std::countr_zero(drawn));
      if (segment >= of.cones.size()) break;
      const BranchCone& cone = of.cones[segment];
      const Sphere ball = place(around(cone));
      if (of.widths[cone.branch] * eye.magnification(ball) < skin_begins * share * (cone.branch ? 1.f : 2.f))
        continue;
      if (!eye.frustum().may_see(ball)) continue;
      if (!at) {
        const auto [known, added] = places.try_emplace(item.instance, list.size());
        if (added) list.push_back({item.instance, share, {}, {}});
        at = known->second;
      }
      list[*at].share = std::min(list[*at].share, share);
      list[*at].segments.push_back(segment);
    }
  }

  // How coarse it must be to keep the number of triangles.
  const auto level_at = [](float magnification, float coarser) {
    return std::clamp(int(std::ceil(std::log2(magnification / (voxel_pixels * coarser)))), coarsest, finest);
  };
  // How much smaller than usual voxels must be for a branch of so many pixels that is forced to have a skin.
  const auto fineness = [](float width, float share) { return std::clamp(width / skin_begins, share, 1.f); };
  // Somewhere along a segment, which may be long: its parts that are in sight, as long as they are wide.
  struct Stretch {
    RoundCone cone;
    float magnification, width, share;
  };
  std::vector<Stretch> parts;
  for (const Near& near : list) {
    const Shape& of = shape(instances[near.instance].morphology);
    const Placed place(instances[near.instance]);
    for (const std::uint32_t segment : near.segments) {
      const BranchCone& whole = of.cones[segment];
      const RoundCone& c = whole.shape;
      const float thick = c.radius_a + c.radius_b;
      const int count = std::clamp(int((c.b - c.a).norm() / std::max(thick, 1e-3f)), 1, 32);
      for (int k = 0; k < count; ++k) {
        const float from = float(k) / float(count), to = float(k + 1) / float(count);
        const auto radius = [&](float t) { return c.radius_a + t * (c.radius_b - c.radius_a); };
        const BranchCone one{
            {c.a + from * (c.b - c.a), c.a + to * (c.b - c.a), radius(from), radius(to)}, 0, 0};
        const Sphere ball = place(around(one));
        if (eye.frustum().may_see(ball) && farthest_depth(eye, ball) > skin_nearest)
          parts.push_back({one.shape, magnification_of(eye, ball), of.widths[whole.branch], near.share});
      }
    }
  }
  const double pixels = double(frame.width) * double(frame.height);
  float coarser = 1.f;
  for (int step = 0; step < 6; ++step) {
    double expected = 0.;
    for (const Stretch& part : parts) {
      if (part.width * part.magnification < skin_begins * part.share * coarser) continue;
      // Half of them are averted; and not more than fill the picture.
      const float finer = coarser * fineness(part.width * part.magnification, part.share);
      const double voxel = double(voxel_pixels * finer);
      expected += std::min(
          .5 * expected_triangles({{part.cone, 0, 0}}, voxel_of(level_at(part.magnification, finer))),
          25. * pixels / (voxel * voxel));
    }
    if (expected <= double(limits.triangles)) break;
    coarser *= float(std::clamp(std::sqrt(expected / double(limits.triangles)), 1.05, 2.));
  }

  // Which cells, each as fine as its nearest place asks for.
  std::vector<Wanted> wanted;
  for (std::size_t n = 0; n < list.size(); ++n) {
    const std::uint32_t which = instances[list[n].instance].morphology;
    const Shape& of = shape(which);
    const Placed place(instances[list[n].instance]);
    // Spines reach into cells that no segment does.
    const auto spine_ball = [&](std::uint32_t k) {
      const Spine& spine = of.spines[k];
      const float half = .5f * (spine.tip - spine.base).norm();
      return Sphere{.5f * (spine.base + spine.tip), half + spine.head + skin_gap * spine_voxel};
    };
    const auto look = [&](auto&& self, int level, const PieceLattice::Cell& cell,
                          std::span<const std::uint32_t> segments,
                          std::span<const std::uint32_t> spines) -> void {
      const PieceLattice grid{of.origin, voxel_of(level)};
      const Sphere ball = grid.around(cell), seen = place(ball);
      if (!eye.frustum().may_see(seen) || !(farthest_depth(eye, seen) > skin_nearest)) return;
      std::vector<std::uint32_t> here;
      for (const std::uint32_t segment : segments)
        if (meet(ball, around(of.cones[segment])) &&
            signed_distance(ball.centre, of.cones[segment].shape) < ball.radius)
          here.push_back(segment);
      const float magnification = magnification_of(eye, seen);
      std::vector<std::uint32_t> on;
      for (const std::uint32_t k : spines)
        if (meet(ball, spine_ball(k))) on.push_back(k);
      if (here.empty() && (on.empty() || magnification < spines_begin * coarser)) return;
      float finer = 1.f;
      for (const std::uint32_t segment : here)
        finer = std::min(finer, fineness(of.widths[of.cones[segment].branch] * magnification, list[n].share));
      if (level < level_at(magnification, coarser * finer)) {
        for (std::int64_t child = 0; child < 8; ++child)
          self(self, level + 1,
               PieceLattice::Cell{2 * cell[0] + (child & 1), 2 * cell[1] + (child >> 1 & 1),
                                  2 * cell[2] + (child >> 2)},
               here, on);
        return;
      }
      if (here.empty() && voxel_of(level) > spine_voxel) return;
      wanted.push_back({{which, level, cell}, n, magnification});
    };
    Bounds box;
    float nearest = 0.f;  // magnification
    for (const std::uint32_t segment : list[n].segments) {
      const Sphere ball = around(of.cones[segment]);
      box.add(ball.centre, ball.radius);
      nearest = std::max(nearest, magnification_of(eye, place(ball)));
    }
    std::vector<std::uint32_t> on;
    if (nearest >= spines_begin * coarser) {
      const std::unordered_set<std::uint32_t> wide(list[n].segments.begin(), list[n].segments.end());
      const std::vector<Spine>& spines = this->spines(which);
      for (std::uint32_t k = 0; k < spines.size(); ++k)
        if (wide.contains(spines[k].segment)) {
          on.push_back(k);
          box.add(spine_ball(k).centre, spine_ball(k).radius);
        }
    }
    if (box.empty()) continue;
    const auto [first, last] = PieceLattice{of.origin, voxel_of(coarsest)}.cells(box);
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t x = first[0]; x <= last[0]; ++x)
          look(look, coarsest, {x, y, z}, list[n].segments, on);
  }
  std::sort(wanted.begin(), wanted.end());

  // The nearest of them, as many as the limit allows. Those that are not there are made, a few at once.
  constexpr std::size_t at_once = 8;
  shown_.assign(frame.surfaces.begin(), frame.surfaces.end());
  const auto state_at = [&](const Near& near, std::uint32_t branch) {
    const frame::State* part = near.parts.empty() || branch == 0 ? nullptr : near.parts[branch - 1];
    return part ? *part : state_of(near.instance);
  };
  // How much of the skin is there at a vertex, 0–1.
  const auto presence_at = [&](const Made& made, std::size_t v, const Near& near, const Placed& place) {
    const std::uint32_t branch =
        shapes_.at(instances[near.instance].morphology)->cones[made.segment[v]].branch;
    const frame::State state = state_at(near, branch);
    const float share = share_of(state.kind) * coarser * (branch ? 1.f : 2.f);
    if (!(share > 0.f) || !state.is(frame::State::visible)) return 0.f;
    const Sphere at{place.position + place.turn * made.piece.mesh.positions[v], 0.f};
    const float magnification = eye.magnification(at);
    float presence =
        smooth_step(skin_begins * share, skin_complete * share, std::abs(made.width[v]) * magnification);
    if (made.width[v] < 0.f)
      presence *= smooth_step(spines_begin * coarser, spines_complete * coarser, magnification);
    if (!eye.camera().orthographic()) presence *= smooth_step(skin_nearest, skin_near, eye.nearest_depth(at));
    return presence;
  };
  // Whether anything of a piece is there and faces the eye: what is averted is hidden by the capsules that it lies around.
  const auto shows = [&](const Made& made, const Near& near) {
    const Placed place(instances[near.instance]);
    const Vec3 from = place.turn.transpose() * (eye.camera().eye - place.position),
               back = place.turn.transpose() * eye.camera().axes().col(2);
    for (std::size_t v = 0; v < made.piece.normals.size(); ++v) {
      const Vec3 to_eye = eye.camera().orthographic() ? back : Vec3(from - made.piece.mesh.positions[v]);
      if (made.piece.normals[v].dot(to_eye) > 0.f && presence_at(made, v, near, place) > 0.f) return true;
    }
    return false;
  };
  for (Near& near : list)
    if (state_of(near.instance).is(frame::State::parted))
      near.parts = section_states(forest_, shown, near.instance);
  struct Used {
    const Wanted* one;
    Made* made;
    float share;  // towards the limit less of a piece is there, so that none is seen to go
  };
  std::vector<Used> used;
  std::size_t triangles = 0;
  limits.progress->begin("skin", wanted.size());
  for (auto one = wanted.begin(); one != wanted.end(); ++one) {
    limits.progress->advance();
    if (!made_.contains(one->key)) {
      std::vector<Key> next;
      for (auto k = one;
           k != wanted.end() && next.size() < std::min(at_once, limits.new_pieces - figures_.made); ++k)
        if (!made_.contains(k->key) && std::ranges::find(next, k->key) == next.end()) next.push_back(k->key);
      for (const Key& key : next) prepared(key);
      std::vector<std::unique_ptr<Made>> fresh(next.size());
      parallel_for(next.size(), 1, [&](std::size_t k) {
        const auto& [neuron, level, cell] = next[k];
        const Shape& of = *shapes_.at(neuron);
        fresh[k] = make(of, {of.origin, voxel_of(level)}, next[k]);
      });
      for (std::size_t k = 0; k < next.size(); ++k) {
        kept_ += fresh[k]->piece.mesh.triangles.size();
        made_[next[k]] = std::move(fresh[k]);
      }
      figures_.made += next.size();
    }
    const auto found = made_.find(one->key);
    if (found == made_.end()) {
      ++figures_.missing;
      continue;
    }
    found->second->used = picture_;  // what is looked at to be left out is not to be made again either
    const std::size_t more = found->second->piece.mesh.triangles.size();
    if (!shows(*found->second, list[one->near])) continue;
    if (triangles + more > limits.triangles) break;
    triangles += more;
    used.push_back({&*one, found->second.get(),
                    1.f - smooth_step(.5f, 1.f, float(double(triangles) / double(limits.triangles)))});
  }

  limits.progress->end();

  // Activity colours segments: those that vertices are nearest to, in runs as a list has them.
  Cut runs;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> run_of;  // instance, segment / cluster_size
  if (painter) {
    for (const auto& [one, made, share] : used) {
      const std::uint32_t instance = list[one->near].instance;
      const std::uint32_t base = forest_.neurons()[instances[instance].morphology].first_segment;
      for (const std::uint32_t segment : made->segment) {
        const std::uint32_t run = segment / frame::cluster_size;
        const auto [known, added] = run_of.try_emplace({instance, run}, runs.capsules.size());
        if (added) runs.capsules.push_back({instance, base + run * frame::cluster_size, 0, 0, 0, 0, 0, 0});
        runs.capsules[known->second].drawn |= 1u << segment % frame::cluster_size;
      }
    }
    painter(runs, eye);
  }

  entries_.resize(used.size()), presence_.resize(used.size());
  std::vector<char> seen(used.size());
  parallel_for(used.size(), 1, [&](std::size_t k) {
    const auto& [one, made, share] = used[k];
    const Near& near = list[one->near];
    const Placed place(instances[near.instance]);
    const Shape& of = *shapes_.at(std::get<0>(one->key));
    const std::size_t count = made->segment.size();
    entries_[k].resize(count), presence_[k].resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      const std::uint32_t branch = of.cones[made->segment[v]].branch;
      const frame::State state = state_at(near, branch);
      std::uint32_t entry = state.colour_class * 8u + made->kind[v];
      const std::uint32_t opacity = (state.opacity * frame.opacities[entry] + 127u) / 255u;
      if (runs.entries) {
        const std::uint32_t segment = made->segment[v];
        const std::size_t run = run_of.at({near.instance, segment / frame::cluster_size});
        entry = runs.entries->capsules[run * frame::cluster_size + segment % frame::cluster_size];
      }
      entries_[k][v] = std::uint8_t(entry);
      presence_[k][v] =
          std::uint8_t(std::lround(share * presence_at(*made, v, near, place) * float(opacity)));
      seen[k] |= char(presence_[k][v] > 0);
    }
  });
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (!seen[k]) continue;
    const auto& [one, made, share] = used[k];
    frame::Surface& s = shown_.emplace_back();
    s.positions = made->piece.mesh.positions, s.normals = made->piece.normals;
    s.entries = entries_[k], s.presence = presence_[k];
    s.triangles = made->piece.mesh.triangles;
    s.instance = list[one->near].instance;
    s.version = made->version;
    ++figures_.pieces, figures_.triangles += s.triangles.size();
  }
  frame.surfaces = shown_;

  // Those not seen for the longest time are let go.
  if (kept_ <= most_kept) return;
  std::vector<decltype(made_)::iterator> unused;
  for (auto it = made_.begin(); it != made_.end(); ++it)
    if (it->second->used < picture_) unused.push_back(it);
  std::ranges::stable_sort(unused, {}, [](const auto& it) { return it->second->used; });
  for (const auto& it : unused) {
    if (kept_ <= most_kept) break;
    kept_ -= it->second->piece.mesh.triangles.size();
    made_.erase(it);
  }
}

}  // namespace forest::scene
