// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/packing.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::repository {
namespace {

/// A walk whose numbers have `places` decimals.
std::vector<Point> traced(int places, std::size_t count = 500, double far = 300.) {
  Random random(3, std::uint64_t(places), 1);
  const double scale = std::pow(10., places);
  const auto decimal = [&](double value) { return float(std::round(value * scale) / scale) + 0.f; };
  std::vector<Point> points;
  double x = random.uniform(-far, far), y = random.uniform(-far, far), z = random.uniform(-far, far);
  for (std::size_t i = 0; i < count; ++i) {
    x += random.normal(0, 2), y += random.normal(0, 2), z += random.normal(0, 2);
    points.push_back({decimal(x), decimal(y), decimal(z), decimal(random.uniform(.1, 2.))});
  }
  return points;
}

TEST(Packing, GivesBackEveryBitInEightBytesAPoint) {
  for (int places = 0; places <= 3; ++places) {
    const auto points = traced(places);
    const std::string bytes = packed(points);
    ASSERT_FALSE(bytes.empty()) << places;
    EXPECT_EQ(unpacked(bytes), points);
    EXPECT_LE(double(bytes.size()), 8. * double(points.size())) << places;
  }
}

TEST(Packing, MinusZeroStaysItself) {
  auto points = traced(1);
  points[3].x = points[4].x = points[7].radius = -0.f;
  const auto back = unpacked(packed(points));
  ASSERT_EQ(back, points);
  EXPECT_TRUE(std::signbit(back[3].x) && std::signbit(back[4].x) && std::signbit(back[7].radius));
  EXPECT_FALSE(std::signbit(back[5].x) != std::signbit(points[5].x));
}

TEST(Packing, NumbersThatAreNoDecimalsAreNotPacked) {
  auto points = traced(2);
  points[77].y = std::nextafter(points[77].y, 1e9f);
  EXPECT_TRUE(packed(points).empty());
  points = traced(1);
  points[3].x = NAN;
  EXPECT_TRUE(packed(points).empty());
  points[3].x = 3e38f;
  EXPECT_TRUE(packed(points).empty());
  EXPECT_TRUE(packed({}).empty());
}

TEST(Packing, CutOrChangedBytesAreAnErrorOrPoints) {
  const std::string bytes = packed(traced(2, 20));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    try {
      EXPECT_LT(unpacked(bytes.substr(0, size)).size(), 20u);
    } catch (const Error&) {
    }
  }
  EXPECT_THROW(unpacked(std::string(40, '\xff')), Error);
}

}  // namespace
}  // namespace forest::repository
