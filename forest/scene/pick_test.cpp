// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/pick.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/scene/path.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

Forest sample() { return Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons())); }

constexpr frame::Viewport viewport{640, 360};

TEST(Pick, IsWhatAPlainLoopOverAllSegmentsFinds) {
  const Forest forest = sample();
  const CameraPath path = walk(forest);
  Random random(4);
  int hits = 0;
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic})
    for (const float time : {0.f, .5f, .8f, 1.f})
      for (const float reach : {0.f, .5f, 3.f}) {
        frame::Camera camera = path.at(time).camera;
        camera.projection = projection;
        std::vector<Vec2> places;
        for (int i = 0; i < 300; ++i)
          places.emplace_back(float(random.below(640)) + .5f, float(random.below(360)) + .5f);
        const auto expected = plain_picks(forest, camera, viewport, places, reach);
        for (std::size_t i = 0; i < places.size(); ++i) {
          const auto found = pick(forest, camera, viewport, places[i], reach);
          ASSERT_EQ(found.has_value(), expected[i].has_value()) << places[i].transpose();
          if (!found) continue;
          ++hits;
          EXPECT_NEAR(found->distance, expected[i]->distance, 1e-6);
          EXPECT_EQ(found->instance, expected[i]->instance);
          EXPECT_EQ(found->segment, expected[i]->segment);
          EXPECT_EQ(found->section, expected[i]->section);
        }
      }
  EXPECT_GT(hits, 500);
}

TEST(Pick, AThinBranchIsUnderThePixelsItTouches) {
  // One straight branch of .1 µm, seen where a pixel covers some µm.
  MorphologyBuilder builder;
  const std::vector<Point> line{{0, -50, 0, .1f}, {0, 50, 0, .1f}};
  builder.add_section({}, SectionKind::axon, line);
  circuit::Circuit c = testing::sample_circuit(1);
  c.morphologies = {"line"};
  c.instances[0] = {
      .position = {0, 0, 0}, .orientation = Quat::Identity(), .morphology = 0, .type = 0, .layer = 0};
  const Forest forest = Forest::from_bytes(pack(c, std::vector<Morphology>{builder.build()}));
  const Vec3 centre(forest.instances()[0].x, 0, forest.instances()[0].z);
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic}) {
    const frame::Camera camera{
        .eye = centre + Vec3(0, 0, 800), .target = centre, .field_of_view = 40.f, .projection = projection};
    const float x = frame::project(camera, viewport, centre + Vec3(0, 50, 0)).x();
    EXPECT_FALSE(pick(forest, camera, viewport, {x + .4f, 180.f}, 0.f));
    EXPECT_TRUE(pick(forest, camera, viewport, {x + .4f, 180.f}));
    EXPECT_FALSE(pick(forest, camera, viewport, {x + .8f, 180.f}));
    EXPECT_TRUE(pick(forest, camera, viewport, {x - 2.9f, 180.f}, 3.f));
  }
}

TEST(Pick, TheSubarborOfTheSomaIsTheNeuronAndOfATipIsItself) {
  const Forest forest = sample();
  const Neuron& neuron = forest.neurons()[forest.instances()[0].morphology];
  EXPECT_EQ(subarbor(forest, 0, soma_section).size(), neuron.original_count);
  for (std::uint32_t s = 0; s < neuron.section_count; ++s) {
    const auto segments = subarbor(forest, 0, s);
    std::uint32_t own = 0;
    for (std::uint32_t i = 0; i < neuron.original_count; ++i)
      own += forest.section_of_segment()[neuron.first_original + i] == s;
    if (forest.sections()[neuron.first_section + s].daughters == 0) {
      EXPECT_EQ(segments.size(), own);
    } else {
      EXPECT_GT(segments.size(), own);
    }
  }
}

}  // namespace
}  // namespace forest::scene
