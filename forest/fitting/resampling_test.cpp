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
#include "forest/fitting/mixing.h"
#include "forest/fitting/traced.h"
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

// The grammar with another value of one of its settings.
std::string with(std::string grammar, const std::string& setting, const std::string& value) {
  const std::string begin = "#define " + setting + " ";
  const std::size_t at = grammar.find(begin) + begin.size();
  return grammar.replace(at, grammar.find("  #", at) - at, value);
}

// Neurons with a soma of 5 µm; what else they have is added to each with random numbers of its own.
std::vector<Morphology> each_with(std::uint64_t count, std::uint64_t seed, auto&& add) {
  std::vector<Morphology> neurons;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(seed, i);
    MorphologyBuilder builder;
    builder.set_soma(zoo_parts::sphere(5));
    add(builder, random, i);
    neurons.push_back(builder.build());
  }
  return neurons;
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

// Branches come from many neurons, flat and steep ones; in each neuron they are made as steep as its style says.
TEST(Resampling, NeuronsDifferInHowSteepTheyAreAsTracedOnesDo) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 60
module Tip(n), Stems(n)
cell climb = uniform(2, 40)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(1) F(8) Tip(0) ] Stems(n + 1)
fork: Tip(n) : n > 1 -> [ +(30) Tip(n + 1) ] -(30) Tip(n + 1) : 0.2
grow: Tip(n) : n < 8 -> ^(uniform(-climb, climb)) F(8) Tip(n + 1)
)",
                                                                                 "steep"),
                                                                  30, 4);
  // Drawn for all alike, or only branches of neurons as steep would be drawn.
  const std::string text = resampling_grammar(models, "steep", Resampling{.tracer = 5.});
  const std::string evened = with(text, "steep", "0");
  const auto spread = [](std::span<const Morphology> neurons) {
    std::vector<double> slopes;
    for (const Morphology& n : neurons)
      slopes.push_back(statistics::find_metric("length_fraction_along_z")->values(Arbors(n))[0]);
    return statistics::summarize(slopes).sd;
  };
  const auto grown = [](const std::string& grammar) {
    return lsystem::grow_population(lsystem::parse(grammar, "fitted"), 90, 1);
  };
  EXPECT_GT(spread(grown(text)), .75 * spread(models));
  EXPECT_LT(spread(grown(text)), 1.25 * spread(models));
  EXPECT_LT(spread(grown(evened)), .95 * spread(grown(text)));
}

// In some neurons all branches are about as steep, in others they differ; a neuron's branches come from both.
TEST(Resampling, BranchesOfANeuronDifferInHowSteepTheyAreAsItsOwnDid) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 60
module Tip(n, climb), Stems(n)
cell uneven = uniform(4, 16)
distribution climb(i) = uniform(20 - uneven, 20 + uneven)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(1) F(8) Tip(0, climb(0)) ] Stems(n + 1)
fork: Tip(n, c) : n > 1 & n < 7 -> [ +(30) Tip(n + 1, climb(1)) ] -(30) Tip(n + 1, climb(2)) : 0.3
grow: Tip(n, c) : n < 10 { a = if(chance(0.5), c, 0 - c) } -> ^(a) F(8) &(a) Tip(n + 1, c)
)",
                                                                                 "uneven"),
                                                                  40, 6);
  const std::string text = resampling_grammar(models, "uneven", Resampling{.tracer = 5.});
  const auto spread =
      [](std::span<const Morphology> neurons) {  // among neurons, of how much their sections differ
        std::vector<double> differ;
        for (const Morphology& n : neurons)
          differ.push_back(statistics::summarize(
                               statistics::find_metric("section_length_fractions_along_z")->values(Arbors(n)))
                               .sd);
        return statistics::summarize(differ).sd;
      };
  const auto grown = [](const std::string& grammar) {
    return lsystem::grow_population(lsystem::parse(grammar, "fitted"), 80, 1);
  };
  EXPECT_GT(spread(grown(text)), 1.1 * spread(grown(with(text, "ragged", "0"))));
  EXPECT_GT(spread(grown(text)), .6 * spread(models));
  EXPECT_LT(spread(grown(text)), 1.2 * spread(models));
}

