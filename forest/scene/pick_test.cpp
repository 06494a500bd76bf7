// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/pick.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/scene/colouring.h"
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

TEST(Pick, OnlyWhatIsShownOfANeuronIsMet) {
  const Forest forest = sample();
  View view = overview(forest);
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i) {
    const Neuron& neuron = forest.neurons()[forest.instances()[i].morphology];
    if (i % 2) {  // a branch of a hidden neuron is shown, one of the others hidden
      view.targets.emplace_back().branch = Branch{i, soma_section};
      view.targets.back().visible = false;
    }
    view.targets.emplace_back().branch = Branch{i, i % neuron.section_count};
    view.targets.back().visible = i % 2;
  }
  const Colouring colouring = colour(Targets(forest), view);
  std::size_t on_shown = 0, hidden = 0;
  std::vector<Vec2> places;
  for (float y = .5f; y < viewport.height; y += 9.f)
    for (float x = .5f; x < viewport.width; x += 9.f) places.emplace_back(x, y);
  const auto plain = plain_picks(forest, view.camera, viewport, places, 2.f, colouring.shown());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto found = pick(forest, view.camera, viewport, places[i], 2.f, colouring.shown());
    ASSERT_EQ(found.has_value(), plain[i].has_value());
    hidden += pick(forest, view.camera, viewport, places[i], 2.f).has_value() && !found;
    if (!found) continue;
    EXPECT_EQ(found->segment, plain[i]->segment);
    const auto states = section_states(forest, colouring.shown(), found->instance);
    const bool of_branch = found->section != soma_section && states[found->section];
    EXPECT_EQ(of_branch, found->instance % 2 == 1) << found->instance;
    on_shown += of_branch;
  }
  EXPECT_GT(on_shown, 10u);
  EXPECT_GT(hidden, 10u);
  EXPECT_TRUE(plain_picks(forest, view.camera, viewport, {}).empty());
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
