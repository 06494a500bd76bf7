// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/bands.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

/// Cells whose curve rises and falls, each of its own height and width.
std::vector<Curve> cells(std::uint64_t seed, std::size_t count, double taller = 1.) {
  std::vector<Curve> curves;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    const double height = taller * random.truncated_normal(10., 3., 2., 20.),
                 width = random.truncated_normal(20., 4., 8., 30.);
    Curve curve;
    for (double r = 0.; r < width; ++r)
      curve.push_back(std::max(0., height * 4. * r * (width - r) / (width * width)));
    curves.push_back(curve);
  }
  return curves;
}

TEST(MeanCurve, TakesWhatIsBehindAnEndForNothing) {
  EXPECT_EQ(mean_curve(std::vector<Curve>{{2, 4}, {0, 2, 6}}), (Curve{1, 3, 3}));
  EXPECT_TRUE(mean_curve({}).empty());
}

TEST(Band, HoldsAnotherSampleInNineteenOfTwentyCases) {
  int held = 0;
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const auto known = cells(1000 + trial, 25), more = cells(5000 + trial, 25),
               next = cells(9000 + trial, 25);
    held += share_inside(mean_curve(next), band_of(known, more, next.size(), 200, trial)) >= .95;
  }
  EXPECT_GT(held, 250);  // of 300; the bootstrap is a little narrow at 25 cells
}

TEST(Band, DoesNotHoldWhatIsTaller) {
  const auto known = cells(1, 25), more = cells(2, 25), taller = cells(3, 25, 1.6);
  EXPECT_LT(share_inside(mean_curve(taller), band_of(known, more, 25, 400, 1)), .8);
}

TEST(Band, OfNothingHoldsNothing) {
  const Band none = band_of({}, {}, 5, 100, 1);
  EXPECT_EQ(share_inside({}, none), 1.);
  EXPECT_EQ(share_inside({0, 3}, none), 0.);
}

}  // namespace
}  // namespace forest::statistics
