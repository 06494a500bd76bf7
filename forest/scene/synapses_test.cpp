// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/synapses.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/scene/pick.h"
#include "forest/scene/view.h"

#include "tests/checksums.h"
#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

using ::testing::HasSubstr;

constexpr frame::Viewport viewport{640.f, 480.f};

struct Sample {
  circuit::Circuit circuit = forest::testing::sample_circuit();
  std::vector<Morphology> neurons = forest::testing::sample_neurons();
  Forest forest = Forest::from_bytes(pack(circuit, neurons));
  std::vector<circuit::Projection> projections{circuit::made_up_synapses(circuit, neurons, "p", 100, 3)};
  std::vector<std::byte> bytes = Synapses::make(forest, projections);
  Synapses synapses = Synapses::from_bytes(bytes, forest);
  Colouring colouring = colour(forest, ColourBy::type, Background::dark);

  Eye eye(const Vec3& from, const Vec3& to, Detail detail = {}) const {
    return Eye({.eye = from, .target = to}, viewport, detail);
  }
  Eye near() const { return eye({0, 300, 400}, {0, 300, 0}); }
};

std::string complaint(const auto& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Synapses, LieOnTheSurfaceOfTheBranchThatTheyAreSaidToBeOn) {
  const Sample s;
  ASSERT_EQ(s.synapses.all().size(), 4000u);
  for (const Synapse& synapse : s.synapses.all()) {
    const circuit::Synapse& said = s.projections[0].synapses[synapse.id];
    EXPECT_EQ(synapse.target, said.target);
    EXPECT_EQ(synapse.source, said.neuron);
    EXPECT_EQ(synapse.sign(), said.sign);
    EXPECT_NEAR(double(synapse.position) / 65535., double(said.position), 1e-4);
    // The sample's sections are basal and apical: basal ones come first.
    const Morphology& m = s.neurons[s.circuit.instances[said.target].morphology];
    std::vector<std::uint32_t> order;
    for (const SectionKind kind : {SectionKind::basal, SectionKind::apical})
      for (std::uint32_t i = 0; i < m.sections().size(); ++i)
        if (m.sections()[i].kind == kind) order.push_back(i);
    EXPECT_EQ(s.synapses.section(synapse), order[std::size_t(said.element) - 1]);
    const Neuron& neuron = s.forest.neurons()[s.forest.instances()[synapse.target].morphology];
    const RoundCone cone = in_world(s.forest, synapse.target, neuron.first_segment + synapse.segment);
    const Vec3 way = cone.b - cone.a;
    const float t = std::clamp((synapse.centre() - cone.a).dot(way) / way.squaredNorm(), 0.f, 1.f);
    const float away = (synapse.centre() - cone.a - t * way).norm();
    EXPECT_NEAR(away, cone.radius_a + t * (cone.radius_b - cone.radius_a), .01f);
  }
}

TEST(Synapses, WithoutASectionAreOnTheSegmentNearestToTheirPlace) {
  const Sample s;
  std::vector<circuit::Projection> told{{"edges", "x", "p", {}}};
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t target = random.below(40);
    const Neuron& neuron = s.forest.neurons()[s.forest.instances()[target].morphology];
    const std::uint32_t segment = 1 + random.below(neuron.original_count - 1);
    const RoundCone cone = in_world(s.forest, target, neuron.first_segment + segment);
    circuit::Synapse one{.target = target, .source = 77};
    one.centre = .5f * (cone.a + cone.b);
    told[0].synapses.push_back(one);
  }
  const Synapses made = Synapses::from_bytes(Synapses::make(s.forest, told), s.forest);
  for (const Synapse& synapse : made.all()) {
    const circuit::Synapse& said = told[0].synapses[synapse.id];
    EXPECT_EQ(synapse.centre(), said.centre);
    const Neuron& neuron = s.forest.neurons()[s.forest.instances()[synapse.target].morphology];
    const RoundCone cone = in_world(s.forest, synapse.target, neuron.first_segment + synapse.segment);
    const Vec3 way = cone.b - cone.a;
    const float t = way.squaredNorm() > 0.f
                        ? std::clamp((said.centre - cone.a).dot(way) / way.squaredNorm(), 0.f, 1.f)
                        : 0.f;
    EXPECT_LE((said.centre - cone.a - t * way).norm(),
              cone.radius_a + t * (cone.radius_b - cone.radius_a) + .01f);
    EXPECT_TRUE(synapse.flags & Synapse::outside);
    EXPECT_EQ(synapse.source, 77u);
    EXPECT_EQ(made.projection(synapse).source, "x");
  }
}

