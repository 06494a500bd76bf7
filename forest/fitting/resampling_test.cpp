// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/resampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"
#include "forest/fitting/copying.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/zoo.h"

namespace forest::fitting {
namespace {

using statistics::Arbors;

// Neurons of a simple kind, in a slice: stems that fork and wind.
std::vector<Morphology> traced(std::size_t count) {
  const lsystem::Grammar grammar = lsystem::parse(R"(
steps: 60
module Tip(d, left, n), Stems(n)
cell long = uniform(6, 12)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(2) F(long, 1.6) Tip(1.6, floor(uniform(1, 5)), 0) ] Stems(n + 1)
fork: Tip(d, left, n) : n > 2 & left > 0
  -> /(uniform(-30, 30)) [ +(30) Tip(0.8 * d, left - 1, 0) ] -(30) Tip(0.7 * d, left - 1, 0) : 0.4
grow: Tip(d, left, n) : n < 12 -> &(uniform(-5, 5)) +(uniform(-12, 12)) F(long, d) Tip(d, left, n + 1)
)",
                                                  "traced");
  return lsystem::grow_population(grammar, count, 11);
}

double mean_of(std::span<const Morphology> neurons, const char* metric) {
  const statistics::Metric& m = *statistics::find_metric(metric);
  std::vector<double> values;
  for (const Morphology& n : neurons) values.push_back(statistics::mean(m.values(Arbors(n))));
  return statistics::mean(values);
}

TEST(Resampling, GrowsNeuronsLikeTheTracedOnes) {
  const std::vector<Morphology> models = traced(40);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "like them"), "fitted");
  EXPECT_EQ(grammar.title, "like them");
  const std::vector<Morphology> grown = lsystem::grow_population(grammar, 80, 3);
  for (const char* metric : {"number_of_neurites", "number_of_leaves", "total_length", "max_branch_order",
                             "max_path_distance", "contraction", "remote_bifurcation_angles"}) {
    const double wanted = mean_of(models, metric);
    EXPECT_NEAR(mean_of(grown, metric), wanted, .2 * std::abs(wanted)) << metric;
  }
  // Tips differ between neurons about as much as they did.
  const auto spread = [](std::span<const Morphology> neurons) {
    std::vector<double> tips;
    for (const Morphology& n : neurons)
      tips.push_back(statistics::find_metric("number_of_leaves")->values(Arbors(n))[0]);
    return statistics::summarize(tips).sd;
  };
  EXPECT_GT(spread(grown), .6 * spread(models));
  EXPECT_LT(spread(grown), 1.6 * spread(models));
}

TEST(Resampling, TheSameNeuronsGiveTheSameText) {
  const std::vector<Morphology> models = traced(6);
  const std::string text = resampling_grammar(models, "t");
  EXPECT_EQ(text, resampling_grammar(models, "t"));
  const lsystem::Grammar grammar = lsystem::parse(text, "t");
  EXPECT_EQ(lsystem::grow(grammar, 1, 5), lsystem::grow(grammar, 1, 5));
  EXPECT_NE(lsystem::grow(grammar, 1, 5), lsystem::grow(grammar, 1, 6));
}

TEST(Resampling, TakesThreeBranchesInARowFromOneNeuronAtMost) {
  const std::vector<Morphology> models = traced(8);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  lsystem::Deriver deriver(grammar);
  std::size_t longest = 0;
  for (std::uint64_t i = 0; i < 100; ++i)
    longest = std::max(longest, longest_run(deriver.derive(2, i), grammar).value_or(0));
  EXPECT_EQ(longest, 3u);  // they do go on as in the neuron that they come from

  // A fork that is drawn anew comes from another neuron than the branch it ends.
  const auto& samples = grammar.lookups.samples;
  const auto forks = std::ranges::find(samples, "forks", &lsystem::Sample::name);
  ASSERT_NE(forks, samples.end());
  const auto donor = std::size_t(std::ranges::find(forks->outcomes, "donor") - forks->outcomes.begin());
  Random random(1);
  std::vector<double> wanted(forks->conditions.size(), 0.);
  wanted[0] = 3.;
  for (int cell = 0; cell < 8; ++cell) {
    wanted[1] = cell;
    for (int i = 0; i < 20; ++i) EXPECT_NE(forks->outcome(forks->draw(wanted, random), donor), double(cell));
  }
}

TEST(Resampling, SoManyNeuronsAsWereTracedHaveEachOnesStems) {
  const std::vector<Morphology> models = traced(12);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const auto stems = [](std::span<const Morphology> neurons) {
    std::vector<Vec3> places;
    for (const Morphology& n : neurons) {
      const Point first = n.points(n.roots()[0]).front(), soma = n.soma().sphere();
      places.push_back(first.position() - soma.position());
    }
    return places;
  };
  const std::vector<Vec3> theirs = stems(models), grown = stems(lsystem::grow_population(grammar, 24, 5));
  for (const Vec3& place : theirs)
    for (std::size_t half : {0, 12})
      EXPECT_EQ(std::ranges::count_if(std::span(grown).subspan(half, 12),
                                      [&](const Vec3& g) { return (g - place).norm() < .02f; }),
                1);
}

