// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/frame.h"

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::frame {
namespace {

TEST(Camera, ARayThroughAProjectedPixelMeetsThePoint) {
  const Camera camera{.eye = {30, 400, 800}, .target = {1, 2, 3}, .field_of_view = 55};
  const Viewport viewport{640, 480};
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 point(float(random.uniform(-90, 90)), float(random.uniform(-90, 90)),
                     float(random.uniform(-90, 90)));
    const Vec3 pixel = project(camera, viewport, point);
    const Ray ray = ray_through(camera, viewport, pixel.head<2>());
    EXPECT_LT((point - ray.origin).cross(ray.direction).norm(), .01f);
  }
}

TEST(Camera, AxesAreOrthonormalEvenLookingStraightUp) {
  for (const Vec3& target : {Vec3(0, 100, 0), Vec3(5, 5, 5), Vec3(0, -100, 0)}) {
    const Mat3 axes = Camera{.eye = {0, 0, 0}, .target = target}.axes();
    EXPECT_TRUE((axes.transpose() * axes).isIdentity(1e-5f));
  }
}

TEST(Frustum, NeverCullsWhatProjectsIntoThePicture) {
  const Camera camera{.eye = {0, 0, 100}, .target = {0, 0, 0}, .field_of_view = 40};
  const Viewport viewport{200, 100};
  const Frustum frustum(camera, viewport);
  Random random(2);
  int seen = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(float(random.uniform(-150, 150)), float(random.uniform(-150, 150)),
                 float(random.uniform(-100, 150)));
    const Vec3 pixel = project(camera, viewport, p);
    const bool inside = pixel.z() > 0 && pixel.x() > 0 && pixel.x() < 200 && pixel.y() > 0 && pixel.y() < 100;
    seen += inside;
    EXPECT_TRUE(!inside || frustum.may_see({p, 0.f}));
  }
  EXPECT_GT(seen, 100);
  EXPECT_FALSE(frustum.may_see({{0, 0, 200}, 50.f}));
}

TEST(Frame, ContractRefusesWhatIsOutOfRange) {
  const std::vector<Segment> segments(10);
  const std::vector<Instance> instances(2);
  const std::vector<State> states(2);
  const Geometry geometry{segments, instances};
  Frame frame;
  frame.states = states;
  EXPECT_NO_THROW(check(frame, geometry));
  const std::vector<Item> good{{1, 0, 0x3ff, 0, 0, 0, 0, 1}}, no_instance{{2, 0, 1, 0, 0, 0, 0, 1}},
      no_segments{{0, 5, 0x3f, 0, 0, 0, 0, 1}};
  frame.lines = good;
  EXPECT_NO_THROW(check(frame, geometry));
  frame.lines = no_instance;
  EXPECT_THROW(check(frame, geometry), Error);
  frame.lines = no_segments;
  EXPECT_THROW(check(frame, geometry), Error);
  frame.lines = good;
  const std::vector<frame::Band> short_band{{0, 0, 0}}, whole_band{{0, 1, 0}};
  frame.bands = short_band;
  EXPECT_THROW(check(frame, geometry), Error);
  frame.bands = whole_band;
  EXPECT_NO_THROW(check(frame, geometry));
  frame.camera.eye.x() = NAN;
  EXPECT_THROW(check(frame, geometry), Error);
}

TEST(Frame, TheBitsOfManyStatesAreThoseOfEach) {
  EXPECT_EQ(packed(bits_of({}).any), 0u);
  EXPECT_EQ(packed(bits_of({}).all), ~0u);
  std::vector<State> states(1000);
  EXPECT_EQ(bits_of(states).any, State{});
  EXPECT_EQ(bits_of(states).all, State{});
  states[777] = {3, Kind::lines, 254, State::visible | State::parted};
  const auto [any, all] = bits_of(states);
  EXPECT_EQ(any.colour_class, 3);
  EXPECT_EQ(any.kind, Kind::lines);
  EXPECT_TRUE(any.is(State::parted));
  EXPECT_LT(all.opacity, 255);
  EXPECT_TRUE(all.is(State::visible));
  EXPECT_FALSE(all.is(State::simulated));
}

}  // namespace
}  // namespace forest::frame