TEST(Synapses, WeightKeepsTheAreaOnTheMeanAndNeverJumps) {
  for (const double f : {.001, .03, .3, .9, 1., 1.1, 1.5, 1.9, 2., 7.}) {
    double sum = 0.;
    constexpr int steps = 200000;
    for (int i = 0; i < steps; ++i) sum += double(synapse_weight((i + .5) / steps, f));
    EXPECT_NEAR(sum / steps, 1., .01) << f;
  }
  for (double f = .01; f < 3.; f *= 1.001)
    for (const double rank : {.005, .2, .7, .999})
      EXPECT_NEAR(double(synapse_weight(rank, f)), double(synapse_weight(rank, 1.001 * f)),
                  .005 * std::max(1., 1. / f))
          << rank << ' ' << f;
  EXPECT_EQ(synapse_weight(.5, .5), 0.f);
  EXPECT_EQ(synapse_weight(.999, 2.), 1.f);
}

TEST(Synapses, ChosenAreThoseThatEachOneByItselfIs) {
  const Sample s;
  for (const float away : {20.f, 150.f, 900.f, 5000.f, 60000.f}) {
    const Eye eye = s.eye({0, 300, 200 + away}, {0, 300, 0});
    const Synapses::Choice choice = s.synapses.choose(eye, s.colouring, SynapseColour::sign);
    std::vector<std::uint32_t> expected;
    double area = 0., all = 0.;
    for (std::uint32_t i = 0; i < s.synapses.all().size(); ++i) {
      const Synapse& one = s.synapses.all()[i];
      if (!eye.frustum().may_see({one.centre(), one.radius_um()})) continue;
      const double pixels = double(one.radius_um() * eye.magnification({one.centre(), 0.f}) / .75f);
      const float weight = synapse_weight(one.rank(), 2. * pixels * pixels);
      all += double(one.radius_um() * one.radius_um());
      area += double(one.radius_um() * one.radius_um() * weight);
      if (weight > 0.f) expected.push_back(i);
    }
    std::vector<std::uint32_t> got = choice.synapses;
    std::ranges::sort(got);
    EXPECT_EQ(got, expected) << away;
    double drawn = 0.;
    for (const frame::Ball& ball : choice.balls) drawn += double(ball.radius * ball.radius);
    EXPECT_NEAR(drawn / area, 1., .001) << away;
    if (expected.size() > 300) {
      EXPECT_NEAR(drawn / all, 1., .25) << away;
    }
    if (away > 1e4f) {
      EXPECT_LT(got.size(), 100u) << "far ones stand for others";
    }
  }
}

TEST(Synapses, CostIsBoundedAndTheAreaKept) {
  const Sample s;
  const Eye eye = s.eye({0, 300, 600}, {0, 300, 0});
  const auto all = s.synapses.choose(eye, s.colouring, SynapseColour::sign);
  const auto some = s.synapses.choose(eye, s.colouring, SynapseColour::sign, 600);
  EXPECT_GT(all.balls.size(), 1000u);
  EXPECT_LT(some.balls.size(), 900u);
  EXPECT_GT(some.balls.size(), 200u);
  double a = 0., b = 0.;
  for (const frame::Ball& ball : all.balls) a += double(ball.radius * ball.radius);
  for (const frame::Ball& ball : some.balls) b += double(ball.radius * ball.radius);
  EXPECT_NEAR(b / a, 1., .3);
  EXPECT_TRUE(s.synapses.choose(eye, s.colouring, SynapseColour::none).balls.empty());
}

