// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/skin.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/scene/view.h"

#include "tests/effort.h"
#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

Forest small_forest() {
  circuit::Circuit circuit = testing::sample_circuit(6);
  for (auto& instance : circuit.instances) instance.type = 0;  // excitatory
  return Forest::from_bytes(pack(circuit, testing::sample_neurons()));
}

// The original segments of a distinct neuron that a skin of this level is around.
std::vector<RoundCone> cones_of(const Forest& forest, std::uint32_t which, float thinnest = 0.f) {
  const Neuron& neuron = forest.neurons()[which];
  std::map<std::uint32_t, float> widest;
  std::vector<std::pair<std::uint32_t, RoundCone>> all;
  for (std::uint32_t i = 0; i < neuron.original_count; ++i) {
    const frame::Segment& s = forest.segments()[neuron.first_segment + i];
    const RoundCone cone{
        {s.ax, s.ay, s.az}, {s.bx, s.by, s.bz}, from_half(s.radii), from_half(s.radii >> 16)};
    const std::uint32_t section = forest.section_of_segment()[neuron.first_original + i];
    all.emplace_back(section, cone);
    widest[section] = std::max(widest[section], std::max(cone.radius_a, cone.radius_b));
  }
  std::vector<RoundCone> cones;
  for (const auto& [section, cone] : all)
    if (widest[section] >= thinnest) cones.push_back(cone);
  return cones;
}

float distance(const Vec3& p, const std::vector<RoundCone>& cones) {
  float least = 1e9f;
  for (const RoundCone& cone : cones) least = std::min(least, signed_distance(p, cone));
  return least;
}

struct Welded {
  Mesh mesh;
  bool normals_agree = true;
};

// All pieces of a neuron at a level as one mesh, equal places being one vertex.
Welded welded(Skin& skin, const Forest& forest, std::uint32_t which, int level) {
  Bounds box;
  for (const RoundCone& cone : cones_of(forest, which))
    box.add(cone.a, cone.radius_a + 2.f), box.add(cone.b, cone.radius_b + 2.f);
  const auto [first, last] = skin.lattice(which, level).cells(box);
  Welded all;
  std::map<std::array<float, 3>, std::uint32_t> known;
  std::vector<Vec3> normals;
  for (std::int64_t z = first[2]; z <= last[2]; ++z)
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
      for (std::int64_t x = first[0]; x <= last[0]; ++x) {
        const Piece& piece = skin.piece({which, level, {x, y, z}}).piece;
        std::vector<std::uint32_t> place;
        for (std::size_t i = 0; i < piece.mesh.positions.size(); ++i) {
          const Vec3& p = piece.mesh.positions[i];
          const auto [at, added] = known.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(normals.size()));
          if (added)
            all.mesh.positions.push_back(p), all.mesh.labels.push_back(0),
                normals.push_back(piece.normals[i]);
          else
            all.normals_agree &= normals[at->second] == piece.normals[i];
          place.push_back(at->second);
        }
        for (const Triangle& t : piece.mesh.triangles)
          all.mesh.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
      }
  return all;
}

TEST(Skin, PiecesMakeOneClosedSurfaceAroundTheCapsules) {
  const Forest forest = small_forest();
  Skin skin(forest);
  for (const int level : {0, 1}) {
    const float voxel = std::exp2(-float(level));
    const Welded all = welded(skin, forest, 2, level);
    ASSERT_GT(all.mesh.triangles.size(), 1000u);
    EXPECT_TRUE(is_closed(all.mesh));
    EXPECT_TRUE(all.normals_agree);
    const std::vector<RoundCone> cones = cones_of(forest, 2, 2.f * voxel);
    // No triangle's middle lies within a capsule; none lies further out than the gap, but where branches are rounded.
    std::size_t far = 0;
    for (const Triangle& t : all.mesh.triangles) {
      const Vec3 middle =
          (all.mesh.positions[t[0]] + all.mesh.positions[t[1]] + all.mesh.positions[t[2]]) / 3.f;
      const float d = distance(middle, cones);
      EXPECT_GT(d, -.01f * voxel);
      EXPECT_LT(d, 2.f);
      far += d > .12f * voxel;
    }
    EXPECT_LT(double(far), .25 * double(all.mesh.triangles.size()));
  }
}

