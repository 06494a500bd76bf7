// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/brick.h"

#include <bit>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/scene/cut.h"
#include "forest/scene/view.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

const frame::Viewport viewport{640, 360};

Forest planted(std::uint32_t neurons) {
  return Forest::from_bytes(pack(testing::sample_circuit(neurons), testing::sample_neurons()));
}

double area_of(const frame::Segment& s) {
  return double((Vec3(s.bx, s.by, s.bz) - Vec3(s.ax, s.ay, s.az)).norm()) * 2. * double(from_half(s.radii));
}

// Width × length of everything in the original branches.
double branch_area(const Forest& forest) {
  double area = 0.;
  for (const frame::Instance& i : forest.instances()) {
    const Neuron& n = forest.neurons()[i.morphology];
    for (const frame::Segment& s : forest.segments().subspan(n.first_segment, n.original_count)) {
      const double length = double((Vec3(s.bx, s.by, s.bz) - Vec3(s.ax, s.ay, s.az)).norm());
      const double a = double(from_half(s.radii)), b = double(from_half(s.radii >> 16));
      area += length > 0. ? length * (a + b) : 4. * a * a;
    }
  }
  return area;
}

// Bricks by how many straws' area a straw has.
std::vector<std::vector<const Brick*>> levels_of(const Forest& forest) {
  std::vector<std::vector<const Brick*>> levels;
  std::vector<const Brick*> level{&forest.bricks().front()};
  while (!level.empty()) {
    levels.push_back(level);
    std::vector<const Brick*> next;
    for (const Brick* b : level)
      for (std::uint32_t c = 0; c < b->child_count; ++c) next.push_back(&forest.bricks()[b->first_child + c]);
    level = std::move(next);
  }
  return levels;
}

TEST(Brick, EveryLevelHasTheAreaOfAllBranches) {
  const Forest forest = planted(400);
  const double area = branch_area(forest);
  const auto levels = levels_of(forest);
  ASSERT_GE(levels.size(), 4u);
  for (const auto& level : levels) {
    double here = 0.;
    for (const Brick* b : level)
      for (const frame::Segment& s : forest.segments().subspan(b->first_segment, b->segment_count))
        here += area_of(s);
    EXPECT_NEAR(here / area, 1., level.size() > 4 ? .03 : .25);  // a whole number of straws
  }
}

TEST(Brick, HoldsItsStrawsAndTheirNeurons) {
  const Forest forest = planted(300);
  const std::size_t first = forest.places().size();
  for (const Brick& b : forest.bricks()) {
    for (std::uint32_t i = 0; i < b.segment_count; ++i) {
      const frame::Segment& s = forest.segments()[b.first_segment + i];
      const Sphere group = b.group(i / Brick::group_size);
      for (const Vec3& p : {Vec3(s.ax, s.ay, s.az), Vec3(s.bx, s.by, s.bz)}) {
        EXPECT_LE((p - b.sphere().centre).norm(), b.radius * 1.0001f);
        EXPECT_LE((p - group.centre).norm(), group.radius * 1.0001f);
      }
      const frame::Owner& owner = forest.owners()[b.first_segment - first + i];
      const Sphere& neuron = forest.spheres()[owner.instance];
      EXPECT_LE((neuron.centre - b.sphere().centre).norm() + neuron.radius, b.neurons * 1.001f);
      // It is a piece of that neuron's branches, whole or in part.
      EXPECT_LE((Vec3(s.ax, s.ay, s.az) - neuron.centre).norm(), neuron.radius + b.length);
      const Neuron& of = forest.neurons()[forest.instances()[owner.instance].morphology];
      EXPECT_GE(owner.segment, of.first_segment);
      EXPECT_LT(owner.segment, of.first_segment + of.original_count);
      EXPECT_EQ(s.meta & 7u, forest.segments()[owner.segment].meta & 7u);
    }
    for (std::uint32_t c = 0; c < b.child_count; ++c) {
      const Brick& child = forest.bricks()[b.first_child + c];
      EXPECT_LE((child.sphere().centre - b.sphere().centre).norm() + child.radius, b.radius * 1.001f);
    }
  }
}

