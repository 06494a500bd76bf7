// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/packing.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest {
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
    const std::string bytes = pack_points(points);
    ASSERT_FALSE(bytes.empty()) << places;
    EXPECT_EQ(unpack_points(bytes), points);
    EXPECT_LE(double(bytes.size()), 8. * double(points.size())) << places;
  }
}

TEST(Packing, MinusZeroStaysItself) {
  auto points = traced(1);
  points[3].x = points[4].x = points[7].radius = -0.f;
  const auto back = unpack_points(pack_points(points));
  ASSERT_EQ(back, points);
  EXPECT_TRUE(std::signbit(back[3].x) && std::signbit(back[4].x) && std::signbit(back[7].radius));
  EXPECT_FALSE(std::signbit(back[5].x) != std::signbit(points[5].x));
}

/// A walk as neurons grow: floats of every last bit.
std::vector<Point> grown(std::size_t count = 500) {
  Random random(5, 1, 1);
  std::vector<Point> points{{100.f, -50.f, 20.f, 2.f}};
  for (std::size_t i = 1; i < count; ++i) {
    const Point& p = points.back();
    points.push_back({p.x + float(random.normal()), p.y + float(random.normal()),
                      p.z + float(random.normal()), p.radius * .99f});
  }
  return points;
}

bool same_bits(const std::vector<Point>& a, const std::vector<Point>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0;
}

TEST(Packing, NumbersThatAreNoDecimalsGoFromFloatToFloat) {
  const auto points = grown();
  const std::string bytes = pack_points(points);
  ASSERT_FALSE(bytes.empty());
  EXPECT_TRUE(same_bits(unpack_points(bytes), points));
  EXPECT_LT(double(bytes.size()), 14. * double(points.size()));

  auto nearly = traced(2);
  nearly[77].y = std::nextafter(nearly[77].y, 1e9f);
  EXPECT_TRUE(same_bits(unpack_points(pack_points(nearly)), nearly));
}

TEST(Packing, NoFloatIsTooOdd) {
  auto points = grown();
  constexpr std::array odd{
      0.f,     -0.f,    NAN,     -NAN, INFINITY, -INFINITY, std::numeric_limits<float>::denorm_min(),
      -1e-45f, 3.4e38f, -3.4e38f};
  for (std::size_t i = 0; i < odd.size(); ++i)
    points[3 * i].x = points[3 * i + 1].radius = points[100 + i].z = odd[i];
  const std::string bytes = pack_points(points);
  ASSERT_FALSE(bytes.empty());
  EXPECT_TRUE(same_bits(unpack_points(bytes), points));
}

TEST(Packing, WhatWouldNotBeSmallerIsLeft) {
  Random random(7, 1, 1);
  std::vector<Point> points(100);
  for (Point& p : points)
    p = {float(random.normal()), float(random.normal()), float(random.normal()), float(random.normal())};
  EXPECT_TRUE(pack_points(points).empty());
  EXPECT_TRUE(pack_points({}).empty());
}

/// Sections of some points each, which begin where the one ends that they grow out of.
struct Branched {
  std::vector<Point> points;
  std::vector<std::int32_t> parents, counts;
  PointRuns runs() const { return {parents, counts}; }
};
Branched branched(std::vector<Point> from) {
  Branched b;
  Random random(9, 1, 1);
  std::vector<std::size_t> ends;
  for (std::size_t at = 0; at < from.size();) {
    const std::size_t run = ends.size(), count = std::min<std::size_t>(1 + random.below(8), from.size() - at);
    const std::int32_t parent = run % 7 == 0 ? -1 : std::int32_t(random.below(std::uint32_t(run)));
    if (parent >= 0) from[at] = from[ends[std::size_t(parent)]];
    b.parents.push_back(parent), b.counts.push_back(std::int32_t(count));
    ends.push_back((at += count) - 1);
  }
  b.points = std::move(from);
  return b;
}

TEST(Packing, ASectionBeginsWhereTheOneEndsThatItGrowsOutOf) {
  for (const Branched& b : {branched(traced(2)), branched(grown())}) {
    const std::string bytes = pack_points(b.points, b.runs());
    ASSERT_FALSE(bytes.empty());
    EXPECT_TRUE(same_bits(unpack_points(bytes, b.runs()), b.points));
    const double without = double(pack_points(b.points).size());
    EXPECT_LT(double(bytes.size()), .95 * without) << "a point in five is there already";
  }
}

TEST(Packing, SectionsMayHaveNoPointsAndBeDamaged) {
  const auto points = grown(6);
  const std::vector<std::int32_t> parents{-1, 0, 1, 1}, counts{0, 2, 0, 4};
  const std::string bytes = pack_points(points, {parents, counts});
  ASSERT_FALSE(bytes.empty());
  EXPECT_TRUE(same_bits(unpack_points(bytes, {parents, counts}), points));
  const std::vector<std::int32_t> later{-1, 3, 1, 1}, negative{0, -2, 0, 4}, long_ones{2000, 2000, 1, 1};
  EXPECT_THROW(unpack_points(bytes, {later, counts}), Error);
  EXPECT_THROW(unpack_points(bytes, {parents, negative}), Error);
  EXPECT_NO_THROW(unpack_points(bytes, {parents, long_ones})) << "its checksum will not be right";
}

TEST(Packing, CutOrChangedBytesAreAnErrorOrPoints) {
  for (const std::string& bytes : {pack_points(traced(2, 20)), pack_points(grown(20))}) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      try {
        EXPECT_LT(unpack_points(bytes.substr(0, size)).size(), 20u);
      } catch (const Error&) {
      }
      std::string changed = bytes;
      changed[size] = char(changed[size] ^ '\x85');
      try {
        EXPECT_LE(unpack_points(changed).size(), 40u);
      } catch (const Error&) {
      }
    }
  }
  EXPECT_THROW(unpack_points(std::string(40, '\xff')), Error);
  EXPECT_THROW(unpack_points("\x06\x80\x80\x80\x80\x40\1\1\1"), Error) << "beyond the last float";
  EXPECT_THROW(unpack_points("\x07\1\1\1\1"), Error);
}

}  // namespace
}  // namespace forest
