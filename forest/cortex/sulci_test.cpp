// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/sulci.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::cortex {
namespace {

// A surface 2 mm thick whose radius, µm, depends on the direction.
template <class Radius>
Ribbon ribbon_of(Radius&& radius) {
  const Mesh ball = icosphere(Vec3::Zero(), 1.f, 5, 0);
  Ribbon ribbon;
  for (const Vec3& p : ball.positions) {
    const Place way = p.cast<double>().normalized();
    const double r = radius(way);
    ribbon.outer.push_back(r * way), ribbon.middle.push_back((r - 1e3) * way),
        ribbon.inner.push_back((r - 2e3) * way);
  }
  ribbon.thickness.assign(ribbon.size(), 2e3f), ribbon.wall.assign(ribbon.size(), 0);
  ribbon.triangles = ball.triangles;
  return ribbon;
}

// A ball with a furrow around its equator, whose floor rises and falls, and faint dents everywhere else.
constexpr double radius = 20e3;
double furrowed(const Place& way) {
  const double around = std::atan2(way.y(), way.x());
  const double furrow = std::exp(-std::pow(way.z() / .12, 2)) * (4e3 + 300. * std::cos(3. * around));
  return radius - furrow + 30. * std::sin(9. * way.x()) * std::sin(8. * way.y()) * std::sin(7. * way.z());
}
constexpr SulcusOptions small{.scale = 4e3, .persistence = 800., .shallowest = .5, .shortest_spur = 4e3};

double length_of(const std::vector<Line>& lines) {
  double sum = 0.;
  for (const Line& line : lines) sum += line.length();
  return sum;
}

TEST(Sulci, AFurrowIsDeepAndWhatLiesBesideItIsNot) {
  const Ribbon ribbon = ribbon_of(furrowed);
  const auto depth = sulcal_depth(ribbon, small.scale);
  double floor = 1e9, rest = -1e9;
  for (std::size_t v = 0; v < ribbon.size(); ++v) {
    const double z = std::abs(ribbon.middle[v].normalized().z());
    if (z < .02) floor = std::min(floor, depth[v]);
    if (z > .4) rest = std::max(rest, depth[v]);
  }
  EXPECT_GT(floor, rest + 1000.);
}

TEST(Sulci, TheGraphRunsOnceAroundTheFloorOfAFurrowAndNowhereElse) {
  const auto lines = sulci(ribbon_of(furrowed), small);
  ASSERT_FALSE(lines.empty());
  for (const Line& line : lines) {
    EXPECT_EQ(line.kind, Line::Kind::sulcus);
    EXPECT_EQ(line.triangles.size() + 1, line.points.size());
    for (const Place& p : line.points) EXPECT_LT(std::abs(p.z()), 600.) << p.transpose();
  }
  const double around = 2. * std::numbers::pi * (radius - 4e3);
  EXPECT_GT(length_of(lines), .95 * around);
  EXPECT_LT(length_of(lines), 1.15 * around);
}

TEST(Sulci, LinesDoNotTurnWithTheTriangles) {
  const Ribbon ribbon = ribbon_of(furrowed);
  SulcusOptions rough = small;
  rough.smooth = 0.;
  const auto beside = [](const std::vector<Line>& lines) {  // rms, of the circle that is the floor
    double sum = 0., points = 0.;
    for (const Line& line : lines)
      for (const Place& p : line.points) sum += p.z() * p.z(), ++points;
    return std::sqrt(sum / points);
  };
  const auto lines = sulci(ribbon, small), zigzag = sulci(ribbon, rough);
  EXPECT_LT(length_of(lines), length_of(zigzag));
  EXPECT_LT(beside(lines), .8 * beside(zigzag));
}

TEST(Sulci, TheWallHasNone) {
  Ribbon ribbon = ribbon_of(furrowed);
  const double whole = length_of(sulci(ribbon, small));
  for (std::size_t v = 0; v < ribbon.size(); ++v) ribbon.wall[v] = ribbon.middle[v].x() < 0.;
  const auto lines = sulci(ribbon, small);
  for (const Line& line : lines)
    for (const Place& p : line.points) EXPECT_GT(p.x(), -300.);
  EXPECT_GT(length_of(lines), .3 * whole);
  EXPECT_LT(length_of(lines), .55 * whole);
}

TEST(Sulci, ABallThatIsOnlyRoughHasNone) {
  Random random(5);
  const Ribbon rough = ribbon_of([&](const Place&) { return radius + 20. * random.normal(); });
  EXPECT_TRUE(sulci(rough, small).empty());
}

TEST(Sulci, ASpurIsLeftOutAndALongArmStays) {
  // An arm of the furrow towards the pole, as far as the latitude whose sine is `end`.
  const auto with_arm = [](double end) {
    return ribbon_of([end](const Place& way) {
      const double across = way.x() > 0. ? way.y() : 1., beyond = std::max({0., -way.z(), way.z() - end});
      return furrowed(way) - 3e3 * std::exp(-std::pow(across / .12, 2) - std::pow(beyond / .12, 2));
    });
  };
  const auto northernmost = [](const std::vector<Line>& lines) {
    double z = 0.;
    for (const Line& line : lines)
      for (const Place& p : line.points) z = std::max(z, p.z());
    return z;
  };
  EXPECT_GT(northernmost(sulci(with_arm(.6), small)), 7e3);
  SulcusOptions coarse = small;
  coarse.shortest_spur = 30e3;
  EXPECT_LT(northernmost(sulci(with_arm(.6), coarse)), 3e3);
}

TEST(Sulci, AreTheSameAtAnyNumberOfThreads) {
  const Ribbon ribbon = ribbon_of(furrowed);
  const auto lines = sulci(ribbon, small);
  const ThreadLimit one(1);
  const auto again = sulci(ribbon, small);
  ASSERT_EQ(again.size(), lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(again[i].points, lines[i].points);
}

TEST(ShareNear, IsTheAreaOfACap) {
  const Mesh ball = icosphere(Vec3::Zero(), 10e3f, 5, 0);
  Mesh pole;
  pole.positions.push_back(Vec3(0, 0, 10e3f)), pole.triangles.push_back({0, 0, 0});
  const TriangleTree place(pole);
  std::vector<std::uint8_t> left_out(ball.positions.size(), 0);
  for (const double within :
       {1e3, 2e3, 8e3})  // of a ball's area the part that a chord reaches is its square over 4 r²
    EXPECT_NEAR(share_near(ball, left_out, place, within), within * within / 4e8,
                .03 * within * within / 4e8);
  for (std::size_t v = 0; v < left_out.size(); ++v) left_out[v] = ball.positions[v].z() < 0.f;
  EXPECT_NEAR(share_near(ball, left_out, place, 2e3), 2. * 4e6 / 4e8, .04 * 2. * 4e6 / 4e8);
  EXPECT_EQ(share_near(ball, left_out, TriangleTree(Mesh{}), 2e3), 0.);
}

}  // namespace
}  // namespace forest::cortex
