// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/synapses.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

#include "tests/sample_forest.h"

namespace forest::circuit {
namespace {

// A stem of 100 µm that forks into two dendrites of 100 µm, beside an axon of 1,000 µm.
Morphology fork(bool spine = false) {
  MorphologyBuilder b;
  b.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 5}}, .parents = {}, .contour_starts = {}});
  const Point start{0, 0, 0, 1}, middle{0, 100, 0, 1}, left{-100, 100, 0, 1}, right{100, 100, 0, 1},
      far{0, -1000, 0, 1};
  const SectionId stem = b.add_section({}, SectionKind::basal, std::array{start, middle});
  b.add_section({}, SectionKind::axon, std::array{start, far});
  const SectionId last = b.add_section(stem, SectionKind::basal, std::array{middle, left});
  b.add_section(stem, SectionKind::apical, std::array{middle, right});
  if (spine)
    b.add_spine(
        {.section = last, .position = 25.f, .head = {0, 2, 0}, .head_diameter = .5f, .neck_diameter = .1f});
  return b.build();
}

Circuit two_kinds(std::size_t count) {
  Circuit c;
  c.layers = {{"all", -10.f, 10.f}};
  c.types = {{"e", "p", true}, {"i", "q", false}};
  c.morphologies = {"fork"};
  for (std::size_t i = 0; i < count; ++i)
    c.instances.push_back(
        {.position = {float(i), 0, 0}, .orientation = Quat(0, 0, 1, 0), .type = std::uint32_t(i % 2)});
  return c;
}

TEST(MadeUpSynapses, EveryNeuronHasAsManyOnItsDendritesAndNoneOfItsOwn) {
  const Circuit c = two_kinds(10);
  const std::array shapes{fork()};
  const Projection made = made_up_synapses(c, shapes, "p", 200, 1);
  EXPECT_NE(made.name.find(made_up_word), made.name.npos);
  std::map<std::uint32_t, int> on, from;
  std::map<std::int32_t, int> element;
  double inhibitory = 0., excitatory = 0.;
  int inhibitory_count = 0, excitatory_count = 0;
  for (const Synapse& s : made.synapses) {
    ++on[s.target], ++from[s.neuron], ++element[s.element];
    EXPECT_NE(s.target, s.neuron);
    EXPECT_EQ(s.source, s.neuron);
    EXPECT_EQ(s.sign, s.neuron % 2 ? Sign::inhibitory : Sign::excitatory);
    EXPECT_TRUE(s.position >= 0.f && s.position <= 1.f);
    const double path = (s.element == 2 ? 0. : 100.) + 100. * double(s.position);
    (s.neuron % 2 ? inhibitory : excitatory) += path;
    ++(s.neuron % 2 ? inhibitory_count : excitatory_count);
  }
  ASSERT_EQ(on.size(), 10u);
  for (const auto& [target, count] : on) EXPECT_EQ(count, 200);
  EXPECT_EQ(from.size(), 10u);
  EXPECT_EQ(element.count(1), 0u) << "on the axon, which is section 1";
  EXPECT_EQ(element.size(), 3u);
  // The mean path of a place on the dendrites is (50 + 2 · 150) / 3, of the nearest of three it is less.
  EXPECT_NEAR(excitatory / excitatory_count, 116.7, 6.);
  EXPECT_LT(inhibitory / inhibitory_count, 80.);
}

TEST(MadeUpSynapses, AreTheSameAtAnyNumberOfThreadsAndOthersForAnotherSeed) {
  const Circuit c = testing::sample_circuit();
  const std::vector<Morphology> shapes = testing::sample_neurons();
  const auto key = [&](std::uint64_t seed) {
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::int32_t, float>> list;
    for (const Synapse& s : made_up_synapses(c, shapes, "p", 20, seed).synapses)
      list.emplace_back(s.target, s.neuron, s.element, s.position);
    return list;
  };
  const auto many = key(4);
  const ThreadLimit one(1);
  EXPECT_EQ(many, key(4));
  EXPECT_NE(many, key(5));
}

TEST(MadeUpSynapses, ExcitatoryOnesSitOnSpines) {
  const Circuit c = two_kinds(2);
  const std::array shapes{fork(true)};
  int seen = 0;
  for (const Synapse& s : made_up_synapses(c, shapes, "p", 10, 1).synapses) {
    if (s.sign != Sign::excitatory) continue;
    ++seen;
    EXPECT_EQ(s.target, 1u);
    EXPECT_EQ(s.element, 3);
    EXPECT_FLOAT_EQ(s.position, .25f);
    EXPECT_TRUE(s.surface.isApprox(Vec3(1 + 25, 102, 0), 1e-4f))
        << s.surface.transpose();  // turned about y by 180°
  }
  EXPECT_EQ(seen, 10);
}

TEST(MadeUpSynapses, NeedADendriteAndAnother) {
  MorphologyBuilder b;
  const std::array axon{Point{0, 0, 0, 1}, Point{0, 9, 0, 1}};
  b.add_section({}, SectionKind::axon, axon);
  const std::array shapes{b.build()};
  EXPECT_TRUE(made_up_synapses(two_kinds(4), shapes, "p", 10, 1).synapses.empty());
  const std::array forks{fork()};
  EXPECT_TRUE(made_up_synapses(two_kinds(1), forks, "p", 10, 1).synapses.empty());
  EXPECT_TRUE(made_up_synapses(two_kinds(4), forks, "p", 0, 1).synapses.empty());
  EXPECT_THROW(made_up_synapses(two_kinds(4), forks, "p", 0xffffffffu, 1), LimitError);
  EXPECT_THROW(made_up_synapses(two_kinds(4), {}, "p", 1, 1), Error);
}

}  // namespace
}  // namespace forest::circuit
