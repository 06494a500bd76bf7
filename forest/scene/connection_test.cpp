// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/connection.h"

#include <gtest/gtest.h>

#include "forest/scene/path.h"
#include "forest/scene/view.h"
#include "forest/scene/whole.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

const frame::Viewport viewport{640, 360};

Forest sample() { return Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons())); }

TEST(Connection, TheWholeForestHangsTogether) {
  const Forest forest = sample();
  const Connectedness connectedness(forest);
  const frame::Camera camera = overview(forest).camera;
  const Connections found = connectedness(whole(forest, camera, viewport), camera, viewport);
  EXPECT_EQ(found.disconnected, 0u);
  EXPECT_GT(found.runs, forest.instances().size());
}

TEST(Connection, NoChoiceOfDetailBreaksABranchOnAWholeDolly) {
  const Forest forest = sample();
  const Connectedness connectedness(forest);
  const Dolly dolly(forest);
  for (int i = 0; i <= 40; ++i)
    for (const float error : {.5f, 1.f, 3.f, 6.f})
      for (const float thinnest : {0.f, .5f, 1.f, 6.f}) {
        const frame::Camera camera = dolly.at(float(i) / 40.f).camera;
        const Detail detail{.error = error, .gaze = {}, .thinnest = thinnest};
        const Cut cut = choose(forest, Eye(camera, viewport, detail));
        EXPECT_EQ(connectedness(cut, camera, viewport).disconnected, 0u)
            << i << " " << error << " " << thinnest;
      }
}

// What an earlier picture hid, and what is far, is chosen later, and hangs together with the rest all the same.
TEST(Connection, NothingComesApartBetweenTheRoundsOfAPicture) {
  const Forest forest = sample();
  const Connectedness connectedness(forest);
  const Dolly dolly(forest);
  for (int i = 0; i <= 40; i += 4) {
    const frame::Camera camera = dolly.at(float(i) / 40.f).camera;
    const Eye eye(camera, viewport, {.error = 2.f, .gaze = {}, .thinnest = 4.f});
    for (float first = 20.f; first < 2000.f; first *= 3.f) {
      const Sight sight{eye, nullptr, first};
      Cut all = std::move(choose(forest, std::span(&sight, 1)).front());
      std::vector<LeftOut> left = all.left_out;
      for (float horizon = 2.f * first; !left.empty();
           horizon = horizon < 4.f * first ? 4.f * first : INFINITY) {
        const Cut more = revealed(forest, {eye, nullptr, horizon}, left);
        all.lines.insert(all.lines.end(), more.lines.begin(), more.lines.end());
        all.capsules.insert(all.capsules.end(), more.capsules.begin(), more.capsules.end());
        left = more.left_out;
      }
      EXPECT_EQ(connectedness(all, camera, viewport).disconnected, 0u) << i << " " << first;
    }
  }
}

TEST(Connection, APieceThatIsMissingIsNoticed) {
  const Forest forest = sample();
  const Connectedness connectedness(forest);
  const frame::Camera camera = overview(forest).camera;
  const Cut all = whole(forest, camera, viewport);
  std::uint32_t broken = 0, last = 0;
  for (std::size_t i = 0; i < all.capsules.size(); i += 7) {
    Cut cut = all;
    cut.capsules.erase(cut.capsules.begin() + std::ptrdiff_t(i));
    (connectedness(cut, camera, viewport).disconnected ? broken : last) += 1;
  }
  EXPECT_GT(broken, 0u);
  EXPECT_GT(last, 0u);  // without what comes last on its branch nothing comes apart
}

TEST(Whole, HoldsEverySegmentOnceWhenAllIsInSight) {
  const Forest forest = sample();
  frame::Camera camera = overview(forest).camera;
  camera.eye += camera.eye - camera.target;
  const Cut all = whole(forest, camera, viewport);
  EXPECT_EQ(all.segments, forest.segment_total());
  NeuronsInSight in_sight;
  in_sight.clear(forest.instances().size());
  in_sight.add(all);
  in_sight.add(all);
  EXPECT_EQ(in_sight.count(), forest.instances().size());     // each once
  camera.target = camera.eye + (camera.eye - camera.target);  // looking away
  EXPECT_EQ(whole(forest, camera, viewport).segments, 0u);
}

TEST(Dolly, EndsBeforeASomaThatFillsHalfTheHeight) {
  const Forest forest = sample();
  const Dolly dolly(forest);
  const frame::Camera end = dolly.at(1.f).camera;
  float distance = INFINITY, radius = 0.f;
  for (const frame::Instance& i : forest.instances())
    if (const float d = (Vec3(i.x, i.y, i.z) - end.target).norm(); d < distance)
      distance = d, radius = forest.neurons()[i.morphology].soma_radius;
  EXPECT_LT(distance, .01f);
  const float half_height = (end.target - end.eye).norm() * std::tan(.5f * radians(end.field_of_view));
  EXPECT_NEAR(radius / half_height, .5f, .01f);
}

TEST(Dolly, ComesNearerBySmallSteps) {
  const Dolly dolly(sample());
  const Vec3 goal = dolly.at(1.f).camera.target;
  float before = (dolly.at(0.f).camera.eye - goal).norm();
  for (int i = 1; i <= 250; ++i) {
    const View view = dolly.at(float(i) / 250.f);
    const float now = (view.camera.eye - goal).norm();
    EXPECT_LE(now, before * 1.0001f);
    EXPECT_GT(now, before * .94f);
    EXPECT_TRUE(view.camera.axes().allFinite());
    before = now;
  }
}

}  // namespace
}  // namespace forest::scene
