// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/volume.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace forest::cortex {
namespace {

Volume ball(double radius) {
  Volume volume{.size = {40, 50, 60}, .origin = {-1000., 500., 0.}, .step = {100., 80., 70.}, .values = {}};
  const Eigen::Vector3d centre(950., 2400., 2100.);
  for (std::size_t z = 0; z < 60; ++z)
    for (std::size_t y = 0; y < 50; ++y)
      for (std::size_t x = 0; x < 40; ++x)
        volume.values.push_back(float(
            radius - (volume.origin +
                      volume.step.cwiseProduct(Eigen::Vector3d(double(x), double(y), double(z))) - centre)
                         .norm()));
  return volume;
}

TEST(ContoursOfAVolume, OfABallAreCirclesBelowAVoxel) {
  const Volume volume = ball(1200.);
  const Eigen::Vector3d centre(950., 2400., 2100.);
  for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
    const double planes[] = {centre[int(axis)] - 777., centre[int(axis)] + 13.};
    const ContourStack stack = contours_of(volume, "outer", axis, planes, 0.);
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(stack.sections[i].contours.size(), 1u);
      const double height = planes[i] - centre[int(axis)],
                   radius = std::sqrt(1200. * 1200. - height * height);
      for (const Place& p : stack.sections[i].contours[0].curve.points)
        EXPECT_NEAR((p - flat(centre, axis)).norm(), radius, 4.);  // of voxels of 70 to 100
      EXPECT_GT(area(stack.sections[i].contours[0].curve), 0.);
    }
    EXPECT_EQ(fault_of(stack), "");
  }
}

TEST(ContoursOfAVolume, CloseAlongItsBorder) {
  const double planes[] = {2400.};
  const ContourStack stack = contours_of(ball(1e5), "outer", Axis::y, planes, 0.);
  ASSERT_EQ(stack.sections[0].contours.size(), 1u);
  EXPECT_GT(area(stack.sections[0].contours[0].curve), 3900. * 4130.);
  const double beyond[] = {-5000.};
  EXPECT_TRUE(contours_of(ball(1e5), "outer", Axis::y, beyond, 0.).sections[0].contours.empty());
}

TEST(MarchingSquares, HoldTheirInsideToTheLeftAndHolesTheOtherWay) {
  std::vector<float> ring(21 * 21);
  for (int y = 0; y < 21; ++y)
    for (int x = 0; x < 21; ++x)
      ring[std::size_t(21 * y + x)] = float(3. - std::abs(std::hypot(x - 10., y - 10.) - 6.));
  const auto polygons = marching_squares(ring, 21, 21, 0.);
  ASSERT_EQ(polygons.size(), 2u);
  double sum = 0.;
  for (const auto& polygon : polygons) sum += area(straight_loop(polygon));
  EXPECT_NEAR(sum, M_PI * (81. - 9.), 3.);
}

TEST(MarchingSquares, LetTheSaddleDecide) {
  // Two inside corners crosswise: apart when they are weak, joined when they are strong.
  const auto pieces = [](float strength) {
    const float values[] = {strength, -1.f, -1.f, strength};
    return marching_squares(values, 2, 2, 0.).size();
  };
  EXPECT_EQ(pieces(.5f), 2u);
  EXPECT_EQ(pieces(2.f), 1u);
}

TEST(MarchingSquares, OfAnyNumbersGiveLoopsThatDoNotCross) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    std::vector<float> values(30 * 20);
    for (float& value : values) value = float(random() % 1000) / 500.f - 1.f;
    values[37] = NAN, values[99] = INFINITY;
    ContourStack stack{.axis = Axis::z, .objects = {"a"}, .sections = {Section{}}};
    for (const auto& polygon : marching_squares(values, 30, 20, 0.)) {
      EXPECT_GE(polygon.size(), 3u);
      stack.sections[0].contours.push_back({.object = 0, .curve = straight_loop(polygon)});
    }
    EXPECT_EQ(fault_of(stack), "");
  }
}

}  // namespace
}  // namespace forest::cortex
