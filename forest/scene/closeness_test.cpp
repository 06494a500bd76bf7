// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/closeness.h"

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/scene/path.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

constexpr frame::Viewport wide{640.f, 360.f}, narrow{200.f, 360.f};

// Of every cluster of every neuron.
std::vector<float> all_of(Closeness& closeness, const Forest& forest) {
  std::vector<std::vector<float>> each(forest.standing().size());
  parallel_for(each.size(), 1, [&](std::size_t i) {
    const frame::Instance& instance = forest.standing()[i].instance;
    const auto of = closeness.of(std::uint32_t(i), Placed(instance));
    for (std::uint32_t c = 0; c < forest.neurons()[instance.morphology].cluster_count; ++c)
      each[i].push_back(of(c));
  });
  std::vector<float> all;
  for (const auto& one : each) all.insert(all.end(), one.begin(), one.end());
  return all;
}

std::vector<float> afresh(const Forest& forest, const Eye& eye) {
  Closeness closeness(forest);
  closeness.seen_by(eye);
  return all_of(closeness, forest);
}

TEST(Closeness, WhatIsKnownIsThatOfThePicture) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(100), testing::sample_neurons()));
  const CameraPath path = walk(forest);
  Closeness closeness(forest);
  std::vector<float> before;
  for (const float t : {.1f, .5f, .6f, .9f})
    for (const frame::Viewport& viewport : {wide, narrow}) {
      SCOPED_TRACE(t);
      const Eye eye(path.at(t).camera, viewport, {});
      closeness.seen_by(eye);
      const std::vector<float> first = all_of(closeness, forest);
      EXPECT_EQ(first, afresh(forest, eye));
      EXPECT_EQ(first, all_of(closeness, forest));
      EXPECT_NE(first, before);
      before = first;
      // The same picture of another size.
      closeness.seen_by(Eye(path.at(t).camera, {2.f * viewport.width, 2.f * viewport.height}, {}));
      EXPECT_EQ(all_of(closeness, forest), first);
    }
}

TEST(Closeness, OfAClusterIsNoLessThanThatOfItsChildren) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(100), testing::sample_neurons()));
  Closeness closeness(forest);
  closeness.seen_by(Eye(walk(forest).at(.9f).camera, wide, {}));
  std::size_t deep = 0;
  for (std::uint32_t i = 0; i < forest.standing().size(); ++i) {
    const frame::Instance& instance = forest.standing()[i].instance;
    const Neuron& neuron = forest.neurons()[instance.morphology];
    const auto of = closeness.of(i, Placed(instance));
    for (std::uint32_t c = 1; c < neuron.cluster_count; ++c) {
      const Cluster& cluster = forest.clusters()[neuron.first_cluster + c];
      deep += of(c) != of(0);
      if (cluster.is_leaf()) continue;
      for (const std::uint32_t child : cluster.children) EXPECT_GE(of(c), of(child - neuron.first_cluster));
    }
  }
  EXPECT_GT(deep, 100u);
}

}  // namespace
}  // namespace forest::scene
