// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/cut.h"

#include <map>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/scene/chooser.h"
#include "forest/scene/path.h"
#include "forest/scene/view.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

const frame::Viewport viewport{640, 360};

Forest sample() { return Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons())); }

bool same(const std::vector<frame::Item>& a, const std::vector<frame::Item>& b) {
  return std::ranges::equal(a, b, [](const frame::Item& x, const frame::Item& y) {
    return x.instance == y.instance && x.first_segment == y.first_segment && x.drawn == y.drawn;
  });
}

// Whether a point is inside the picture.
bool in_sight(const frame::Camera& camera, const Vec3& point) {
  const Vec3 pixel = frame::project(camera, viewport, point);
  return pixel.z() > camera.near && pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < viewport.width &&
         pixel.y() < viewport.height;
}

TEST(Cut, DrawsEverySegmentInSightOnce) {
  const Forest forest = sample();
  const CameraPath path = walk(forest);
  for (const float t : {0.f, .3f, .6f, 1.f}) {
    const View view = path.at(t);
    const Cut cut = choose(forest, Eye(view.camera, viewport, view.detail));
    // Of every instance: the segments that are drawn, none twice, and the original ones they stand for. None in sight is
    // missing of either.
    std::vector<std::set<std::uint32_t>> drawn(forest.instances().size()), shown(drawn.size());
    for (const auto* list : {&cut.lines, &cut.capsules})
      for (const frame::Item& item : *list)
        for (std::uint32_t i = 0; i < frame::cluster_size; ++i)
          if (item.drawn >> i & 1u) {
            EXPECT_TRUE(drawn[item.instance].insert(item.first_segment + i).second);
          }
    for (std::uint32_t i = 0; i < drawn.size(); ++i) {
      const frame::Instance& instance = forest.instances()[i];
      const Neuron& neuron = forest.neurons()[instance.morphology];
      const auto segment_in_sight = [&](std::uint32_t s) {
        const frame::Segment& segment = forest.segments()[s];
        return in_sight(view.camera, Vec3(instance.x, instance.y, instance.z) +
                                         Quat(instance.qw, instance.qx, instance.qy, instance.qz) *
                                             Vec3(segment.ax, segment.ay, segment.az));
      };
      for (const Cluster& c : forest.clusters().subspan(neuron.first_cluster, neuron.cluster_count)) {
        const auto first = drawn[i].lower_bound(c.first_segment);
        if (first == drawn[i].end() || *first >= c.first_segment + c.segment_count) continue;
        for (std::uint32_t s = c.first_segment; s < c.first_segment + c.segment_count; ++s)
          if (segment_in_sight(s)) {
            EXPECT_TRUE(drawn[i].contains(s)) << "neuron " << i << " segment " << s;
          }
        for (std::uint32_t s = c.leaf_first; s < c.leaf_first + c.leaf_count; ++s) shown[i].insert(s);
      }
      for (std::uint32_t s = neuron.first_segment; s < neuron.first_segment + neuron.original_count; ++s)
        if (segment_in_sight(s)) {
          EXPECT_TRUE(shown[i].contains(s)) << "neuron " << i << " segment " << s;
        }
    }
  }
}

TEST(Cut, ShowsNothingWorseThanAccepted) {
  const Forest forest = sample();
  const View view = overview(forest);
  const Eye eye(view.camera, viewport, view.detail);
  const Cut cut = choose(forest, eye);
  for (const frame::Item& item : cut.lines)
    for (const Cluster& c : forest.clusters())
      if (c.first_segment <= item.first_segment && item.first_segment < c.first_segment + c.segment_count &&
          !c.is_leaf()) {
        const frame::Instance& i = forest.instances()[item.instance];
        const Vec3 centre = Vec3(i.x, i.y, i.z) + Quat(i.qw, i.qx, i.qy, i.qz) * Vec3(c.x, c.y, c.z);
        EXPECT_TRUE(eye.good_enough({centre, c.radius * 1.0001f}, c.error * .9999f));
      }
}

TEST(Cut, IsNearToFarAndTheSameAtAnyNumberOfThreads) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(500), testing::sample_neurons()));
  const View view = overview(forest);
  const Eye eye(view.camera, viewport, view.detail);
  const Cut all = choose(forest, eye);
  ASSERT_FALSE(all.lines.empty());
  EXPECT_GT(all.bands.size(), 1u);
  for (std::size_t i = 1; i < all.lines.size(); ++i) {
    const auto depth = [&](const frame::Item& item) {
      return eye.nearest_depth({{item.x, item.y, item.z}, 0.f});
    };
    EXPECT_LE(depth(all.lines[i - 1]), depth(all.lines[i]) * 1.03f);
  }
  const ThreadLimit one(1);
  const Cut single = choose(forest, eye);
  EXPECT_TRUE(same(all.lines, single.lines) && same(all.capsules, single.capsules) &&
              same(all.dots, single.dots));
}

TEST(Cut, ShowsEveryNeuronInItsTurn) {
  const Forest forest = sample();
  const View view = overview(forest);
  const Eye eye(view.camera, viewport, view.detail);
  const Sight sight{eye};
  std::vector<std::uint8_t> seen(forest.instances().size());
  for (std::size_t i = 0; i < seen.size(); i += 5) seen[i] = 1;
  const Cut whole = choose(forest, eye);
  std::map<std::uint32_t, std::uint64_t> times, all;  // of every instance, items
  const auto count = [](const Cut& cut, std::map<std::uint32_t, std::uint64_t>& of) {
    for (const auto* list : {&cut.dots, &cut.lines, &cut.capsules})
      for (const frame::Item& item : *list)
        if (item.instance != FOREST_IN_WORLD) ++of[item.instance];
  };
  count(whole, all);
  for (std::uint32_t turn = 0; turn < 3; ++turn)
    count(choose(forest, std::span(&sight, 1), {}, nullptr, {seen, turn, 3}).front(), times);
  ASSERT_EQ(times.size(), all.size());
  for (const auto& [instance, items] : all)
    EXPECT_EQ(times[instance], (seen[instance] ? 3 : 1) * items) << instance;
}