// Half of them were traced by somebody who changes the plane of focus at one step of three, half by somebody who does at each.
TEST(Resampling, KeepsThePlanesOfFocusOfWhoTracedThem) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 60
module Tip(n), Stems(n)
cell seldom = chance(0.5)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(1) F(8) Tip(0) ] Stems(n + 1)
fork: Tip(n) : n > 1 & n < 7 -> [ +(30) Tip(n + 1) ] -(30) Tip(n + 1) : 0.2
far: Tip(n) : n < 8 & seldom { a = uniform(-40, 40) } -> ^(a) F(2) &(a) F(4) F(3) Tip(n + 1)
near: Tip(n) : n < 8 & !seldom { a = uniform(-20, 20) } -> ^(a) F(3) &(a) Tip(n + 1)
)",
                                                                                 "planes"),
                                                                  60, 4);
  const auto shares = [](std::span<const Morphology> neurons) {
    std::vector<double> of_each;
    for (const Morphology& n : neurons)
      of_each.push_back(statistics::find_metric("level_segment_fraction")->values(Arbors(n))[0]);
    return of_each;
  };
  const std::vector<double> were = shares(models),
                            are = shares(lsystem::grow_population(
                                lsystem::parse(resampling_grammar(models, "planes"), "fitted"), 120, 1));
  EXPECT_NEAR(statistics::mean(are), statistics::mean(were), .1 * statistics::mean(were));
  EXPECT_GT(statistics::summarize(are).sd, .7 * statistics::summarize(were).sd);
}

// All branches that fork are 5 µm long, and all that end 45 µm: a fork of two that bore three would have a short tip.
TEST(Resampling, WhatForksAndWhatEndsAreAsLongAsTheyWere) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 60
module Tip(n), Stems(n)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 3 -> [ -(120 * n + uniform(-20, 20)) f(7) !(1) F(5) Tip(floor(uniform(1, 7))) ] Stems(n + 1)
end: Tip(n) : n < 2 -> F(20) F(20)
fork: Tip(n) { m = floor(uniform(1, n)) } -> [ +(30) &(uniform(-20, 20)) F(2) F(3) Tip(m) ] -(30) F(2) F(3) Tip(n - m)
)",
                                                                                 "short within"),
                                                                  24, 1);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  std::size_t tips = 0, amiss = 0;
  for (const Morphology& n : lsystem::grow_population(grammar, 200, 1)) {
    for (const double length : statistics::find_metric("section_term_lengths")->values(Arbors(n)))
      tips += 1, amiss += length < 15.;
    for (const double length : statistics::find_metric("section_bif_lengths")->values(Arbors(n)))
      amiss += length > 20.;
  }
  EXPECT_GT(tips, 1000u);
  EXPECT_LE(amiss, tips / 500);  // one of twenty when tips were asked for by their logarithm alone
}

// Branches 4 µm long end .7 to 1 times as thick as they begin. What was traced at another diameter makes up for it
// farther on, so that no branch changes more than traced ones do.
TEST(Resampling, ShortBranchesChangeTheirDiametersNoMoreThanTheyDid) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 60
module Tip(n, d), Stems(n)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 3 -> [ -(120 * n + uniform(-20, 20)) f(7) !(4) F(4) Tip(0, 4) ] Stems(n + 1)
fork: Tip(n, d) : n < 5 { a = d * uniform(0.7, 1), b = d * uniform(0.7, 1) }
  -> [ +(30) F(2) !(a) F(2) Tip(n + 1, a) ] -(30) F(2) !(b) F(2) Tip(n + 1, b)
)",
                                                                                 "short"),
                                                                  12, 1);
  const std::string text = resampling_grammar(models, "t");
  const std::string at_once = with(text, "fade", "0.1");
  const auto spread = [](std::span<const Morphology> neurons) {
    std::vector<double> ratios;
    for (const Morphology& n : neurons)
      for (const double ratio : statistics::find_metric("taper_1")->values(Arbors(n)))
        ratios.push_back(ratio);
    return statistics::summarize(ratios).sd;
  };
  const auto grown = [](const std::string& grammar) {
    return lsystem::grow_population(lsystem::parse(grammar, "t"), 60, 1);
  };
  const double wanted = spread(models), by_and_by = spread(grown(text)), once = spread(grown(at_once));
  EXPECT_LT(by_and_by, 1.2 * wanted);
  EXPECT_GT(once, 1.25 * wanted);
}