TEST(Skin, SpinesAreOneAMicrometreOfDendriteAndOfTheStatedSizes) {
  const Forest forest = small_forest();
  Skin skin(forest);
  const auto& spines = skin.spines(0);
  const Neuron& neuron = forest.neurons()[0];
  double length = 0.;
  for (std::uint32_t s = 0; s < neuron.section_count; ++s) {
    const SectionFacts& facts = forest.sections()[neuron.first_section + s];
    length += double(std::clamp(facts.path_distance - 20.f, 0.f, facts.length));
  }
  EXPECT_NEAR(double(spines.size()) / length, 1., .05);
  double heads = 0., lengths = 0.;
  const std::vector<RoundCone> cones = cones_of(forest, 0);
  std::set<std::array<float, 3>> places;
  for (const Spine& s : spines) {
    const RoundCone& shaft = cones[s.segment];
    EXPECT_LT(signed_distance(s.base, shaft), 0.f);
    EXPECT_GT(signed_distance(s.tip, shaft), 0.f);
    EXPECT_LT(s.neck, s.head);
    heads += double(s.head), lengths += double(signed_distance(s.tip, shaft) + s.head);
    EXPECT_TRUE(places.insert({s.tip.x(), s.tip.y(), s.tip.z()}).second);
  }
  EXPECT_NEAR(heads / double(spines.size()), .2, .03);
  EXPECT_NEAR(lengths / double(spines.size()), .85, .15);
  // A function of the neuron alone.
  Skin other(forest);
  ASSERT_EQ(other.spines(0).size(), spines.size());
  EXPECT_EQ(other.spines(0)[spines.size() / 2].tip, spines[spines.size() / 2].tip);
  // Neurons planted as inhibitory have none.
  circuit::Circuit circuit = testing::sample_circuit(6);
  for (auto& instance : circuit.instances) instance.type = 1;
  Skin smooth(Forest::from_bytes(pack(circuit, testing::sample_neurons())));
  EXPECT_TRUE(smooth.spines(0).empty());
}

// A view of a forest, and what is near in it.
struct Close {
  Forest forest = small_forest();
  Targets targets{forest};
  View view;
  Colouring colouring;
  Cut cut;
  frame::Frame frame;
  Skin skin{forest};

  explicit Close(float distance, std::vector<Appearance> shown = {}) {
    const frame::Instance& i = forest.instances()[0];
    view.camera.target = Vec3(i.x, i.y, i.z);
    view.camera.eye = view.camera.target + distance * Vec3(.3f, .2f, 1.f).normalized();
    view.camera.near = .05f;
    view.targets = std::move(shown);
    colouring = colour(targets, view);
  }
  Eye eye() const { return {view.camera, {640.f, 360.f}, detail_for(view, 640, 360)}; }
  std::span<const frame::Surface> show(const SkinLimits& limits = {}) {
    cut = choose(forest, eye(), colouring.shown());
    frame = compose(forest, view, colouring, cut, 640, 360);
    skin.show(frame, cut, eye(), colouring, {}, limits);
    EXPECT_NO_THROW(frame::check(frame, forest.geometry()));
    return frame.surfaces;
  }
  // Presence summed over all vertices.
  double presence() const {
    double sum = 0.;
    for (const frame::Surface& s : frame.surfaces)
      for (const std::uint8_t p : s.presence) sum += p / 255.;
    return sum;
  }
};

TEST(Skin, IsThereNearTheEyeAndNowhereElse) {
  Close near(40.f);
  EXPECT_GT(near.show().size(), 0u);
  EXPECT_GT(near.presence(), 1000.);
  for (const frame::Surface& s : near.frame.surfaces) {
    EXPECT_LT(s.instance, near.forest.instances().size());
    EXPECT_NE(s.version, 0u);
  }
  Close far(5000.f);
  EXPECT_EQ(far.show().size(), 0u);
  // Surfaces that the frame has stay.
  const std::vector<Vec3> corners(3, Vec3::Zero()), normals(3, Vec3::UnitX());
  const std::vector<std::uint8_t> entries(3, 0);
  frame::Surface cortex;
  cortex.positions = corners, cortex.normals = normals, cortex.entries = entries;
  const std::vector<frame::Surface> list{cortex};
  near.frame.surfaces = list;
  near.skin.show(near.frame, near.cut, near.eye(), near.colouring);
  EXPECT_EQ(near.frame.surfaces[0].instance, frame::Surface::in_world);
  EXPECT_GT(near.frame.surfaces.size(), 1u);
}

