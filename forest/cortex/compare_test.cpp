// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/compare.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/progress.h"

namespace forest::cortex {
namespace {

std::vector<Place> square(double side, double shift) {
  return {{shift, 0.}, {side + shift, 0.}, {side + shift, side}, {shift, side}};
}

ContourStack pair(const std::vector<Place>& a, const std::vector<Place>& b) {
  ContourStack stack{.axis = Axis::z, .objects = {"other", "outer"}, .sections = {{0., {}}, {1000., {}}}};
  stack.sections[0].contours.push_back({1, straight_loop(a)});
  if (!b.empty()) stack.sections[1].contours.push_back({1, straight_loop(b)});
  return stack;
}

TEST(Changes, OfTheSameContourAreNone) {
  const auto all = changes(pair(square(5000., 0.), square(5000., 0.)), Progress::none());
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].object, 1u);
  EXPECT_NEAR(all[0].greatest, 0., 1e-3);
  EXPECT_EQ(all[0].overlap, 1.);
}

TEST(Changes, OfAShiftedSquareAreKnown) {
  const auto all = changes(pair(square(5000., 0.), square(5000., 400.)), Progress::none());
  ASSERT_EQ(all.size(), 1u);
  // Two sides move by 400 µm, along the two others only the ends stick out.
  EXPECT_NEAR(all[0].greatest, 400., 1.);
  EXPECT_NEAR(all[0].mean, (2. * 5000. * 400. - 400. * 400. + 400. * 200. * 2.) / 20000., 10.);
  EXPECT_NEAR(all[0].overlap, 4600. / 5400., .01);
}

TEST(Changes, AreTheSameOfWhatIsAThousandTimesSmaller) {
  const auto large = changes(pair(square(5000., 0.), square(5000., 400.)), Progress::none()),
             small = changes(pair(square(5., 0.), square(5., .4)), Progress::none());
  EXPECT_NEAR(small[0].mean, large[0].mean / 1e3, .005);
  EXPECT_NEAR(small[0].greatest, large[0].greatest / 1e3, .001);
  EXPECT_NEAR(small[0].overlap, large[0].overlap, .01);
}

// Half of a blade 200 µm thick and 100 mm long; which way around contours are drawn says nothing.
TEST(Changes, OfThinShapesAreAsExactAsOfLargeOnes) {
  const auto blade = [](double thick, bool upright) {
    std::vector<Place> points{{0., 0.}, {1e5, 0.}, {1e5, thick}, {0., thick}};
    if (upright)
      for (Place& p : points) p = {p.y(), p.x()};
    return points;
  };
  for (const bool upright : {false, true}) {
    const auto thin = changes(pair(blade(200., upright), blade(100., upright)), Progress::none());
    EXPECT_NEAR(thin[0].overlap, .5, 1e-3) << upright;
  }
  const auto turned = changes(pair(blade(200., false), blade(200., true)), Progress::none());
  EXPECT_NEAR(turned[0].overlap, 200. * 200. / (2. * 200. * 1e5 - 200. * 200.), 1e-4);
  std::vector<Place> around = square(5000., 0.);
  std::ranges::reverse(around);
  EXPECT_EQ(changes(pair(square(5000., 0.), around), Progress::none())[0].overlap, 1.);
  // A hole of a quarter.
  ContourStack hole = pair(square(5000., 0.), square(5000., 0.));
  hole.sections[1].contours.push_back({1, straight_loop(square(2500., 1000.))});
  EXPECT_NEAR(changes(hole, Progress::none())[0].overlap, .75, 1e-3);
}

TEST(Changes, SeeWhatOnlyOneSectionHas) {
  ContourStack stack = pair(square(5000., 0.), square(5000., 0.));
  stack.sections[1].contours.push_back({1, straight_loop(square(100., 20000.))});
  const auto more = changes(stack, Progress::none());
  EXPECT_NEAR(more[0].greatest, 15100., 1.);
  const auto gone = changes(pair(square(5000., 0.), {}), Progress::none());
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_TRUE(std::isnan(gone[0].mean));
}

}  // namespace
}  // namespace forest::cortex