// What never forks where it was traced has no fork to draw, however much the number of its tips is changed.
TEST(Resampling, AKindThatNeverForksKeepsToOneTip) {
  const std::vector<Morphology> models =
      each_with(6, 3, [](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
        const auto path = [&](Point from, float x, float y) {
          std::vector<Point> points{from};
          for (int k = 0; k < 6; ++k) {
            Point p = points.back();
            p.x += x + float(random.normal()), p.y += y + float(random.normal());
            points.push_back(p);
          }
          return points;
        };
        for (float side : {-1.f, 1.f}) {
          const auto stem = path({0, 5, 0, 1}, side, 5);
          const SectionId root = builder.add_section({}, SectionKind::basal, stem);
          for (float way : {-3.f, 3.f})
            builder.add_section(root, SectionKind::basal, path(stem.back(), way, 4));
        }
        for (std::uint64_t stub = 0; stub <= i % 3; ++stub)
          builder.add_section({}, SectionKind::axon, path({float(stub), -5, 0, .5f}, 1, -8));
      });
  const std::string text =
      with(resampling_grammar(models, "stubs", {.kinds = statistics::kind_set("all")}), "jitter", "3");
  EXPECT_NE(text.find("\ntable most_tips = 2: 1, 3: "), text.npos);
  for (const Morphology& n : lsystem::grow_population(lsystem::parse(text, "stubs"), 60, 1))
    for (const Section& s : n.sections()) EXPECT_TRUE(s.kind != SectionKind::axon || !s.parent.valid());
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

// Where stems leave, from the soma.
std::vector<Vec3> stems_of(std::span<const Morphology> neurons) {
  std::vector<Vec3> places;
  for (const Morphology& n : neurons)
    for (const SectionId root : n.roots())
      places.push_back(n.points(root).front().position() - n.soma().sphere().position());
  return places;
}

TEST(Resampling, SoManyNeuronsAsWereTracedHaveEachOnesStems) {
  const std::vector<Morphology> models = traced(12);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const std::vector<Vec3> theirs = stems_of(models),
                          grown = stems_of(lsystem::grow_population(grammar, 24, 5));
  ASSERT_EQ(grown.size(), 2 * theirs.size());
  for (std::size_t half : {std::size_t(0), theirs.size()}) {
    std::vector<Vec3> left(grown.begin() + std::ptrdiff_t(half),
                           grown.begin() + std::ptrdiff_t(half + theirs.size()));
    for (const Vec3& place : theirs) {
      const auto nearest =
          std::ranges::min_element(left, {}, [&](const Vec3& g) { return (g - place).norm(); });
      EXPECT_LT((*nearest - place).norm(), .03f);
      left.erase(nearest);
    }
  }
}

// How a branch is drawn: µm from point to point, and radians by which they leave its direction.
struct Drawn {
  double step, turn;
};

// Two small neurons and two large ones with basal and apical dendrites, of each pair one drawn in one way and one in the other. How
// high above the soma stems leave says whose they are.
std::vector<Morphology> in_pairs(Drawn even, Drawn odd) {
  const std::vector<Morphology> models =
      each_with(4, 9, [&](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
        const auto [step, turn] = i % 2 ? odd : even;
        const double size = i < 2 ? 1. : 2.;
        const auto path = [&, step = step, turn = turn](Point from, double angle) {
          std::vector<Point> points{from};
          for (double way = 0.; way < 40. * size; way += step) {
            Point p = points.back();
            const double turned = angle + turn * random.normal();
            p.x += float(step * std::cos(turned)), p.y += float(step * std::sin(turned));
            points.push_back(p);
          }
          return points;
        };
        for (int stem = 0; stem < 3; ++stem) {
          const SectionKind kind = stem ? SectionKind::basal : SectionKind::apical;
          const double angle = 1.57 + 2.1 * stem;
          const auto first = path(
              {float(5. * std::cos(angle)), float(5. * std::sin(angle)), float(i), float(.5 * size)}, angle);
          const SectionId root = builder.add_section({}, kind, first);
          for (const double side : {-.5, .5})
            builder.add_section(root, kind, path(first.back(), angle + side));
        }
      });
  return models;
}

std::vector<Morphology> of_two_tracers() { return in_pairs({8., .2}, {2., .2}); }

// Whose the stems of this kind are.
int whose(const Morphology& n, SectionKind kind) {
  for (const SectionId root : n.roots())
    if (n.section(root).kind == kind) return int(std::lround(n.points(root).front().z - n.soma().sphere().z));
  return -1;
}

TEST(Resampling, BasalDendritesAreThoseOfAnotherNeuronAndEachOnesComeOnce) {
  const std::vector<Morphology> models = of_two_tracers();
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  std::set<int> apical, basal;
  for (const Morphology& n : lsystem::grow_population(grammar, models.size(), 3)) {
    EXPECT_EQ(n.roots().size(), 3u);
    EXPECT_NE(whose(n, SectionKind::apical), whose(n, SectionKind::basal));
    apical.insert(whose(n, SectionKind::apical)), basal.insert(whose(n, SectionKind::basal));
  }
  EXPECT_EQ(apical, (std::set<int>{0, 1, 2, 3}));
  EXPECT_EQ(basal, apical);
}

// Four neurons alike but for where their basal stems leave: of two beside the apical one, of two opposite to it.
TEST(Resampling, BasalDendritesOfAnotherLeaveAsFarFromTheApicalOne) {
  std::vector<Morphology> models;
  for (std::uint64_t i = 0; i < 4; ++i) {
    MorphologyBuilder builder;
    builder.set_soma(zoo_parts::sphere(5));
    const auto add = [&](SectionKind kind, double angle) {
      const auto at = [&](double way, double turn) {
        return Point{float(way * std::sin(angle + turn)), float(way * std::cos(angle + turn)), float(i), .5f};
      };
      const double length = 30. + double((i * 7) % 4);  // of no two the same, and not by pairs
      const SectionId root = builder.add_section({}, kind, std::array{at(5., 0.), at(length, 0.)});
      for (const double side : {-.2, .3})
        builder.add_section(root, kind, std::array{at(length, 0.), at(70., side)});
    };
    add(SectionKind::apical, 0.);
    for (const double side : {-1., 1.}) add(SectionKind::basal, side * (i % 2 ? 2.8 : 1.3));
    models.push_back(builder.build());
  }
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  for (const Morphology& n : lsystem::grow_population(grammar, models.size(), 3)) {
    EXPECT_NE(whose(n, SectionKind::apical), whose(n, SectionKind::basal));
    EXPECT_EQ(whose(n, SectionKind::apical) % 2, whose(n, SectionKind::basal) % 2);
  }
}

// Those of the same size are mates, who were traced by another; the points of both kinds are set as in one.
TEST(Resampling, PointsAreAsFarApartInBasalAsInApicalDendrites) {
  const std::vector<Morphology> models = of_two_tracers();
  for (std::size_t i = 0; const Mixed& m : mix(learn(models, statistics::dendrites), Resampling().kin))
    EXPECT_NE(m.basal_as % 2, i++ % 2);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const auto step = [](const Morphology& n, SectionKind kind) {
    return statistics::mean(statistics::find_metric("segment_lengths")->values(Arbors(n, {kind})));
  };
  int apart = 0;
  for (const Morphology& n : lsystem::grow_population(grammar, 40, 3)) {
    const bool short_steps = whose(n, SectionKind::apical) % 2;
    const double wanted = short_steps ? 2. : 8., most = short_steps ? 1. : 3.;
    EXPECT_NEAR(step(n, SectionKind::apical), wanted, most);
    apart += std::abs(step(n, SectionKind::basal) - wanted) > most;
  }
  EXPECT_LE(apart, 2);  // of few neurons a branch of the other tracer is drawn at times
}

// Those of the same size are mates, one straight and one winding; all of a neuron winds as its apical dendrites, which are its own.
TEST(Resampling, BasalDendritesOfAnotherWindAsTheApicalOne) {
  const std::vector<Morphology> models = in_pairs({4., .25}, {4., .5});
  for (std::size_t i = 0; const Mixed& m : mix(learn(models, statistics::dendrites), Resampling().kin))
    EXPECT_NE(m.basal_as % 2, i++ % 2);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const auto winding = [](const Morphology& n, SectionKind kind) {
    return std::log(
        statistics::mean(statistics::find_metric("section_tortuosity")->values(Arbors(n, {kind}))));
  };
  for (const SectionKind kind : {SectionKind::apical, SectionKind::basal}) {
    std::array<std::vector<double>, 2> windings;
    for (const Morphology& n : lsystem::grow_population(grammar, 80, 3))
      windings[std::size_t(whose(n, SectionKind::apical) % 2)].push_back(winding(n, kind));
    EXPECT_GT(statistics::mean(windings[1]), 2. * statistics::mean(windings[0]));
  }
}

// A trunk with twigs and a tuft, which lean to one side, another in each; the longest branch of the tuft goes to any side.
std::vector<Morphology> tufted(std::size_t count) {
  const lsystem::Grammar grammar = lsystem::parse(R"(
steps: 40
module Trunk(n), Long(n)
cell side = if(chance(0.5), 1, -1)
cell far = uniform(4, 8)
cell lean = uniform(-25, 25)
axiom: Soma(uniform(10, 20)) Apical f(10) !(2) +(lean) Trunk(0)
up: Trunk(n) : n < 10 -> &(normal(0, 3)) +(normal(0, 8)) F(20) [ +(if(chance(0.5), 60, -60)) F(uniform(20, 40)) ] +(normal(0, 8)) Trunk(n + 1)
top: Trunk(n) -> [ +(50 * side) Long(0) ] -(uniform(15, 35) * side) F(20) [ -(30 * side) F(40) ] [ +(5) F(60) ] -(10 * side) F(20) [ +(15) F(30) ] -(20 * side) F(50)
out: Long(n) : n < far -> +(normal(0, 5)) F(15) Long(n + 1)
)",
                                                  "tufted");
  return lsystem::grow_population(grammar, count, 4);
}