TEST(Skin, KindsAreObeyed) {
  const auto with = [](std::optional<frame::Kind> kind, std::optional<bool> visible = {},
                       std::optional<float> opacity = {}, float distance = 60.f) {
    Appearance a;
    a.name = "all", a.kind = kind, a.visible = visible, a.opacity = opacity;
    Close close(distance, {a});
    close.show();
    return close.presence();
  };
  const double any = with({});
  EXPECT_GT(any, 500.);
  for (const frame::Kind kind :
       {frame::Kind::capsules, frame::Kind::lines, frame::Kind::dots, frame::Kind::somata})
    EXPECT_EQ(with(kind), 0.);
  EXPECT_EQ(with({}, false), 0.);
  EXPECT_NEAR(with({}, {}, .5f) / any, .5, .02);
  // Forced, there is skin on branches half as wide.
  EXPECT_GT(with(frame::Kind::skin, {}, {}, 150.f), 2. * with({}, {}, {}, 150.f));
  // A branch of its own state.
  Appearance branch;
  branch.branch = Branch{0, soma_section};
  branch.kind = frame::Kind::capsules;
  Close close(60.f, {branch});
  close.show();
  for (const frame::Surface& s : close.frame.surfaces) EXPECT_NE(s.instance, 0u);
}

TEST(Skin, WhereItIsForcedWideBranchesAreNoFiner) {
  Appearance all;
  all.name = "all", all.kind = frame::Kind::skin;
  Appearance bare;  // … and where it is not
  bare.name = "all";
  const SkinLimits much{.triangles = 100'000'000};
  const auto triangles = [&](const Appearance& a) {
    Close close(40.f, {a});
    close.show(much);
    return double(close.skin.figures().triangles);
  };
  const double own = triangles(bare), forced = triangles(all);
  EXPECT_GT(own, 10'000.) << forced;
  EXPECT_GT(forced, own);               // thinner branches have it, too
  EXPECT_LT(forced, 1.5 * own) << own;  // twice as many where all voxels are half as wide
}

TEST(Skin, IsTheSameAtAnyNumberOfThreads) {
  std::vector<std::vector<float>> seen[2];
  for (const unsigned threads : {1u, 4u}) {
    const ThreadLimit limit(threads);
    Close close(30.f);
    for (const frame::Surface& s : close.show({.triangles = 60'000})) {
      std::vector<float>& list = seen[threads > 1].emplace_back();
      for (const Vec3& p : s.positions) list.insert(list.end(), {p.x(), p.y(), p.z()});
      for (const Vec3& n : s.normals) list.insert(list.end(), {n.x(), n.y(), n.z()});
      for (std::size_t i = 0; i < s.presence.size(); ++i)
        list.push_back(s.presence[i] + 256.f * s.entries[i]);
      for (const Triangle& t : s.triangles) list.push_back(float(t[0] + t[1] + t[2]));
    }
  }
  EXPECT_GT(seen[0].size(), 0u);
  EXPECT_EQ(seen[0], seen[1]);
}

TEST(Skin, KeepsItsLimits) {
  LONG_TEST();
  Close close(80.f);
  close.show({.triangles = 1u << 30});
  const std::size_t all = close.skin.figures().triangles;
  Close less(80.f);
  less.show({.triangles = all / 2});
  EXPECT_LE(less.skin.figures().triangles, all / 2);
  EXPECT_GT(less.skin.figures().triangles, 0u);
  Close slow(80.f);
  std::size_t pictures = 0, missing = 1;
  for (; missing && pictures < 2000; ++pictures) {
    slow.show({.new_pieces = 3});
    EXPECT_LE(slow.skin.figures().made, 3u);
    missing = slow.skin.figures().missing;
  }
  EXPECT_GT(pictures, 1u);
  Close at_once(80.f);
  at_once.show();
  EXPECT_EQ(at_once.skin.figures().triangles, slow.skin.figures().triangles);
  at_once.show();
  EXPECT_EQ(at_once.skin.figures().made, 0u);  // kept
}

TEST(Skin, FadesInWhileOneComesNearer) {
  Close close(60.f);
  double before = 0.;
  std::size_t vertices = 1;
  for (float distance = 300.f; distance > 100.f; distance *= .93f) {
    close.view.camera.eye = close.view.camera.target + distance * Vec3(.3f, .2f, 1.f).normalized();
    close.show();
    vertices = 1;
    for (const frame::Surface& s : close.frame.surfaces) vertices += s.presence.size();
    const double share = close.presence() / double(vertices);
    EXPECT_LT(std::abs(share - before), .35) << distance;
    before = share;
  }
  EXPECT_GT(close.presence(), 0.);
}

}  // namespace
}  // namespace forest::scene
