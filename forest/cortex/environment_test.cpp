// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/environment.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::cortex {
namespace {

using Place = Environment::Place;

const std::vector<Slab> slabs{{"L1", 900.f, 1000.f}, {"L2/3", 600.f, 900.f}, {"deep", 0.f, 600.f}};

TEST(Environment, TellsDepthLayerAndBorders) {
  const Environment e(slabs);
  EXPECT_EQ(e.pia(), 1000.);
  EXPECT_EQ(e.depth({5, 700, 1}), 300.);
  EXPECT_EQ(e.depth({0, 1010, 0}), -10.);
  const auto stratum = e.stratum({0, 700, 0});
  EXPECT_EQ(stratum.layer, 2);
  EXPECT_EQ(stratum.above, 200.);
  EXPECT_EQ(stratum.below, 100.);
  EXPECT_EQ(e.stratum({0, 900, 0}).layer, 1);
  EXPECT_EQ(e.stratum({0, 10, 0}).layer, 3);  // by its rank: its name has no number
  EXPECT_EQ(e.stratum({0, 1001, 0}).layer, 0);
  EXPECT_EQ(e.stratum({0, -1, 0}).layer, 0);
}

TEST(Environment, NothingIsFarAway) {
  const Environment none;
  EXPECT_FALSE(none.pia());
  EXPECT_EQ(none.depth({1, 2, 3}), Environment::far_away);
  EXPECT_EQ(none.stratum({1, 2, 3}).layer, 0);
  EXPECT_EQ(none.nearest_soma({1, 2, 3}, {0, 0, 0}).distance, Environment::far_away);
  EXPECT_EQ(none.field({1, 2, 3}).density, 0.);
  EXPECT_EQ(none.field({1, 2, 3}).direction, Place::Zero());
  none.for_somata({0, 0, 0}, 1e9, [](const Sphere&) { FAIL(); });
}

std::vector<Sphere> random_somata(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  // At times in a plane, on a line or all in one place.
  const Vec3 spread(400.f, random.below(3) ? 300.f : 0.f, random.below(3) ? 200.f : 0.f);
  std::vector<Sphere> somata;
  for (std::size_t i = 0; i < count; ++i)
    somata.push_back(
        {spread.cwiseProduct(Vec3(float(random.uniform()), float(random.uniform()), float(random.uniform()))),
         float(random.uniform(0., 12.))});
  return somata;
}

RC_GTEST_PROP(Environment, FindsTheNearestSomaAsLookingAtAllOfThemDoes, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const auto somata = random_somata(seed, *rc::gen::inRange<std::size_t>(1, 300));
  const Environment e({}, somata);
  Random random(seed, 1);
  for (int k = 0; k < 30; ++k) {
    const Place place(random.uniform(-300, 700), random.uniform(-300, 700), random.uniform(-300, 700));
    const Place own = somata[random.below(std::uint32_t(somata.size()))].centre.cast<double>();
    double nearest = Environment::far_away;
    for (const Sphere& s : somata)
      if ((s.centre.cast<double>() - own).norm() > double(s.radius))
        nearest = std::min(nearest, (s.centre.cast<double>() - place).norm() - double(s.radius));
    const auto found = e.nearest_soma(place, own);
    RC_ASSERT(std::abs(found.distance - nearest) < 1e-9);
    if (found.soma) {
      RC_ASSERT((place + found.direction * (found.distance + double(somata[*found.soma].radius)) -
                 somata[*found.soma].centre.cast<double>())
                    .norm() < 1e-6);
    }
    const double reach = random.uniform(0., 200.);
    std::size_t near = 0, seen = 0;
    const auto within = [&](const Sphere& s) {
      return (s.centre.cast<double>() - place).norm() - double(s.radius) <= reach;
    };
    for (const Sphere& s : somata) near += within(s);
    e.for_somata(place, reach, [&](const Sphere& s) { seen += within(s); });
    RC_ASSERT(seen == near);
  }
}

TEST(Environment, FieldIsTheSumAndItsDirectionTheSteepest) {
  const Environment e({}, {},
                      {{{100, 0, 0}, 1.f, 50.f}, {{-100, 0, 0}, -2.f, 80.f}, {{0, 60, 30}, .7f, 20.f}});
  for (const Place& place : {Place(0, 0, 0), Place(20, 30, -10), Place(-150, 4, 7)}) {
    const auto field = e.field(place);
    double sum = 0.;
    for (const Attractor& a : e.attractors())
      sum += double(a.strength) * std::exp(-(a.at.cast<double>() - place).norm() / double(a.reach));
    EXPECT_NEAR(field.density, sum, 1e-12);
    const double h = 1e-4;
    Place slope;
    for (int axis = 0; axis < 3; ++axis)
      slope[axis] =
          e.field(place + h * Place::Unit(axis)).density - e.field(place - h * Place::Unit(axis)).density;
    EXPECT_LT((slope.normalized() - field.direction).norm(), 1e-5);
  }
}

TEST(Environment, RefusesWhatIsNoNumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Environment({{"L1", 5.f, 5.f}}), Error);
  EXPECT_THROW(Environment({{"L1", 0.f, inf}}), Error);
  EXPECT_THROW(Environment({{"L1", nan, 5.f}}), Error);
  EXPECT_THROW(Environment({}, {{{0, nan, 0}, 1.f}}), Error);
  EXPECT_THROW(Environment({}, {{{0, 3e38f, 0}, 1.f}}), Error);
  EXPECT_THROW(Environment({}, {{{0, 0, 0}, -1.f}}), Error);
  EXPECT_THROW(Environment({}, {}, {{{0, 0, 0}, 1.f, 0.f}}), Error);
  EXPECT_THROW(Environment({}, {}, {{{0, 0, 0}, inf, 1.f}}), Error);
}

}  // namespace
}  // namespace forest::cortex