// How far aside of the soma the tips are in the mean.
double aside(const Morphology& n) {
  double sum = 0., count = 0.;
  for (std::uint32_t i = 0; i < n.sections().size(); ++i)
    if (n.is_terminal(SectionId(i)))
      sum += double(n.points(SectionId(i)).back().x - n.soma().sphere().x), count += 1.;
  return sum / count;
}

TEST(Resampling, TheMiddleOfItsTipsComesToWhereItWasInTheNeuronWhoseStemsItHas) {
  const std::vector<Morphology> models = tufted(40);
  const std::string text = resampling_grammar(models, "t");
  const Traced learned = learn(models, statistics::dendrites);
  const std::vector<Mixed> mixed = mix(learned, Resampling().kin);
  // How far grown neurons miss: the root of the mean square.
  const auto missed = [&](const std::string& grammar) {
    double sum = 0.;
    for (const Morphology& grown : lsystem::grow_population(lsystem::parse(grammar, "t"), 200, 3)) {
      const auto same = std::ranges::min_element(models, {}, [&](const Morphology& m) {
        return std::abs(m.soma().sphere().radius - grown.soma().sphere().radius);
      });
      const Stem& stem = *mixed[std::size_t(same - models.begin())].poses[0];
      sum += std::pow(aside(grown) - aside(models[stem.cell]), 2);
    }
    return std::sqrt(sum / 200.);
  };
  const double astray = missed(with(text, "steer", "0"));
  EXPECT_LT(missed(text), .9 * astray);
  EXPECT_LT(missed(with(text, "heed", "1")), .7 * astray);
}