TEST(Synapses, ShowAsTheirNeuronDoes) {
  Sample s;
  const Eye eye = s.near();
  const auto count = [&](std::uint32_t neuron) {
    const auto choice = s.synapses.choose(eye, s.colouring, SynapseColour::target);
    return std::ranges::count_if(choice.synapses,
                                 [&](std::uint32_t i) { return s.synapses.all()[i].target == neuron; });
  };
  std::uint32_t seen = 0;
  while (seen < 39 && count(seen) < 20) ++seen;
  ASSERT_GE(count(seen), 20);
  frame::State& state = s.colouring.states[seen];
  const frame::State shown = state;
  state.flags &= std::uint8_t(~frame::State::visible);
  EXPECT_EQ(count(seen), 0);
  state = shown, state.kind = frame::Kind::somata;
  EXPECT_EQ(count(seen), 0);
  state = shown, state.opacity = 51;
  const auto choice = s.synapses.choose(eye, s.colouring, SynapseColour::target);
  for (std::size_t i = 0; i < choice.balls.size(); ++i) {
    const Synapse& one = s.synapses.all()[choice.synapses[i]];
    EXPECT_EQ(choice.balls[i].opacity, one.target == seen ? 51 : 255);
    EXPECT_EQ(choice.balls[i].colour / 8, s.colouring.states[one.target].colour_class);
  }
  // A branch of it alone.
  state = shown;
  const std::uint32_t section = s.synapses.section(s.synapses.all()[choice.synapses[std::size_t(
      std::ranges::find_if(choice.synapses,
                           [&](std::uint32_t i) { return s.synapses.all()[i].target == seen; }) -
      choice.synapses.begin())]]);
  frame::State hidden = shown;
  hidden.flags &= std::uint8_t(~frame::State::visible);
  const auto before = count(seen);
  state.flags |= frame::State::parted;
  s.colouring.parts.push_back({seen, section, hidden});
  EXPECT_LT(count(seen), before);
}

TEST(Synapses, SitOnlyOnBranchesThatAPictureOfOneSampleDraws) {
  Sample s;
  for (frame::State& state : s.colouring.states) state.kind = frame::Kind::lines;  // and not straws
  for (const Vec3& from : {Vec3(0, 300, 2500), Vec3(0, 300, 700)}) {
    Detail fine, coarse;
    fine.error = coarse.error = .001f, coarse.thinnest = 4.f;
    const Eye eye = s.eye(from, {0, 300, 0}, coarse);
    std::set<std::pair<std::uint32_t, std::uint32_t>> drawn;
    const Cut cut = choose(s.forest, eye, s.colouring.shown());
    for (const frame::Item& item : cut.lines)
      for (std::uint32_t i = 0; i < frame::cluster_size; ++i)
        if (item.drawn >> i & 1u) drawn.insert({item.instance, item.first_segment + i});
    std::vector<std::uint32_t> expected;
    const auto all = s.synapses.choose(s.eye(from, {0, 300, 0}, fine), s.colouring, SynapseColour::sign);
    for (const std::uint32_t i : all.synapses) {
      const Synapse& one = s.synapses.all()[i];
      const Neuron& neuron = s.forest.neurons()[s.forest.instances()[one.target].morphology];
      if (drawn.contains({one.target, neuron.first_segment + one.segment})) expected.push_back(i);
    }
    EXPECT_EQ(s.synapses.choose(eye, s.colouring, SynapseColour::sign).synapses, expected);
    EXPECT_GT(expected.size(), 20u);
    EXPECT_LT(expected.size(), all.synapses.size());
  }
}

TEST(Synapses, AreTheSameAtAnyNumberOfThreads) {
  const Sample s;
  const auto many = s.synapses.choose(s.near(), s.colouring, SynapseColour::sign).synapses;
  const ThreadLimit one(1);
  EXPECT_EQ(Synapses::make(s.forest, s.projections), s.bytes);
  EXPECT_EQ(s.synapses.choose(s.near(), s.colouring, SynapseColour::sign).synapses, many);
}

TEST(Synapses, PickedIsTheNearestUnderThePlace) {
  const Sample s;
  const frame::Camera camera{.eye = {0, 300, 400}, .target = {0, 300, 0}};
  const auto choice = s.synapses.choose(Eye(camera, viewport, {}), s.colouring, SynapseColour::sign);
  ASSERT_GT(choice.balls.size(), 100u);
  for (std::size_t i = 0; i < choice.balls.size(); i += 7) {
    const Vec3 at = frame::project(camera, viewport, choice.balls[i].centre);
    const auto found = pick(choice, camera, viewport, at.head<2>(), .5f);
    ASSERT_TRUE(found);
    const Vec3 ray = (choice.balls[i].centre - camera.eye);
    EXPECT_LE(found->distance, double(ray.norm()));
    if (found->synapse == choice.synapses[i]) {
      EXPECT_NEAR(found->distance, double(ray.norm()), 3.);
    }
  }
  EXPECT_FALSE(pick(choice, camera, viewport, {-4000, -4000}));
  EXPECT_FALSE(pick({}, camera, viewport, {320, 240}));
}