// What was seen is known of the whole picture only if all of its parts tell.
TEST(Chooser, LooksAtAllNeuronsUnlessAllPartsOfThePictureTellWhatWasSeen) {
  const Forest forest = sample();
  View view = overview(forest);
  view.detail.turns = 2;
  Chooser one(forest), other(forest);
  Chooser* both[] = {&one, &other};
  const std::vector<Eye> eyes(2, Eye(view.camera, viewport, view.detail));
  const std::vector<std::uint8_t> nothing(forest.instances().size());
  const auto segments = [&](std::size_t parts) {
    Chooser::choose(std::span(both, parts), std::span(eyes).first(parts));
    for (Chooser* c : std::span(both, parts)) c->remember({}, nothing);
    return one.cut().segments;
  };
  const std::uint64_t all = choose(forest, eyes[0]).segments;
  (void)segments(2);  // to a first horizon
  EXPECT_LT(segments(2), all);
  EXPECT_EQ(segments(1), all);  // the other one told of a part
  EXPECT_LT(segments(1), all);
  EXPECT_EQ(segments(2), all);
  one.remember({});
  EXPECT_EQ(segments(2), all);
}

TEST(Cut, LeavesOutOnlyBranchesTooThinToShow) {
  const Forest forest = sample();
  for (const Cluster& c : forest.clusters()) {
    for (std::size_t order = 0; order < order_count; ++order)
      for (const float magnification : {.03f, .1f, .3f, 1.f, 3.f}) {
        const std::uint32_t shown = c.visible_at(magnification, order);
        ASSERT_EQ(shown & ~c.all(), 0u);
        for (std::uint32_t i = 0; i < c.segment_count; ++i) {
          if (shown >> i & 1u) continue;
          const frame::Segment& s = forest.segments()[c.first_segment + i];
          const float width = 2.f * std::max(from_half(s.radii), from_half(s.radii >> 16)) * magnification;
          EXPECT_LE(2.f * float(FOREST_MEAN_STRETCH) * from_half(s.meta >> 16) * magnification, 1.2f);
          EXPECT_LT(width,
                    (c.is_leaf() ? 1.5f : 3.f * 1.5f) * 1.2f);  // coarse ones are widened, up to three times
        }
      }
  }
}

TEST(Cut, GazeDrawsLess) {
  const Forest forest = sample();
  View view = overview(forest);
  view.camera.eye = view.camera.target + .4f * (view.camera.eye - view.camera.target);
  const Cut whole = choose(forest, Eye(view.camera, viewport, view.detail));
  view.detail.gaze = Vec2(.5f, .5f);
  const Cut gazed = choose(forest, Eye(view.camera, viewport, detail_for(view, 640, 360)));
  EXPECT_LT(gazed.segments, whole.segments);
}

TEST(CameraPath, TurnsAndZoomsOnTheSpotAsSlowlyAsItGoes) {
  std::vector<View> keys(4);
  for (View& v : keys) v.camera.eye = Vec3::Zero();
  keys[0].camera.target = Vec3(0.f, 0.f, -500.f);
  keys[1].camera.target = Vec3(500.f, 0.f, 0.f);  // a quarter turn, then a zoom, then a step
  keys[2].camera = keys[1].camera, keys[2].camera.field_of_view = 10.f;
  keys[3].camera = keys[2].camera, keys[3].camera.eye.x() = 400.f, keys[3].camera.target.x() = 900.f;
  const CameraPath path(keys);
  constexpr int pictures = 240;
  float turn = 0.f, zoom = 0.f, move = 0.f;  // most from one picture to the next
  for (int i = 0; i + 1 < pictures; ++i) {
    const frame::Camera a = path.at(float(i) / (pictures - 1)).camera,
                        b = path.at(float(i + 1) / (pictures - 1)).camera;
    turn = std::max(turn, float(Quat(a.axes()).angularDistance(Quat(b.axes()))));
    zoom = std::max(zoom, std::abs(std::log(b.field_of_view / a.field_of_view)));
    move = std::max(move, (b.eye - a.eye).norm());
  }
  EXPECT_LT(turn, .08f);
  EXPECT_LT(zoom, .08f);
  EXPECT_LT(move, 25.f);
  EXPECT_NEAR(path.at(1.f).camera.field_of_view, 10.f, 1e-3f);
}

TEST(CameraPath, GoesThroughItsEndsSmoothlyAndNeverThroughASoma) {
  const Forest forest = sample();
  const CameraPath path = walk(forest);
  Vec3 before = path.at(0.f).camera.eye;
  EXPECT_LT((before - overview(forest).camera.eye).norm(), 1e-2f);
  const float whole = (path.at(1.f).camera.eye - before).norm();
  for (int i = 1; i <= 500; ++i) {
    const View view = path.at(float(i) / 500.f);
    EXPECT_LT((view.camera.eye - before).norm(), whole / 50.f);
    EXPECT_GT(soma_clearance(forest, view.camera.eye), 0.f);
    before = view.camera.eye;
  }
}

}  // namespace
}  // namespace forest::scene