// A point so far from the soma in a direction around z, a little above or below.
Point away(double way, double angle, double radius, Random& random) {
  return {float(way * std::cos(angle)), float(way * std::sin(angle)), float(random.normal()), float(radius)};
}

// A stem through these points, and at its end a fork into two straight tips.
void add_fork(MorphologyBuilder& builder, const std::vector<Point>& stem, std::array<double, 2> sides,
              auto&& tip) {
  const SectionId root = builder.add_section({}, SectionKind::basal, stem);
  for (const double side : sides)
    builder.add_section(root, SectionKind::basal, std::array{stem.back(), tip(side)});
}

// Stems of one neuron are thick and thin, and some neurons are thicker all over.
TEST(Resampling, StemsOfOneNeuronDifferInThicknessAsTheyDid) {
  const std::vector<Morphology> models =
      each_with(10, 5, [](MorphologyBuilder& builder, Random& random, std::uint64_t) {
        const double thick = random.uniform(.5, 1.5);
        for (int stem = 0; stem < 4; ++stem) {
          const double angle = 1.5 * stem + .1 * random.normal();
          const auto at = [&](double way, double turn) {
            return away(way, angle + turn, thick * (stem % 2 ? 1.5 : .5), random);
          };
          const Point fork = at(40. + 5. * random.normal(), 0.);
          add_fork(builder, {at(5., 0.), at(20., .1), fork}, {-.3, .4},
                   [&](double side) { return at(90. + 5. * random.normal(), side); });
        }
      });
  const auto differ = [](std::span<const Morphology> neurons) {
    const statistics::Metric& radii = *statistics::find_metric("trunk_origin_radii");
    double sum = 0.;
    for (const Morphology& n : neurons) sum += statistics::summarize(radii.values(Arbors(n))).sd;
    return sum / double(neurons.size());
  };
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  EXPECT_NEAR(differ(lsystem::grow_population(grammar, 100, 1)), differ(models), .1 * differ(models));
}

