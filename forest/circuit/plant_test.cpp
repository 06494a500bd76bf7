// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/plant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <boost/math/distributions/chi_squared.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest::circuit {
namespace {

using testing::HasSubstr;

// Two dense layers of unlike somata, so that room is scarce enough for mistakes to show.
Recipe dense_recipe() {
  return {.name = "dense",
          .radius = 150.f,
          .types = {{.name = "small", .population = "s"},
                    {.name = "large", .population = "l", .excitatory = false}},
          .layers = {{.name = "upper", .thickness = 200.f, .density = 90000., .count = {}, .mix = {.9, .1}},
                     {.name = "lower", .thickness = 300.f, .density = 40000., .count = {}, .mix = {.5, .5}}},
          .neurons = {},
          .soma_gap = .5f,
          .rotate = true};
}

const std::vector<Candidate> candidates{{"s1", "s", 5.f}, {"s2", "s", 6.f},  {"other", "unused", 1.f},
                                        {"s3", "s", 4.f}, {"l1", "l", 12.f}, {"l2", "l", 9.f}};

float radius_of(const Circuit& circuit, const Instance& instance) {
  return std::ranges::find(candidates, circuit.morphologies[instance.morphology], &Candidate::name)
      ->soma_radius;
}

// p value of Pearson's test that `share` in [0, 1) falls evenly into 20 bins.
class Even {
 public:
  void add(double share) {
    ++seen_[std::min(seen_.size() - 1, std::size_t(share * double(seen_.size())))], ++count_;
  }
  double p() const {
    double sum = 0., expected = double(count_) / double(seen_.size());
    for (const int k : seen_) sum += (k - expected) * (k - expected) / expected;
    return boost::math::cdf(boost::math::complement(boost::math::chi_squared(double(seen_.size() - 1)), sum));
  }

 private:
  std::array<int, 20> seen_{};
  int count_ = 0;
};

TEST(Plant, CountsAreExact) {
  const Recipe recipe = dense_recipe();
  const Circuit circuit = plant(recipe, candidates, 1);
  const auto wanted = counts(recipe);
  for (const Tally& row : tally(circuit)) EXPECT_EQ(row.count, wanted[row.layer][row.type]);
  for (const Tally& row : tally(circuit)) {
    const double target = recipe.layers[row.layer].density * recipe.layers[row.layer].mix[row.type];
    EXPECT_NEAR(row.density / target, 1., .002);
  }
  EXPECT_EQ(tally(circuit).size(), 4u);
  EXPECT_NO_THROW(check(circuit));
}

TEST(Plant, NoTwoSomataAreCloserThanTheGap) {
  const Recipe recipe = dense_recipe();
  const Circuit circuit = plant(recipe, candidates, 2);
  const auto& all = circuit.instances;
  double closest = 1e9;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double distance = (all[i].position - all[j].position).cast<double>().norm();
      closest = std::min(closest, distance - double(radius_of(circuit, all[i]) + radius_of(circuit, all[j])));
    }
  EXPECT_GE(closest, .5 - 1e-4);
  EXPECT_LT(closest, 1.);  // the test could not fail if there were room for all
}

TEST(Plant, SomataStandInTheirLayer) {
  const Recipe recipe = dense_recipe();
  const Circuit circuit = plant(recipe, candidates, 3);
  const cortex::Column tissue = column(recipe);
  for (const Instance& instance : circuit.instances)
    EXPECT_TRUE(tissue.contains(instance.layer, instance.position));
}

TEST(Plant, DepthAndRotationAreUniform) {
  Recipe recipe = dense_recipe();
  recipe.layers[0].density = 20000.;
  recipe.layers[1].density = 20000.;
  recipe.radius = 400.f;
  const Circuit circuit = plant(recipe, candidates, 4);
  std::array<Even, 2> depth, rotation;
  for (const Instance& instance : circuit.instances) {
    const Layer& layer = circuit.layers[instance.layer];
    depth[instance.layer].add((instance.position.y() - layer.bottom) / (layer.top - layer.bottom));
    const Vec3 east = instance.orientation * Vec3::UnitX();
    EXPECT_NEAR(east.y(), 0.f, 1e-6f) << "the axis is not vertical";
    rotation[instance.type].add(std::atan2(double(-east.z()), double(east.x())) / (2. * std::numbers::pi) +
                                .5);
  }
  for (const std::size_t i : {0, 1}) {
    EXPECT_GT(depth[i].p(), 1e-4);
    EXPECT_GT(rotation[i].p(), 1e-4);
  }
}

TEST(Plant, NeuronsOfAPopulationHaveEqualChance) {
  const Circuit circuit = plant(dense_recipe(), candidates, 5);
  std::vector<double> seen(circuit.morphologies.size());
  for (const Instance& instance : circuit.instances) {
    ++seen[instance.morphology];
    const auto& candidate =
        *std::ranges::find(candidates, circuit.morphologies[instance.morphology], &Candidate::name);
    EXPECT_EQ(candidate.population, circuit.types[instance.type].population);
  }
  EXPECT_THAT(circuit.morphologies, testing::ElementsAre("s1", "s2", "s3", "l1", "l2"));
  const auto p = [&](std::size_t from, std::size_t count) {
    double total = std::accumulate(&seen[from], &seen[from] + count, 0.), sum = 0.,
           expected = total / double(count);
    for (std::size_t i = from; i < from + count; ++i)
      sum += (seen[i] - expected) * (seen[i] - expected) / expected;
    return boost::math::cdf(boost::math::complement(boost::math::chi_squared(double(count - 1)), sum));
  };
  EXPECT_GT(p(0, 3), 1e-4);
  EXPECT_GT(p(3, 2), 1e-4);
}

