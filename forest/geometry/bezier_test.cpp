// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/bezier.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace forest {
namespace {

std::vector<Place> circle(double radius, int corners) {
  std::vector<Place> polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2. * std::numbers::pi * i / corners;
    polygon.push_back(radius * Place(std::cos(angle), std::sin(angle)));
  }
  return polygon;
}

// A rounded star: what bends both ways.
std::vector<Place> star(double radius, double depth, int corners) {
  std::vector<Place> polygon;
  for (const Place& p : circle(1., corners))
    polygon.push_back(radius * (1. + depth * std::cos(5. * std::atan2(p.y(), p.x()))) * p);
  return polygon;
}

const std::vector<Place> square{{0., 0.}, {4000., 0.}, {4000., 4000.}, {0., 4000.}};

double distance(const Place& point, const std::vector<Place>& polygon) {
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Place a = polygon[i], along = polygon[(i + 1) % polygon.size()] - a;
    const double share = std::clamp((point - a).dot(along) / along.squaredNorm(), 0., 1.);
    least = std::min(least, (point - a - share * along).norm());
  }
  return least;
}

TEST(BezierLoop, OfStraightPiecesHasLengthAndAreaOfItsPolygon) {
  const BezierLoop loop = straight_loop(square);
  EXPECT_EQ(loop.pieces(), 4u);
  EXPECT_NEAR(length(loop), 16000., 1e-9);
  EXPECT_NEAR(area(loop), 16e6, 1e-3);
  EXPECT_EQ(flattened(loop, 1.), square);
  std::vector<Place> clockwise(square.rbegin(), square.rend());
  EXPECT_NEAR(area(straight_loop(clockwise)), -16e6, 1e-3);
}

TEST(BezierLoop, HasTheAreaThatItsFlattenedPolygonComesTo) {
  const Fit fit = fit_loop(star(5000., .4, 400), {.tolerance = 50.});
  EXPECT_NEAR(area(straight_loop(flattened(fit.curve, .001))) / area(fit.curve), 1., 1e-6);
}

TEST(BezierLoop, IsResampledAtEqualDistances) {
  for (const BezierLoop& loop : {straight_loop(square), fit_loop(star(5000., .4, 400)).curve}) {
    const auto dense = flattened(loop, .01);
    for (const std::size_t count : {7u, 64u}) {
      const auto places = resampled(loop, count);
      ASSERT_EQ(places.size(), count);
      EXPECT_EQ(places[0], loop.points[0]);
      // Along the curve each is one step behind the one before it.
      double along = 0.;
      std::size_t next = 1;
      const double step = length(loop) / double(count);
      for (std::size_t i = 0; i < dense.size() && next < count; ++i) {
        const Place a = dense[i], b = dense[(i + 1) % dense.size()];
        const double edge = (b - a).norm();
        while (next < count && along + edge >= step * double(next)) {
          const Place wanted = a + (step * double(next) - along) / edge * (b - a);
          EXPECT_LT((places[next] - wanted).norm(), 2.) << next;
          ++next;
        }
        along += edge;
      }
    }
  }
}

TEST(Fit, LiesWithinTheToleranceAndSaysHowFarItIsOff) {
  for (const double tolerance : {5., 20., 80.})
    for (const auto& polygon : {circle(3000., 200), star(5000., .4, 400), star(800., .2, 60), square}) {
      const Fit fit = fit_loop(polygon, {.tolerance = tolerance});
      EXPECT_LE(fit.rms, tolerance);
      // Measured by the polygon of the curve, which knows nothing of the fit.
      const auto curve = flattened(fit.curve, .05);
      double sum = 0., greatest = 0., weights = 0.;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Place a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        for (int k = 0; k < 10; ++k) {
          const double off = distance(a + (k + .5) / 10. * (b - a), curve);
          sum += off * off * (b - a).norm(), weights += (b - a).norm();
          greatest = std::max(greatest, off);
        }
      }
      EXPECT_NEAR(std::sqrt(sum / weights), fit.rms, .15 * tolerance);
      EXPECT_LE(greatest, fit.greatest + tolerance);
    }
}

TEST(Fit, NeedsFourPiecesForACircleAndFewForAStar) {
  EXPECT_LE(fit_loop(circle(3000., 300), {.tolerance = 5.}).curve.pieces(), 4u);
  EXPECT_LE(fit_loop(star(5000., .4, 400), {.tolerance = 20.}).curve.pieces(), 20u);
}