// Dendrites of one neuron are about equally thick, those of another are not.
TEST(Resampling, DiametersOfANeuronDifferAsMuchAsWhereTheyWereLent) {
  const std::vector<Morphology> models =
      each_with(12, 7, [](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
        for (int stem = 0; stem < 4; ++stem) {
          const double thick = std::exp((.1 + .2 * double(i % 3)) * random.normal()),
                       angle = 1.5 * stem + .1 * random.normal();
          const auto at = [&](double way, double turn) {
            return away(way, angle + turn, thick * (1. - .005 * way) * std::exp(.02 * random.normal()),
                        random);
          };
          std::vector<Point> points;
          for (double way = 5.; way < 80.; way += 3.) points.push_back(at(way, 0.));
          add_fork(builder, points, {-.3, .4}, [&](double side) { return at(120., side); });
        }
      });
  // How much the diameters of each neuron differ, in their order.
  const auto spreads = [](std::span<const Morphology> neurons) {
    std::vector<double> of_each;
    for (const Morphology& n : neurons) {
      std::vector<double> sizes;
      for (const Point& p : n.points()) sizes.push_back(std::log(double(p.radius)));
      of_each.push_back(statistics::summarize(sizes).sd);
    }
    std::ranges::sort(of_each);
    return of_each;
  };
  const std::string text = resampling_grammar(models, "t");
  const std::vector<double> wanted = spreads(models);
  const auto astray = [&](const std::string& even) {
    const std::size_t each = 8;
    const std::vector<double> found = spreads(
        lsystem::grow_population(lsystem::parse(with(text, "even", even), "t"), each * wanted.size(), 1));
    double sum = 0.;
    for (std::size_t i = 0; i < found.size(); ++i) sum += std::abs(found[i] - wanted[i / each]);
    return sum / double(found.size());
  };
  EXPECT_LT(astray("1"), .5 * astray("0"));
}

// All stems of a neuron end at its fissure, which is nearer in one neuron than in another.
TEST(Resampling, StemsThatAllReachAsFarStayAsAlike) {
  const std::vector<Morphology> models =
      each_with(12, 6, [](MorphologyBuilder& builder, Random& random, std::uint64_t) {
        const double fissure = random.uniform(80., 140.);
        for (int stem = 0; stem < 4; ++stem) {
          const auto at = [&](double way, double turn) {
            return away(way, 1.5 * stem + turn + .05 * random.normal(), .5, random);
          };
          const Point fork = at(40. + 5. * random.normal(), 0.);
          add_fork(builder, {at(5., 0.), fork}, {-.2, .2},
                   [&](double side) { return at(fissure * (1. + .01 * random.normal()), side); });
        }
      });
  // How much its tips differ in how far from the soma they lie.
  const auto differ = [](std::span<const Morphology> neurons) {
    double sum = 0.;
    for (const Morphology& n : neurons) {
      std::vector<double> ways;
      for (std::uint32_t i = 0; i < n.sections().size(); ++i)
        if (n.is_terminal(SectionId(i)))
          ways.push_back(std::log(double(n.points(SectionId(i)).back().position().norm())));
      sum += statistics::summarize(ways).sd;
    }
    return sum / double(neurons.size());
  };
  const std::string text = resampling_grammar(models, "t");
  const auto of = [&](const std::string& grammar) {
    return differ(lsystem::grow_population(lsystem::parse(grammar, "t"), 100, 1));
  };
  EXPECT_LT(differ(models), .02);
  EXPECT_LT(of(text), .06);
  EXPECT_GT(of(with(text, "jolt", "0.1")), 1.3 * of(text));
}

// Thin neurons whose stems begin as thick as those of thick ones: a cone that is drawn by a thick neuron is no thicker than any was.
TEST(Resampling, NoStemIsThickerThanTheThickest) {
  const auto thickest = [](const Morphology& n) {
    float radius = 0;
    for (const Point& p : n.points()) radius = std::max(radius, p.radius);
    return radius;
  };
  const std::vector<Morphology> models =
      each_with(12, 6, [](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
        const double thick = i % 2 ? 2. : .3;
        for (int stem = 0; stem < 3; ++stem) {
          const double angle = 2. * stem + .1 * random.normal();
          const auto at = [&](double way, double turn, double radius) {
            return away(way, angle + turn, radius, random);
          };
          const Point fork = at(40. + 5. * random.normal(), 0., thick);
          add_fork(builder, {at(5., 0., 2.5), at(20., .1, thick), fork}, {-.3, .4},
                   [&](double side) { return at(90. + 5. * random.normal(), side, thick); });
        }
      });
  float most = 0;
  for (const Morphology& n : models) most = std::max(most, thickest(n));
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  for (const Morphology& n : lsystem::grow_population(grammar, 100, 1)) EXPECT_LE(thickest(n), 1.01f * most);
}