TEST(Plant, IsAPureFunctionOfItsSeedAtAnyNumberOfThreads) {
  const Circuit all_threads = plant(dense_recipe(), candidates, 6);
  const ThreadLimit one(1);
  EXPECT_EQ(plant(dense_recipe(), candidates, 6), all_threads);
  EXPECT_NE(plant(dense_recipe(), candidates, 7), all_threads);
}

TEST(Plant, WithoutRotationNeuronsStandAsTheyWereTraced) {
  Recipe recipe = dense_recipe();
  recipe.rotate = false;
  for (const Instance& instance : plant(recipe, candidates, 8).instances)
    EXPECT_EQ(instance.orientation, Quat::Identity());
}

TEST(Plant, ALayerThatCannotBePackedIsNamed) {
  Recipe recipe = dense_recipe();
  recipe.layers[1].density = 200000.;
  try {
    plant(recipe, candidates, 9);
    FAIL() << "packed the impossible";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("layer lower"));
    EXPECT_THAT(error.what(), HasSubstr("lower its density"));
  }
}

TEST(Plant, AThinLayerMayBeFullerThanOneThatSomataDoNotStickOutOf) {
  Recipe recipe = dense_recipe();
  recipe.layers = {{.name = "thin", .thickness = 3.f, .density = 0., .count = 120, .mix = {1., 0.}}};
  EXPECT_EQ(plant(recipe, candidates, 9).instances.size(), 120u);
  recipe.layers[0].count = 2000;  // with all that they may stick out they would fill it
  EXPECT_THROW(plant(recipe, candidates, 9), Error);
}

TEST(Plant, AnEmptyPopulationIsNamedUnlessNothingOfItIsWanted) {
  Recipe recipe = dense_recipe();
  recipe.types[1].population = "nobody";
  try {
    plant(recipe, candidates, 10);
    FAIL() << "planted nobody";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("population nobody is empty"));
  }
  for (auto& layer : recipe.layers) layer.mix = {1., 0.};
  EXPECT_NO_THROW(plant(recipe, candidates, 10));
}

TEST(Plant, CandidatesOfOneNameAreRefused) {
  EXPECT_THROW(plant(dense_recipe(), std::vector<Candidate>{{"a", "s", 1.f}, {"a", "l", 1.f}}, 11), Error);
}

TEST(Check, NamesWhatIsWrong) {
  const Circuit good = plant(dense_recipe(), candidates, 12);
  const auto says = [&](auto&& spoil, const char* what) {
    Circuit bad = good;
    spoil(bad);
    try {
      check(bad);
      ADD_FAILURE() << "accepted: " << what;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  };
  says([](Circuit& c) { c.instances[7].layer = 2; }, "neuron 7 has layer number 2");
  says([](Circuit& c) { c.instances[8].type = 9; }, "neuron 8 has cell type number 9");
  says([](Circuit& c) { c.instances[9].morphology = 5; }, "neuron 9 has morphology number 5");
  says([](Circuit& c) { c.instances[3].position.y() = std::nanf(""); }, "position of neuron 3");
  says([](Circuit& c) { c.instances[4].orientation.w() = 3.f; }, "orientation of neuron 4");
  says([](Circuit& c) { c.layers[1].top = -1.f; }, "layer lower");
  says([](Circuit& c) { c.types[1].name = "small"; }, "two cell types");
  says([](Circuit& c) { c.morphologies[2].clear(); }, "has no name");
}

TEST(Plant, NeuronsEndUnderThePia) {
  const Recipe recipe = dense_recipe();  // layers end 200 and 500 µm under the pia
  const std::vector<Candidate> tall{{"short", "s", 4.f, 20.f},
                                    {"middle", "s", 4.f, 130.f},
                                    {"long", "s", 4.f, 330.f},
                                    {"giant", "l", 9.f, 900.f},
                                    {"big", "l", 9.f, 700.f}};
  const Circuit circuit = plant(recipe, tall, 4);
  std::array<int, 5> count{};
  for (const Instance& instance : circuit.instances) {
    const auto c = std::ranges::find(tall, circuit.morphologies[instance.morphology], &Candidate::name);
    ++count[std::size_t(c - tall.begin())];
    if (c->population == "s") {
      EXPECT_LE(instance.position.y() + c->height, circuit.layers[0].top + pia_slack + .01f) << c->name;
    } else {
      EXPECT_EQ(c->name, "big") << "none fits, so the lowest";
    }
  }
  EXPECT_GT(count[1], count[2]);
  EXPECT_GT(count[0], count[1]);
  EXPECT_GT(count[2], 0);
  const std::vector<TooTall> told = too_tall(recipe, tall);
  ASSERT_EQ(told.size(), 1u);  // of the small ones the long one fits into the lower layer
  EXPECT_EQ(told[0].type, 1u);
  EXPECT_EQ(told[0].count, 2u);
  EXPECT_EQ(told[0].of, 2u);
}

}  // namespace
}  // namespace forest::circuit