TEST(Fit, NeedsMorePiecesForLessTolerance) {
  const auto polygon = star(5000., .4, 400);
  EXPECT_GT(fit_loop(polygon, {.tolerance = 2.}).curve.pieces(),
            fit_loop(polygon, {.tolerance = 100.}).curve.pieces());
}

TEST(Fit, LiesCloserWhereItIsAskedTo) {
  const auto polygon = star(5000., .4, 400);
  const Place there = polygon[50];
  const auto apart = [&](const Fit& fit) {  // how far it is off, there and elsewhere
    const auto curve = flattened(fit.curve, .05);
    std::array<double, 2> sums{}, counts{};
    for (const Place& p : polygon) {
      const std::size_t elsewhere = (p - there).norm() < 500. ? 0 : 1;
      const double off = distance(p, curve);
      sums[elsewhere] += off * off, ++counts[elsewhere];
    }
    return std::array{std::sqrt(sums[0] / counts[0]), std::sqrt(sums[1] / counts[1])};
  };
  const Emphasis closer[] = {{there, 500., 400.}};
  const Fit evenly = fit_loop(polygon, {.tolerance = 40.}),
            with = fit_loop(polygon, {.tolerance = 40., .closer = closer});
  EXPECT_LT(apart(with)[0], .25 * apart(evenly)[0]);
  EXPECT_LT(with.rms, 40.);
  EXPECT_GT(apart(with)[1], .5 * apart(evenly)[1]);
  EXPECT_LE(with.curve.pieces(), evenly.curve.pieces() + 4);
}

TEST(Fit, NeverTurnsBackOnAStraightWay) {
  // Long edges that turn by chance: a curve that runs to and fro on one lies on it, and is longer.
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0., 1.);
    std::vector<Place> polygon;
    for (int i = 0; i < 400; ++i) {
      const double angle = 2. * std::numbers::pi * (i + .9 * share(random)) / 400.;
      polygon.push_back((40000. + 300. * share(random)) * Place(std::cos(angle), std::sin(angle)));
    }
    const Fit fit = fit_loop(polygon);
    EXPECT_LE(fit.rms, 20.) << seed;
    EXPECT_LT(length(fit.curve), 1.03 * length(straight_loop(polygon))) << seed;
  }
}

TEST(Fit, KeepsCornersAndMakesNoneOnACircle) {
  const Fit fit = fit_loop(square, {.tolerance = 5.});
  EXPECT_EQ(fit.corners, 4u);
  for (const Place& corner : square) {
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < fit.curve.pieces(); ++i)
      least = std::min(least, (fit.curve.points[3 * i] - corner).norm());
    EXPECT_LT(least, 5.);
  }
  EXPECT_EQ(fit_loop(circle(3000., 300)).corners, 0u);
}

TEST(Fit, IsSmoothWhereNoCornerIs) {
  const Fit fit = fit_loop(star(5000., .2, 400));
  ASSERT_EQ(fit.corners, 0u);
  for (std::size_t i = 0; i < fit.curve.pieces(); ++i) {
    const Place in = fit.curve.piece(i).derivative(1.),
                out = fit.curve.piece((i + 1) % fit.curve.pieces()).derivative(0.);
    EXPECT_GT(in.normalized().dot(out.normalized()), 1. - 1e-9);
  }
}

TEST(Fit, MovesAndTurnsWithThePolygon) {
  auto polygon = star(5000., .4, 400);
  const Fit before = fit_loop(polygon);
  const Eigen::Rotation2Dd turn(.7);
  for (Place& p : polygon) p = turn * p + Place(1e5, -2e4);
  const Fit after = fit_loop(polygon);
  ASSERT_EQ(before.curve.pieces(), after.curve.pieces());
  EXPECT_NEAR(before.rms, after.rms, .05);
}

TEST(Fit, TakesTheSmallestPolygonsAndRepeatedPoints) {
  for (const std::vector<Place>& polygon : {std::vector<Place>{{0., 0.}, {1., 0.}, {0., 1.}},
                                            std::vector<Place>{{0., 0.}, {0., 0.}, {1., 0.}, {0., 1.}},
                                            std::vector<Place>{{0., 0.}, {9000., 0.}, {9000., 1e-3}}}) {
    const Fit fit = fit_loop(polygon);
    EXPECT_GE(fit.curve.pieces(), 1u);
    EXPECT_LE(fit.rms, 20.);
    for (const Place& p : fit.curve.points) EXPECT_TRUE(p.allFinite());
  }
}

}  // namespace
}  // namespace forest