// Two arbors that fork in their first point, where they leave the soma, and one that does not.
TEST(Resampling, WhatForksWhereItLeavesTheSomaStaysOneArbor) {
  const std::vector<Morphology> models =
      each_with(6, 3, [](MorphologyBuilder& builder, Random& random, std::uint64_t) {
        for (int stem = 0; stem < 3; ++stem) {
          const double angle = 2. * stem + .1 * random.normal();
          const auto at = [&](double way, double turn) { return away(way, angle + turn, .5, random); };
          std::vector<Point> root{at(5., 0.)};
          if (!stem) root.push_back(at(25., 0.));
          add_fork(builder, root, {-.3, .4},
                   [&](double side) { return at(60. + 5. * random.normal(), side); });
        }
      });
  const lsystem::Grammar grammar =
      lsystem::parse(resampling_grammar(models, "t", Resampling{.jitter = 0.}), "t");
  for (const Morphology& m : lsystem::grow_population(grammar, 12, 1)) {
    ASSERT_EQ(m.roots().size(), 3u);
    std::size_t single = 0;
    for (const SectionId root : m.roots()) single += m.points(root).size() == 1;
    EXPECT_EQ(single, 2u);
    EXPECT_EQ(m.sections().size(), 9u);
  }
}

// Of neurons some bear many spines, some few and some none; without any, nothing is said of them.
TEST(Resampling, BearsAsManySpinesAsWereTraced) {
  const auto spiny = [](double times) {
    return each_with(9, 3, [times](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
      for (int stem = 0; stem < 3; ++stem) {
        const double angle = 2. * stem + .1 * random.normal();
        add_fork(builder, {away(5., angle, .5, random), away(60., angle, .5, random)}, {-.3, .4},
                 [&](double side) { return away(150. + 5. * random.normal(), angle + side, .5, random); });
      }
      for (std::uint32_t section = 0; section < 9; ++section)
        for (float at = 1.f; at < 50.f; at += 2.f)
          if (random.uniform() < times * double(i % 3))
            builder.add_spine({.section = SectionId(section),
                               .position = at,
                               .head = Vec3(0.f, 0.f, float(1. + .2 * random.normal())),
                               .head_diameter = .5f,
                               .neck_diameter = .2f});
    });
  };
  const auto bears = [](std::span<const Morphology> neurons) {
    std::vector<double> densities, reach;
    for (const Morphology& m : neurons) {
      densities.push_back(double(m.spines().size()) / total_length(m));
      for (const Spine& spine : m.spines()) reach.push_back(double(spine.head.norm()));
    }
    return std::pair(statistics::summarize(densities), statistics::summarize(reach));
  };
  const std::vector<Morphology> models = spiny(.4);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const auto [traced, traced_reach] = bears(models);
  const auto [grown, grown_reach] = bears(lsystem::grow_population(grammar, 36, 1));
  EXPECT_NEAR(grown.mean, traced.mean, .15 * traced.mean);
  EXPECT_NEAR(grown.sd, traced.sd, .25 * traced.sd) << "neurons differ as they did";
  EXPECT_NEAR(grown_reach.mean, traced_reach.mean, .03 * traced_reach.mean);
  EXPECT_EQ(resampling_grammar(spiny(0.), "t").find("Spiny"), std::string::npos);
}

// How many times as high as wide somata are.
std::vector<double> shapes_of(std::span<const Morphology> neurons) {
  std::vector<double> all;
  for (const Morphology& m : neurons) {
    Bounds bounds;
    for (const Point& p : m.soma().points) bounds.add(p.position(), 0.f);
    const Vec3 size = bounds.high - bounds.low;
    all.push_back(double(size.y() / size.x()));
  }
  return all;
}

