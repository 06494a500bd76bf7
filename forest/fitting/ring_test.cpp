// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/ring.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::fitting {
namespace {

using Points = std::vector<std::vector<double>>;

Points random_points(std::size_t count, std::size_t dimensions) {
  Random random(11, count);
  Points points(count, std::vector<double>(dimensions));
  for (auto& point : points)
    for (double& x : point) x = random.normal();
  return points;
}

double length(const Points& points, const std::vector<std::size_t>& order) {
  double sum = 0.;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto &a = points[order[i]], &b = points[order[(i + 1) % order.size()]];
    double squares = 0.;
    for (std::size_t c = 0; c < a.size(); ++c) squares += (a[c] - b[c]) * (a[c] - b[c]);
    sum += std::sqrt(squares);
  }
  return sum;
}

std::vector<std::size_t> as_they_came(std::size_t count) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  return order;
}

TEST(Ring, EachPointOnce) {
  for (const std::size_t count : {0u, 1u, 2u, 3u, 4u, 50u, 1500u}) {
    std::vector<std::size_t> order = tour(random_points(count, 5));
    std::ranges::sort(order);
    EXPECT_EQ(order, as_they_came(count));
  }
  const Points same(9, std::vector<double>(3, 1.));
  std::vector<std::size_t> order = tour(same);
  std::ranges::sort(order);
  EXPECT_EQ(order, as_they_came(9));
}

// Of points on a circle, in any order, the shortest tour goes around it.
TEST(Ring, GoesAroundACircle) {
  constexpr std::size_t count = 60;
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2. * std::numbers::pi * double(i * 37 % count) / count;
    points.push_back({std::cos(angle), std::sin(angle)});
  }
  EXPECT_NEAR(length(points, tour(points)), 2. * count * std::sin(std::numbers::pi / count), 1e-9);
}

TEST(Ring, IsMuchShorterThanTheOrderInWhichTheyCame) {
  const Points points = random_points(200, 2);
  EXPECT_LT(length(points, tour(points)), .2 * length(points, as_they_came(200)));
  const Points many = random_points(200, 20);
  EXPECT_LT(length(many, tour(many)), .8 * length(many, as_they_came(200)));
}

// No two of its steps are better exchanged.
TEST(Ring, HasNoCrossings) {
  const Points points = random_points(40, 2);
  const std::vector<std::size_t> order = tour(points);
  const double least = length(points, order);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      std::vector<std::size_t> other = order;
      std::reverse(other.begin() + std::ptrdiff_t(i), other.begin() + std::ptrdiff_t(j) + 1);
      EXPECT_GE(length(points, other), least - 1e-6);
    }
}

}  // namespace
}  // namespace forest::fitting
