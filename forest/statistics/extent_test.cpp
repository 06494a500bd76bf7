// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/extent.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

using Points = std::vector<Point>;

/// Every pair of segments that may bound it.
double plain_extent(double part, const Arbors& a, const std::vector<double>& coordinate) {
  std::vector<std::pair<double, double>> ends;
  double total = 0.;
  for (std::size_t i = 0; i < coordinate.size(); ++i)
    if (const double length = a.columns().length[i]; length > 0.)
      ends.emplace_back(coordinate[i], length), total += length;
  std::ranges::sort(ends);
  double best = 1e300;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    double held = 0.;
    for (std::size_t k = i; k < ends.size(); ++k)
      if ((held += ends[k].second) >= part * total * (1. - 1e-12)) {
        best = std::min(best, ends[k].first - ends[i].first);
        break;
      }
  }
  return best;
}

TEST(Extent, IsTheLeastThatHoldsAPartOfTheLength) {
  for (std::uint64_t seed = 1; seed < 12; ++seed) {
    const Arbors a(zoo_parts::random_tree(seed, 20 * seed));
    for (const double part : {0.3, 0.95, 0.999})
      EXPECT_DOUBLE_EQ(extent_holding(part, a, a.columns().y), plain_extent(part, a, a.columns().y))
          << seed << " " << part;
  }
}

TEST(Extent, OfNothingIsNone) {
  const Arbors nothing{Morphology()};
  EXPECT_TRUE(std::isnan(extent_holding(0.95, nothing, nothing.columns().x)));
  EXPECT_TRUE(std::isnan(box_dimension(nothing)));
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, Points{{1, 2, 3, 1}});
  const Arbors point(b.build());
  EXPECT_TRUE(std::isnan(extent_holding(0.95, point, point.columns().x)));
  EXPECT_TRUE(std::isnan(box_dimension(point)));
}

/// One segment after the other; a row of `sections` has no common points.
Arbors strokes(const std::vector<Points>& sections) {
  MorphologyBuilder b;
  for (const Points& points : sections) b.add_section({}, SectionKind::axon, points);
  return Arbors(b.build());
}

TEST(BoxDimension, OfALineIsOneAndOfAFilledSquareTwo) {
  EXPECT_NEAR(box_dimension(strokes({{{3, 4, 5, 1}, {103, 4, 5, 1}}})), 1., 1e-12);
  std::vector<Points> hatching;
  for (int i = 0; i < 128; ++i)
    hatching.push_back({{0, (float(i) + .5f) / 1.28f, 7, 1}, {100, (float(i) + .5f) / 1.28f, 7, 1}});
  EXPECT_NEAR(box_dimension(strokes(hatching)), 2., 1e-12);
}

TEST(BoxDimension, CountsTheBoxesThatSmallStepsFind) {
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    const Arbors a(zoo_parts::random_tree(seed, 60));
    const Columns& c = a.columns();
    const auto range = [](const std::vector<double>& v) { return std::ranges::minmax(v); };
    const double low[] = {range(c.x).min, range(c.y).min, range(c.z).min};
    const double extent =
        std::max({range(c.x).max - low[0], range(c.y).max - low[1], range(c.z).max - low[2]});
    std::vector<double> x, y;
    for (int side = 2; side <= 64; side *= 2) {
      std::set<std::array<int, 3>> boxes;
      for (const Branch& b : a.sections())
        for (std::size_t i = b.first_row + 1; i <= b.last_row(); ++i)
          for (double t = 0.; t <= 1.; t += 1. / 1024.) {
            const double p[] = {std::lerp(c.x[i - 1], c.x[i], t), std::lerp(c.y[i - 1], c.y[i], t),
                                std::lerp(c.z[i - 1], c.z[i], t)};
            std::array<int, 3> box{};
            for (std::size_t k = 0; k < 3; ++k)
              box[k] = std::min(side - 1, int((p[k] - low[k]) / extent * side));
            boxes.insert(box);
          }
      x.push_back(std::log(side)), y.push_back(std::log(double(boxes.size())));
    }
    double mx = 0., my = 0., xy = 0., xx = 0.;
    for (std::size_t i = 0; i < x.size(); ++i) mx += x[i] / 6., my += y[i] / 6.;
    for (std::size_t i = 0; i < x.size(); ++i)
      xy += (x[i] - mx) * (y[i] - my), xx += (x[i] - mx) * (x[i] - mx);
    EXPECT_NEAR(box_dimension(a), xy / xx, 2e-3) << seed;  // a corner cut by less than a step may be missed
  }
}

}  // namespace
}  // namespace forest::statistics