TEST(Resampling, SomataAreAsLongAsWereTraced) {
  const auto neurons = [](double longer) {
    return each_with(12, 3, [longer](MorphologyBuilder& builder, Random& random, std::uint64_t i) {
      Soma soma{.kind = SomaKind::contours, .points = {}, .parents = {}, .contour_starts = {0}};
      const double a = 5. * (1. + longer * (1. + .1 * double(i % 5)));  // upright ellipses
      for (int k = 0; k < 36; ++k)
        soma.points.push_back({float(5. * std::cos(k * std::numbers::pi / 18.)),
                               float(a * std::sin(k * std::numbers::pi / 18.)), 0.f, .1f});
      builder.set_soma(soma);
      for (int stem = 0; stem < 3; ++stem) {
        const double angle = 2. * stem + .1 * random.normal();
        add_fork(builder, {away(5., angle, .5, random), away(60., angle, .5, random)}, {-.3, .4},
                 [&](double side) { return away(150. + 5. * random.normal(), angle + side, .5, random); });
      }
    });
  };
  const std::vector<Morphology> models = neurons(.4);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t"), "t");
  const std::vector<Morphology> grown = lsystem::grow_population(grammar, 36, 1);
  for (const Morphology& m : grown) ASSERT_EQ(m.soma().kind, SomaKind::contours);
  const auto traced = statistics::summarize(shapes_of(models)),
             found = statistics::summarize(shapes_of(grown));
  EXPECT_NEAR(found.mean, traced.mean, .05 * traced.mean);
  EXPECT_NEAR(found.sd, traced.sd, .3 * traced.sd) << "neurons differ as they did";
  std::vector<double> sizes, grown_sizes;
  for (const Morphology& m : models) sizes.push_back(double(m.soma().sphere().radius));
  for (const Morphology& m : grown) grown_sizes.push_back(double(m.soma().sphere().radius));
  EXPECT_NEAR(statistics::mean(grown_sizes), statistics::mean(sizes), .01 * statistics::mean(sizes));
  const std::string round = resampling_grammar(
      each_with(12, 3,
                [](MorphologyBuilder& builder, Random& random, std::uint64_t) {
                  add_fork(builder, {away(5., 0., .5, random), away(60., 0., .5, random)}, {-.3, .4},
                           [&](double side) { return away(150., side, .5, random); });
                }),
      "t");
  EXPECT_EQ(round.find("a2"), std::string::npos) << "of balls nothing is said";
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

// The same neurons, as a tracer leaves them who looks at no diameters.
std::vector<Morphology> without_diameters(std::span<const Morphology> neurons) {
  std::vector<Morphology> bare;
  for (const Morphology& m : neurons) {
    MorphologyBuilder builder;
    builder.set_soma(m.soma());
    for (std::uint32_t i = 0; i < m.sections().size(); ++i) {
      std::vector<Point> points(m.points(SectionId(i)).begin(), m.points(SectionId(i)).end());
      for (Point& p : points) p.radius = 0.f;
      const Section& s = m.section(SectionId(i));
      builder.add_section(s.parent, s.kind, points, s.tag, s.soma_point);
    }
    bare.push_back(builder.build());
  }
  return bare;
}

TEST(Resampling, NeuronsWithoutDiametersGrowAsLongAsTheyWereTraced) {
  const std::vector<Morphology> models = without_diameters(traced(30));
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "bare"), "bare");
  const std::vector<Morphology> grown = lsystem::grow_population(grammar, 60, 3);
  for (const char* metric : {"total_length", "number_of_leaves", "max_path_distance"})
    EXPECT_NEAR(mean_of(grown, metric), mean_of(models, metric), .2 * mean_of(models, metric)) << metric;
  std::size_t points = 0, wide = 0;  // a neuron has none, but where it begins
  for (const Morphology& m : grown)
    for (std::uint32_t i = 0; i < m.sections().size(); ++i) {
      points += m.points(SectionId(i)).size();
      wide += std::size_t(
          std::ranges::count_if(m.points(SectionId(i)), [](const Point& p) { return p.radius > 0.f; }));
    }
  EXPECT_LT(wide * 100, points);
}

// Axons that were hardly traced beside whole ones.
TEST(Resampling, NothingGrowsManyTimesAsLargeAsWhatWasTraced) {
  const std::vector<Morphology> models = lsystem::grow_population(lsystem::parse(R"(
steps: 200
module Tip(left, n)
cell large = floor(uniform(0, 1)^3 * 7)
axiom: Soma(14) Axon [ f(7) !(1) F(8) Tip(large, 0) ]
fork: Tip(left, n) : n > 2 & left > 0 -> [ +(30) Tip(left - 1, 0) ] -(30) Tip(left - 1, 0)
grow: Tip(left, n) : n < 6 -> +(uniform(-12, 12)) F(8) Tip(left, n + 1)
)",
                                                                                 "axons"),
                                                                  24, 5);
  Resampling axons;
  axons.kinds = {SectionKind::axon};
  const std::vector<Morphology> grown =
      lsystem::grow_population(lsystem::parse(resampling_grammar(models, "axons", axons), "fitted"), 200, 3);
  const auto most = [](std::span<const Morphology> neurons) {
    double tips = 0.;
    for (const Morphology& n : neurons)
      tips = std::max(tips, statistics::find_metric("number_of_leaves")->values(Arbors(n))[0]);
    return tips;
  };
  EXPECT_LE(most(grown), 1.5 * most(models));
  EXPECT_GT(most(grown), .5 * most(models));
  EXPECT_NEAR(mean_of(grown, "number_of_leaves"), mean_of(models, "number_of_leaves"),
              .5 * mean_of(models, "number_of_leaves"));
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
