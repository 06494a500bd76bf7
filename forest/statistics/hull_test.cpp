// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/hull.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

using Vector = Eigen::Vector3d;
using Points = std::vector<Vector>;

Points cloud(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  Points points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(float(random.normal(0., 3.)), float(random.normal()), float(random.normal(0., 20.)));
  return points;
}

/// Every triangle that has all points on one side, the definition of a face.
double plain_volume(const Points& points) {
  double volume = 0.;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = j + 1; k < n; ++k) {
        const Vector normal = (points[j] - points[i]).cross(points[k] - points[i]);
        int sides = 0;
        for (std::size_t l = 0; l < n; ++l)
          if (l != i && l != j && l != k) sides |= normal.dot(points[l] - points[i]) > 0. ? 1 : 2;
        if (sides != 3) volume += std::abs((points[i] - points[0]).dot(normal)) / 6.;
      }
  return volume;
}

TEST(Hull, HasTheVolumeOfItsFaces) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Points points = cloud(seed, 4 + seed);
    EXPECT_NEAR(convex_hull(points).volume, plain_volume(points), 1e-9 * plain_volume(points)) << seed;
  }
}

TEST(Hull, OfItsCornersIsTheSame) {
  const Points points = cloud(5, 20'000);
  const Hull hull = convex_hull(points);
  EXPECT_LT(hull.vertices.size(), 400u);
  Points corners;
  for (const auto i : hull.vertices) corners.push_back(points[i]);
  EXPECT_NEAR(convex_hull(corners).volume, hull.volume, 1e-9 * hull.volume);
}

TEST(Hull, OfABallIsAlmostItsVolume) {
  Random random(3);
  Points points;
  for (int i = 0; i < 20'000; ++i)
    points.push_back(Vector(random.normal(), random.normal(), random.normal()).normalized());
  const Hull hull = convex_hull(points);
  EXPECT_EQ(hull.vertices.size(), points.size());
  EXPECT_NEAR(hull.volume, 4. / 3. * std::numbers::pi, 5e-3);
}

// Where most points lie in the planes of faces.
TEST(Hull, OfAGridIsItsBox) {
  for (const double scale : {1., 1e-20, 1e30, 0.1f / 3.}) {
    Points points;
    for (int i = 0; i < 4000; ++i)
      points.emplace_back(scale * (i % 10) + 7. * scale, scale * (i / 10 % 20), scale * (i / 200));
    EXPECT_NEAR(convex_hull(points).volume / std::pow(scale, 3.), 9. * 19. * 19., 1e-6) << scale;
  }
}

TEST(Hull, OfAPlaneLineOrPointHasNoVolume) {
  Random random(4);
  Points plane, line;
  for (int i = 0; i < 500; ++i) {
    plane.emplace_back(random.uniform(), 3., random.uniform());
    line.emplace_back(1. * i, 2. * i, 3. * i);
  }
  for (const Points& points : {plane, line, Points(10, Vector(1, 2, 3)), Points{Vector(1, 2, 3)}, Points{}}) {
    const Hull hull = convex_hull(points);
    EXPECT_EQ(hull.volume, 0.);
    EXPECT_EQ(hull.vertices.size(), points.size());
  }
}

TEST(PlanarHull, OfASquareWithPointsInAndOnIt) {
  Random random(6);
  std::vector<Eigen::Vector2d> points{{0, 0}, {2, 0}, {2, 2}, {0, 2}, {1, 0}, {2, 1}, {0, 0}};
  for (int i = 0; i < 100; ++i) points.emplace_back(random.uniform(0., 2.), random.uniform(0., 2.));
  const PlanarHull hull = planar_hull(points);
  EXPECT_DOUBLE_EQ(hull.area, 4.);
  EXPECT_DOUBLE_EQ(hull.perimeter, 8.);
  EXPECT_DOUBLE_EQ(hull.diameter, std::sqrt(8.));
}

TEST(PlanarHull, HasTheGreatestDistanceOfAnyTwoPoints) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    std::vector<Eigen::Vector2d> points;
    for (const Vector& p : cloud(seed, 1 + 3 * seed)) points.emplace_back(p.head<2>());
    double greatest = 0.;
    for (const auto& p : points)
      for (const auto& q : points) greatest = std::max(greatest, (p - q).norm());
    EXPECT_DOUBLE_EQ(planar_hull(points).diameter, greatest) << seed;
  }
}

}  // namespace
}  // namespace forest::statistics
