// SPDX-License-Identifier: Apache-2.0
// Growth that asks what is around: questions, forces, and the grammars that show them.
#include "forest/cortex/environment.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

#include "tests/effort.h"

namespace forest::lsystem {
namespace {

using cortex::Environment;
using cortex::Site;
using cortex::Slab;

Grammar shipped(const std::string& name) {
  return parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/" + name + ".lsys");
}

const Environment& cortex_of_layers() {
  static const Environment e({{"L1", 2050.f, 2200.f},
                              {"L2/3", 1550.f, 2050.f},
                              {"L4", 1300.f, 1550.f},
                              {"L5", 600.f, 1300.f},
                              {"L6", 0.f, 600.f}},
                             {}, {{{300, 400, 0}, 1.f, 120.f}});
  return e;
}

/// What the module of this name holds after some steps.
std::vector<double> told(const std::string& text, const std::string& module, const Site& site,
                         int steps = 2) {
  const Grammar g = parse(text, "question");
  const Word word = derive(g, 1, 0, steps, site);
  for (const Module& m : word.modules)
    if (g.symbols[m.symbol] == module) return {word.of(m).begin(), word.of(m).end()};
  return {};
}

TEST(Questions, TellWhatIsAtTheTurtle) {
  const Environment e({{"L1", 90.f, 100.f}, {"L2/3", 50.f, 90.f}}, {{{10, 80, 0}, 4.f}, {{0, 60, 0}, 5.f}},
                      {{{0, 180, 0}, 2.f, 50.f}});
  const Site site{&e, {0, 60, 0}};  // the second soma is its own
  const std::string depth = "axiom: f(20) A ?D(0, 0, 0, 0) B\np: A > ?D(d, l, a, b) -> C(d, l, a, b) A\n";
  EXPECT_EQ(told(depth, "C", site), (std::vector<double>{20, 2, 10, 30}));
  EXPECT_EQ(told("axiom: f(20) A ?N(0, 0, 0, 0)\np: A > ?N(d, x, y, z) -> C(d, x, y, z) A\n", "C", site),
            (std::vector<double>{6, 1, 0, 0}));
  const auto attracted =
      told("axiom: f(20) A ?A(0, 0, 0, 0)\np: A > ?A(d, x, y, z) -> C(d, x, y, z) A\n", "C", site);
  ASSERT_EQ(attracted.size(), 4u);
  EXPECT_NEAR(attracted[0], 2. * std::exp(-2.), 1e-12);
  EXPECT_NEAR(attracted[2], 1., 1e-12);
  // As many as are asked for.
  EXPECT_EQ(told("axiom: f(20) A ?D(0)\np: A > ?D(d) -> C(d) A\n", "C", site), std::vector<double>{20});
}

TEST(Questions, WithoutAnEnvironmentEverythingIsFarAway) {
  EXPECT_EQ(told("axiom: A ?D(7, 7, 7, 7)\np: A > ?D(d, l, a, b) -> C(d, l, a, b) A\n", "C", {}),
            (std::vector<double>{1e9, 0, 1e9, 1e9}));
  EXPECT_EQ(told("axiom: A ?N(7, 7, 7, 7)\np: A > ?N(d, x, y, z) -> C(d, x, y, z) A\n", "C", {}),
            (std::vector<double>{1e9, 0, 0, 0}));
  EXPECT_EQ(told("axiom: A ?A(7, 7, 7, 7)\np: A > ?A(d, x, y, z) -> C(d, x, y, z) A\n", "C", {}),
            (std::vector<double>{0, 0, 0, 0}));
}

// Branches in which nothing grows are gone over once; places are counted from a soma in one of them all the same.
TEST(Questions, TellTheSameBesideBranchesInWhichNothingGrows) {
  const Site site{&cortex_of_layers(), {0, 1000, 0}};
  for (const char* silent : {"", "[ +(90) F(30) [ F(5) ] F(5) ]", "[ F(3) ] [ [ F(2) ] ]",
                             "[ +(40) F(3) ?D(0) F(2) ]", "[ +(40) F(3) ?D(0) [ F(2) ] ]"})
    EXPECT_EQ(told(std::string("axiom: ") + silent + " F(7) " + silent +
                       " [ F(3) A ?D(0) ] F(100)\np: A > ?D(d) -> C(d) A\n",
                   "C", site),
              std::vector<double>{1190});
  EXPECT_EQ(
      told("axiom: F(7) [ Soma(5) ] F(3) A ?P(0, 0, 0)\np: A > ?P(x, y, z) -> C(x, y, z) A\n", "C", site),
      (std::vector<double>{0, 3, 0}));
  // From within it and from outside branches are seen in which nothing grows.
  EXPECT_EQ(told("axiom: [ F(7) ?D(0) [ [ A ] ] ]\np: ?D(d) < A -> C(d)\n", "C", site),
            std::vector<double>{1193});
  EXPECT_EQ(told("axiom: A(0) [ ?D(0) F(3) ]\np: A(x) > [ ?D(d) ] -> F(10) A(d)\n", "A", site, 3),
            std::vector<double>{1180});
}

// The hash is of what is in an environment: one more thing, or one elsewhere, is another.
TEST(Environments, WhatGrewSaysInWhich) {
  const Grammar g = parse("axiom: F(1)\np: z -> z\n", "g");
  const auto told = [&](const Environment* e, const std::string& key) {
    const Morphology m = grow(g, 1, 2, {e, {3, 4, 5}, "column"});
    for (const auto& [k, value] : m.annotations())
      if (k == key) return value;
    return std::string();
  };
  EXPECT_EQ(told(nullptr, "environment") + told(nullptr, "environment_hash") + told(nullptr, "grown_at"), "");
  const Slab layer{"L1", 0.f, 10.f};
  const Sphere soma{{1, 2, 3}, 4.f};
  const cortex::Attractor attractor{.at = {1, 2, 3}};
  const Environment all[] = {Environment(),
                             Environment({layer}),
                             Environment({{"L2", 0.f, 10.f}}),
                             Environment({{"L1", 0.f, 11.f}}),
                             Environment({layer}, {soma}),
                             Environment({layer}, {{{1, 2, 4}, 4.f}}),
                             Environment({}, {soma}),
                             Environment({layer}, {soma}, {attractor}),
                             Environment({layer}, {}, {attractor}),
                             Environment({layer}, {soma}, {{.at = {1, 2, 3}, .reach = 7.f}})};
  std::set<std::string> hashes;
  for (const Environment& e : all) {
    EXPECT_EQ(told(&e, "environment"), "column");
    EXPECT_EQ(told(&e, "grown_at"), "3, 4, 5");
    hashes.insert(told(&e, "environment_hash"));
  }
  EXPECT_EQ(hashes.size(), std::size(all));
  EXPECT_EQ(Environment({layer}, {soma}, {attractor}).hash(), all[7].hash());
}

Vec3 last_heading(const std::string& axiom, const Site& site) {
  std::string many;
  for (int i = 0; i < 300; ++i) many += " F(1)";
  const Grammar g = parse("axiom: " + axiom + many + "\np: z -> z\n", "force");
  const Morphology m = interpret(derive(g, 0, 0, 0), g, {}, site);
  const auto points = m.points();
  return (points.back().position() - points[points.size() - 2].position()).normalized();
}

TEST(Forces, SeekGoesToAttractorsAndAwayFromRepellents) {
  for (const float strength : {1.f, -1.f}) {
    const Environment e({}, {}, {{{10000, 100, 0}, strength, 5000.f}});
    const Site site{&e, {0, 100, 0}};
    EXPECT_GT(strength * last_heading("Seek(0.1)", site).x(), .99f);
    EXPECT_LT(strength * last_heading("Seek(-0.1)", site).x(), -.99f);
  }
  EXPECT_EQ(last_heading("Seek(0.1)", {}), Vec3(0, 1, 0));
}

TEST(Forces, ShunTurnsAwayFromSomataThatAreNear) {
  const Environment e({}, {{{30, 150, 0}, 10.f}});
  const Site site{&e, Vec3::Zero()};
  EXPECT_LT(last_heading("Shun(0.3, 15)", site).x(), -.2f);
  EXPECT_LT(std::abs(last_heading("Shun(0.3, 0.5)", site).x()), 1e-6f);
  EXPECT_EQ(last_heading("Shun(0.3, 15)", {}), Vec3(0, 1, 0));
}

TEST(Forces, AvoidKeepsBelowThePia) {
  const Environment e({{"L1", 0.f, 100.f}});
  const Grammar g = parse("axiom: !(2) Avoid(3) F(60) F(60) F(60) F(60)\np: z -> z\n", "x");
  const Morphology m = interpret(derive(g, 0, 0, 0), g, {}, {&e, Vec3::Zero()});
  EXPECT_NEAR(m.bounds().high.y(), 100.f - 3.f, 1e-3f);  // the bounds have the radius in them
  EXPECT_NEAR(total_length(m), 240., 1e-2);
}

double above(const Morphology& m, float y) {
  double highest = -1e9;
  for (const Point& p : m.points()) highest = std::max(highest, double(p.y + p.radius));
  return highest - double(y);
}

double mean_extent(const std::vector<Morphology>& cells, int axis, SectionKind kind) {
  double sum = 0.;
  for (const Morphology& m : cells) {
    Bounds b;
    for (std::size_t s = 0; s < m.sections().size(); ++s)
      if (m.sections()[s].kind == kind)
        for (const Point& p : m.points(SectionId(s))) b.add(p.position());
    sum += double(b.extent()[axis]);
  }
  return sum / double(cells.size());
}

TEST(Tufted, TheSameModelGrowsDifferentlyNearThePiaAndNeverAboveIt) {
  LONG_TEST();
  const Grammar g = shipped("tufted");
  const Environment& e = cortex_of_layers();
  std::vector<Morphology> cells[2];
  for (const float depth : {1500.f, 150.f}) {
    const auto grown = grow_population(g, 40, 7, Progress::none(), 0, {&e, {0, 2200.f - depth, 0}});
    for (const Morphology& m : grown) {
      EXPECT_LE(above(m, depth), 1e-3);
      for (const Finding& f : validate(m)) EXPECT_NE(f.severity, Severity::warning) << f.sentence;
    }
    cells[depth < 1000.f] = grown;
  }
  EXPECT_GT(mean_extent(cells[0], 1, SectionKind::apical), 1350.);  // up to layer 1
  EXPECT_LT(mean_extent(cells[1], 1, SectionKind::apical), 450.);
  for (const Morphology& m : cells[0]) EXPECT_GT(above(m, 1500.f), -150.);  // tufts reach layer 1
}

TEST(Tufted, GrowsWithoutAnEnvironmentToo) {
  const auto cells = grow_population(shipped("tufted"), 20, 3);
  EXPECT_NEAR(mean_extent(cells, 1, SectionKind::apical), 1500., 400.);
  for (const Morphology& m : cells) EXPECT_LT(m.segment_count(), 6000u);
}

// Where its axon is drawn to: the mean distance of its nearest end from the attractor, with it and without.
TEST(Tufted, AxonsComeToWhatAttractsThem) {
  const Grammar g = shipped("tufted");
  const Environment& with = cortex_of_layers();
  const Environment without({with.layers().begin(), with.layers().end()});
  const auto nearest = [&](const Environment& e) {
    const Vec3 at(0, 700, 0), target = Vec3(300, 400, 0) - at;
    double sum = 0.;
    for (const Morphology& m : grow_population(g, 40, 5, Progress::none(), 0, {&e, at})) {
      float least = 1e9f;
      for (std::size_t s = 0; s < m.sections().size(); ++s)
        if (m.sections()[s].kind == SectionKind::axon)
          for (const Point& p : m.points(SectionId(s)))
            least = std::min(least, (p.position() - target).norm());
      sum += double(least);
    }
    return sum / 40.;
  };
  EXPECT_LT(nearest(with), 0.6 * nearest(without));
}

TEST(Tufted, IsTheSameAtAnyNumberOfThreads) {
  const Grammar g = shipped("tufted");
  const Site site{&cortex_of_layers(), {0, 1500, 0}};
  const auto many = grow_population(g, 8, 3, Progress::none(), 0, site);
  const ThreadLimit one(1);
  EXPECT_EQ(many, grow_population(g, 8, 3, Progress::none(), 0, site));
  EXPECT_EQ(many[5], grow(g, 3, 5, site));
  EXPECT_NE(many[5], grow(g, 3, 5));
}

// The length of one kind by layer, as shares.
std::map<int, double> by_layer(const std::vector<Morphology>& cells, SectionKind kind, const Site& site) {
  std::map<int, double> lengths;
  double all = 0.;
  for (const Morphology& m : cells)
    for (std::size_t s = 0; s < m.sections().size(); ++s) {
      if (m.sections()[s].kind != kind) continue;
      const auto points = m.points(SectionId(s));
      for (std::size_t i = 1; i < points.size(); ++i) {
        const Vec3 middle = .5f * (points[i - 1].position() + points[i].position()) + site.at;
        const double length = segment_length(points[i - 1], points[i]);
        lengths[site.environment->stratum(middle.cast<double>()).layer] += length;
        all += length;
      }
    }
  for (auto& [layer, length] : lengths) length /= all;
  return lengths;
}

TEST(Stellate, DendritesStayInLayerFourAndTheAxonClimbs) {
  const Grammar g = shipped("stellate");
  const Site site{&cortex_of_layers(), {0, 1425, 0}};
  const auto cells = grow_population(g, 60, 5, Progress::none(), 0, site);
  auto dendrites = by_layer(cells, SectionKind::basal, site), axon = by_layer(cells, SectionKind::axon, site);
  EXPECT_GT(dendrites[4], .95);
  EXPECT_GT(axon[4] + axon[2], .7);
  EXPECT_GT(axon[2], axon[5] + axon[6]);
  for (const Morphology& m : cells) {
    const auto stems = std::ranges::count_if(
        m.roots(), [&](SectionId root) { return m.section(root).kind == SectionKind::basal; });
    EXPECT_GE(stems, 4);
    EXPECT_LE(stems, 6);
  }
}

TEST(Stellate, GrowsWithoutAnEnvironmentToo) {
  for (const Morphology& m : grow_population(shipped("stellate"), 20, 3)) {
    EXPECT_LT(m.segment_count(), 6000u);
    for (const Finding& f : validate(m)) EXPECT_NE(f.severity, Severity::warning) << f.sentence;
  }
}

// Dendrites sprout and elongate; then all but one are taken back from their tips, step by step.
TEST(Retraction, DendritesShrinkFromTheirTipsUntilOneIsLeft) {
  LONG_TEST();
  const Grammar g = shipped("retraction");
  Deriver deriver(g);
  double most = 0.;
  for (std::uint64_t index = 0; index < 10; ++index) {
    std::size_t highest = 0, last = 0, shrank = 0;
    std::vector<Point> before;  // the first dendrite
    for (int step = 1; step <= g.steps; ++step) {
      const Morphology m = grow_to(deriver, g, 9, index, step);
      last = m.roots().size();
      highest = std::max(highest, last);
      std::vector<Point> now;
      if (!m.roots().empty() && m.points(m.roots()[0]).front() ==
                                    (before.empty() ? m.points(m.roots()[0]).front() : before.front()))
        now.assign(m.points(m.roots()[0]).begin(), m.points(m.roots()[0]).end());
      for (std::size_t i = 1; i < std::min(now.size(), before.size()); ++i)  // what stays does not move
        ASSERT_EQ(now[i], before[i]) << index << " at " << step;
      shrank += !now.empty() && now.size() + 1 == before.size();
      before = now.empty() ? before : now;
    }
    EXPECT_GE(highest, 4u) << index;
    EXPECT_EQ(last, 1u) << index;
    const Morphology grown = grow(g, 9, index);
    EXPECT_GT(grown.sections().size(), 3u) << index;  // the one that is left became a tree
    most += double(shrank);
  }
  EXPECT_GT(most, 30.);
}

}  // namespace
}  // namespace forest::lsystem
