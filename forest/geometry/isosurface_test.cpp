// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/isosurface.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/geometry/self_intersection.h"

#include "tests/refused.h"

namespace forest {
namespace {

using Point = Eigen::Vector3d;

ScalarGrid sampled(std::size_t n, const std::function<double(const Point&)>& f) {
  ScalarGrid grid{.size = {n, n, n},
                  .origin = Point::Constant(-2.),
                  .step = Point::Constant(4. / double(n - 1)),
                  .values = {}};
  for (std::size_t z = 0; z < n; ++z)
    for (std::size_t y = 0; y < n; ++y)
      for (std::size_t x = 0; x < n; ++x)
        grid.values.push_back(
            float(f(grid.origin + grid.step.cwiseProduct(Point(double(x), double(y), double(z))))));
  return grid;
}

double ball(const Point& p) { return p.norm() - 1.5; }
double torus(const Point& p) { return std::hypot(std::hypot(p.x(), p.y()) - 1.1, p.z()) - .5; }
double hollow(const Point& p) { return std::max(ball(p), .6 - p.norm()); }
double two(const Point& p) {
  return std::min((p - Point(1., 0., 0.)).norm() - .7, (p + Point(1., 0., 0.)).norm() - .6);
}
// Random bits within, nothing on the border: what has every topology there is.
ScalarGrid noise(std::uint32_t seed) {
  std::mt19937 random(seed);
  ScalarGrid grid{.size = {14, 15, 16}, .origin = Point::Zero(), .step = Point(1., 2., .5), .values = {}};
  grid.values.assign(grid.count(), 1.f);
  for (std::size_t z = 1; z < 15; ++z)
    for (std::size_t y = 1; y < 14; ++y)
      for (std::size_t x = 1; x < 13; ++x)
        grid.values[grid.index(x, y, z)] = float(random() % 2000) / 1000.f - 1.f;
  return grid;
}

TEST(Isosurface, OfADistanceIsTheSurface) {
  const Mesh mesh = isosurface(sampled(61, ball));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(count_pieces(mesh), 1u);
  EXPECT_EQ(euler_number(mesh), 2);
  EXPECT_NEAR(volume(mesh), 4. / 3. * M_PI * std::pow(1.5, 3), .03);
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(p.norm(), 1.5, 2e-3);
}

TEST(Isosurface, HasTheTopologyOfItsSolid) {
  EXPECT_EQ(euler_number(isosurface(sampled(41, torus))), 0);
  EXPECT_EQ(count_pieces(isosurface(sampled(41, hollow))), 2u);
  EXPECT_EQ(count_pieces(isosurface(sampled(41, two))), 2u);
}

TEST(Isosurface, OfAnyNumbersIsClosedAndNeverCutsItself) {
  for (std::uint32_t seed = 0; seed < 5; ++seed) {
    const Mesh mesh = isosurface(noise(seed));
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_GT(volume(mesh), 0.);
    EXPECT_FALSE(self_intersection(mesh).has_value());
  }
}

TEST(Isosurface, IsTheSameAtAnyNumberOfThreads) {
  const auto made = [](unsigned threads) {
    const ThreadLimit limit(threads);
    return isosurface(sampled(41, torus));
  };
  EXPECT_EQ(made(1).positions, made(2).positions);
  EXPECT_EQ(made(1).triangles, made(2).triangles);
}

TEST(GrowBall, LeavesABallAsItIs) {
  ScalarGrid grid = sampled(41, ball);
  const auto before = grid.values;
  std::vector<std::uint8_t> points;
  EXPECT_EQ(grow_ball(grid, points, .01f).cut, 0u);
  EXPECT_EQ(grid.values, before);
}

TEST(GrowBall, MakesASphereOfEverySolid) {
  for (const auto& solid : {torus, hollow, two}) {
    ScalarGrid grid = sampled(41, solid);
    const auto before = grid.values;
    std::vector<std::uint8_t> points;
    const BallChange change = grow_ball(grid, points, .01f);
    EXPECT_GT(change.cut, 0u);
    const Mesh mesh = isosurface(grid);
    EXPECT_EQ(euler_number(mesh), 2);
    EXPECT_EQ(count_pieces(mesh), 1u);
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LE(before[i], grid.values[i]);  // it only cuts
  }
}

TEST(GrowBall, CutsATorusByOneSheet) {
  ScalarGrid grid = sampled(41, torus);
  std::vector<std::uint8_t> points;
  const BallChange change = grow_ball(grid, points, .01f);
  // A cross-section has π·.5² / .1² points.
  EXPECT_LT(change.cut, 250u);
}

TEST(GrowBall, MakesASphereOfNoise) {
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    ScalarGrid grid = noise(seed);
    std::vector<std::uint8_t> points;
    grow_ball(grid, points, .01f);
    const Mesh mesh = isosurface(grid);
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_EQ(euler_number(mesh), 2) << seed;
    EXPECT_EQ(count_pieces(mesh), 1u) << seed;
  }
}

TEST(GrowBall, GrowsAroundWhatIsThere) {
  ScalarGrid inner = sampled(41, two), outer = sampled(41, hollow);
  std::vector<std::uint8_t> points;
  grow_ball(inner, points, .01f);
  const auto within = points;
  for (std::size_t i = 0; i < within.size(); ++i)
    if (within[i]) outer.values[i] = std::min(outer.values[i], -.01f);
  grow_ball(outer, points, .01f);
  for (std::size_t i = 0; i < within.size(); ++i) EXPECT_LE(within[i], points[i]);
  EXPECT_EQ(euler_number(isosurface(outer)), 2);
}

TEST(GrowBall, RefusesAGridWithoutInside) {
  ScalarGrid grid = sampled(11, [](const Point&) { return 1.; });
  std::vector<std::uint8_t> points;
  EXPECT_NE(refused([&] { grow_ball(grid, points, .01f); }).find("no inside"), std::string::npos);
}

}  // namespace
}  // namespace forest