// Two arbors that fork in their first point, where they leave the soma, and one that does not.
TEST(Resampling, WhatForksWhereItLeavesTheSomaStaysOneArbor) {
  std::vector<Morphology> models;
  for (std::uint64_t i = 0; i < 6; ++i) {
    Random random(3, i);
    MorphologyBuilder builder;
    builder.set_soma(zoo_parts::sphere(5));
    for (int stem = 0; stem < 3; ++stem) {
      const double angle = 2. * stem + .1 * random.normal();
      const auto at = [&](double way, double turn) {
        return Point{float(way * std::cos(angle + turn)), float(way * std::sin(angle + turn)),
                     float(random.normal()), .5f};
      };
      const Point first = at(5., 0.), fork = stem ? first : at(25., 0.);
      const SectionId root = stem ? builder.add_section({}, SectionKind::basal, std::array{first})
                                  : builder.add_section({}, SectionKind::basal, std::array{first, fork});
      for (const double side : {-.3, .4})
        builder.add_section(root, SectionKind::basal, std::array{fork, at(60. + 5. * random.normal(), side)});
    }
    models.push_back(builder.build());
  }
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  for (const Morphology& m : lsystem::grow_population(grammar, 12, 1)) {
    ASSERT_EQ(m.roots().size(), 3u);
    std::size_t single = 0;
    for (const SectionId root : m.roots()) single += m.points(root).size() == 1;
    EXPECT_EQ(single, 2u);
    EXPECT_EQ(m.sections().size(), 9u);
  }
}

// Arbors that leave one point, and no soma.
Morphology insect(std::uint64_t i, int stems) {
  Random random(7, i);
  MorphologyBuilder builder;
  const Point root{10.f, 20.f, 30.f, 1.5f};
  const SectionId begin = builder.add_section({}, SectionKind::axon, std::array{root});
  const auto branch = [&](SectionId parent, const Point& from, double angle, auto&& again, int left) -> void {
    std::vector<Point> points{from};
    for (int k = 0; k < 4; ++k) {
      Point p = points.back();
      p.x += float(5. * std::cos(angle)), p.y += float(5. * std::sin(angle)), p.z += float(random.normal());
      p.radius = .5f;
      points.push_back(p);
    }
    const SectionId id = builder.add_section(parent, SectionKind::axon, points);
    if (left > 0)
      for (const double side : {-.5, .6})
        again(id, points.back(), angle + side + .1 * random.normal(), again, left - 1);
  };
  for (int s = 0; s < stems; ++s) branch(begin, root, 2. * s + .2 * random.normal(), branch, 1 + s % 2);
  return builder.build();
}

TEST(Resampling, WhatHasNoSomaBeginsAtItsFibre) {
  const std::vector<Morphology> models{insect(0, 3), insect(1, 2), insect(2, 4)};
  Resampling axons;
  axons.kinds = {SectionKind::axon};
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "insects", axons), "insects");
  std::set<std::size_t> stems;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Morphology grown = lsystem::grow(grammar, 1, i);
    EXPECT_EQ(grown.soma().kind, SomaKind::none);
    ASSERT_EQ(grown.roots().size(), 1u);
    EXPECT_EQ(grown.points(grown.roots()[0]).size(), 1u);
    EXPECT_EQ(grown.points()[0].radius, 1.5f);
    for (const Section& s : grown.sections()) EXPECT_EQ(s.kind, SectionKind::axon);
    stems.insert(grown.children(grown.roots()[0]).size());
  }
  EXPECT_EQ(stems, (std::set<std::size_t>{2, 3, 4}));
}

TEST(Resampling, AnAxonOnADendriteIsAStemOfItsOwn) {
  std::vector<Morphology> models;
  for (const Morphology& n : traced(6)) {  // its last section that ends is an axon that forks once
    MorphologyBuilder builder;
    builder.set_soma(n.soma());
    SectionId last;
    for (std::uint32_t i = 0; i < n.sections().size(); ++i) {
      const Section& s = n.section(SectionId(i));
      const SectionId id = builder.add_section(s.parent, s.kind, n.points(SectionId(i)));
      if (n.is_terminal(SectionId(i))) last = id;
    }
    Point from = n.points(last).back(), on = from, left, right;
    from.radius = .2f, on.radius = .2f, on.y -= 30.f, left = right = on;
    left.x -= 20.f, right.x += 20.f;
    const SectionId axon = builder.add_section(last, SectionKind::axon, std::array{from, on});
    builder.add_section(axon, SectionKind::axon, std::array{on, left});
    builder.add_section(axon, SectionKind::axon, std::array{on, right});
    models.push_back(builder.build());
  }
  Resampling whole;
  whole.kinds = statistics::KindSet::all();
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "whole", whole), "whole");
  double sections = 0.;
  for (const Morphology& grown : lsystem::grow_population(grammar, 20, 2)) {
    const Arbors axon(grown, {SectionKind::axon});
    EXPECT_EQ(axon.stems().size(), 1u);
    sections += double(axon.sections().size());
  }
  EXPECT_NEAR(sections / 20., 3., 1.);
}

TEST(Resampling, TooFewNeuronsAreRefused) {
  std::vector<Morphology> one = traced(1);
  EXPECT_THROW((void)resampling_grammar(one, "t"), Error);
  EXPECT_THROW((void)resampling_grammar({}, "t"), Error);
  std::vector<Morphology> models = traced(4);
  Resampling axons;
  axons.kinds = {SectionKind::axon};
  EXPECT_THROW((void)resampling_grammar(models, "t", axons), Error);
}

}  // namespace
}  // namespace forest::fitting