// Where a brick takes the place of those below, the same straws are drawn.
TEST(Brick, HoldsTheQuarterOfThoseBelowThatComesFirst) {
  const Forest forest = planted(300);
  const std::size_t first = forest.places().size();
  const auto owners_of = [&](const Brick& b, std::uint32_t shown) {
    std::multiset<std::pair<std::uint32_t, std::uint32_t>> owners;
    for (; shown; shown &= shown - 1) {
      const frame::Owner& o =
          forest.owners()[b.first_segment - first + std::uint32_t(std::countr_zero(shown))];
      owners.insert({o.instance, o.segment});
    }
    return owners;
  };
  for (const Brick& b : forest.bricks()) {
    std::multiset<std::pair<std::uint32_t, std::uint32_t>> below;
    bool whole = b.child_count > 0;
    for (std::uint32_t c = 0; c < b.child_count; ++c) {
      const Brick& child = forest.bricks()[b.first_child + c];
      whole &= child.segment_count == Brick::straws;
      const auto quarter = owners_of(child, 0x11111111u & child.all());
      below.insert(quarter.begin(), quarter.end());
    }
    if (whole) {
      EXPECT_EQ(owners_of(b, b.all()), below);
    }
    std::uint32_t before = 0;  // fewer from farther, and never others
    for (float magnification = 1e-4f; magnification < 10.f; magnification *= 1.3f) {
      EXPECT_EQ(before & ~b.shown(magnification), 0u);
      before = b.shown(magnification);
    }
    EXPECT_EQ(before, b.all());
  }
}

TEST(Brick, IsTheSameAtAnyNumberOfThreads) {
  const auto all = pack(testing::sample_circuit(200), testing::sample_neurons());
  const ThreadLimit one(1);
  EXPECT_EQ(pack(testing::sample_circuit(200), testing::sample_neurons()), all);
}

// Who is drawn, and as what.
struct Drawn {
  std::set<std::uint32_t> clusters, straws;
};
Drawn drawn_of(const Forest& forest, const Cut& cut) {
  Drawn drawn;
  for (const auto* list : {&cut.dots, &cut.lines, &cut.capsules})
    for (const frame::Item& item : *list) {
      if (item.instance != FOREST_IN_WORLD) {
        drawn.clusters.insert(item.instance);
        continue;
      }
      for (std::uint32_t rest = item.drawn; rest; rest &= rest - 1)
        drawn.straws.insert(
            forest.geometry().owner(item.first_segment + std::size_t(std::countr_zero(rest))).instance);
    }
  return drawn;
}

TEST(Brick, ANeuronIsDrawnByClustersOrByStraws) {
  const Forest forest = planted(500);
  View view = overview(forest);
  const Vec3 way = view.camera.eye - view.camera.target;
  std::size_t mixed = 0;
  Drawn before;
  for (float far = .05f; far < 100.f; far *= 1.25f) {
    view.camera.eye = view.camera.target + far * way;
    view.detail.error = view.detail.thinnest = 3.f;
    const Drawn drawn = drawn_of(forest, choose(forest, Eye(view.camera, viewport, view.detail)));
    std::vector<std::uint32_t> both;
    std::ranges::set_intersection(drawn.clusters, drawn.straws, std::back_inserter(both));
    EXPECT_TRUE(both.empty()) << far;
    mixed += !drawn.clusters.empty() && !drawn.straws.empty();
    before = drawn;
  }
  EXPECT_GT(mixed, 1u);
  EXPECT_TRUE(before.clusters.empty());
  EXPECT_FALSE(before.straws.empty());
}

TEST(Brick, AHiddenNeuronHasNoStraws) {
  const Forest forest = planted(200);
  View view = overview(forest);
  view.camera.eye = view.camera.target + 20.f * (view.camera.eye - view.camera.target);
  view.detail.thinnest = 1.f;
  std::vector<frame::State> states(forest.instances().size());
  for (std::size_t i = 0; i < states.size(); i += 3) states[i].flags = 0;
  states[1].kind = frame::Kind::capsules;  // of its own, also from afar
  const Drawn drawn = drawn_of(forest, choose(forest, Eye(view.camera, viewport, view.detail), {states, {}}));
  EXPECT_GT(drawn.straws.size(), 20u);
  for (const std::uint32_t i : drawn.straws) EXPECT_TRUE(i % 3 != 0 && i != 1) << i;
  EXPECT_EQ(drawn.clusters, std::set<std::uint32_t>{1});
}

TEST(Brick, StrawsCanBeForcedFromNearby) {
  const Forest forest = planted(60);
  View view = overview(forest);
  view.camera.eye = view.camera.target + .3f * (view.camera.eye - view.camera.target);
  std::vector<frame::State> states(forest.instances().size());
  for (frame::State& s : states) s.kind = frame::Kind::bricks;
  const Drawn drawn = drawn_of(forest, choose(forest, Eye(view.camera, viewport, view.detail), {states, {}}));
  EXPECT_TRUE(drawn.clusters.empty());
  EXPECT_GT(drawn.straws.size(), 10u);
}

}  // namespace
}  // namespace forest::scene