TEST(Synapses, NothingIsAFileToo) {
  const Sample s;
  const Synapses none = Synapses::from_bytes(Synapses::make(s.forest, {}), s.forest);
  EXPECT_TRUE(none.all().empty());
  EXPECT_TRUE(none.choose(s.near(), s.colouring, SynapseColour::sign).balls.empty());
  std::vector<circuit::Projection> few{
      {"few", "a", "b", {s.projections[0].synapses.begin(), s.projections[0].synapses.begin() + 3}}};
  EXPECT_EQ(Synapses::from_bytes(Synapses::make(s.forest, few), s.forest).bundles().size(), 1u);
}

TEST(Synapses, WhatIsWrongIsSaid) {
  const Sample s;
  const auto with = [&](auto change) {
    std::vector<circuit::Projection> one{{"edges", "a", "b", {s.projections[0].synapses[0]}}};
    change(one[0].synapses[0]);
    return complaint([&] { Synapses::make(s.forest, one); });
  };
  EXPECT_THAT(with([](circuit::Synapse& x) { x.target = 40; }), HasSubstr("not in the forest"));
  EXPECT_THAT(with([](circuit::Synapse& x) { x.neuron = 4000; }), HasSubstr("not in the forest"));
  EXPECT_THAT(with([](circuit::Synapse& x) { x.element = 9000; }), HasSubstr("section 9000"));
  EXPECT_THAT(with([](circuit::Synapse& x) { x.element = -7; }), HasSubstr("section -7"));
  EXPECT_THAT(with([](circuit::Synapse& x) { x.position = NAN; }), HasSubstr("at nan"));
  EXPECT_THAT(with([](circuit::Synapse& x) { x.element = -1; }), HasSubstr("neither section nor place"));

  const Forest other = Forest::from_bytes(pack(forest::testing::sample_circuit(40, 6), s.neurons));
  EXPECT_THAT(complaint([&] { Synapses::from_bytes(s.bytes, other); }), HasSubstr("another forest"));
  for (std::size_t size : {std::size_t(0), std::size_t(7), std::size_t(100), s.bytes.size() - 1})
    EXPECT_NE(complaint([&] {
                Synapses::from_bytes({s.bytes.begin(), s.bytes.begin() + long(size)}, s.forest);
              }),
              "accepted")
        << size;
  for (std::size_t at = 0; at < s.bytes.size(); at += at < 256 ? 1 : 997) {
    std::vector<std::byte> damaged = s.bytes;
    damaged[at] ^= std::byte{1};
    const std::string said = complaint([&] { Synapses::from_bytes(damaged, s.forest); });
    // Gaps between the parts are not looked at.
    if (said == "accepted") {
      EXPECT_EQ(s.bytes[at], std::byte{0}) << at;
    }
  }
}

TEST(Synapses, ChangedBehindRightChecksumsAreRefusedOrCanBeSeen) {
  const Sample s;
  std::vector<circuit::Projection> few{
      {"few", "a", "b", {s.projections[0].synapses.begin(), s.projections[0].synapses.begin() + 150}}};
  const std::vector<std::byte> bytes = Synapses::make(s.forest, few);
  auto same = bytes;
  testing::put_synapses_right(same);
  EXPECT_EQ(same, bytes);
  std::size_t refused = 0, seen = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto changed = bytes;
    changed[i] ^= std::byte{0xff};
    testing::put_synapses_right(changed);
    try {
      const Synapses synapses = Synapses::from_bytes(std::move(changed), s.forest);
      for (const std::size_t most : {10u, 1000u}) {
        const auto choice = synapses.choose(s.near(), s.colouring, SynapseColour::sign, most);
        for (const std::uint32_t k : choice.synapses)
          (void)synapses.projection(synapses.all()[k]), (void)synapses.section(synapses.all()[k]);
      }
      ++seen;
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(seen, 100u);
}

}  // namespace
}  // namespace forest::scene
