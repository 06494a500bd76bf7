// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/minimise.h"

#include <gtest/gtest.h>

namespace forest::cortex {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(Minimise, FindsTheBottomOfACurvedValley) {  // Rosenbrock's
  Vector x(2);
  x << -1.2, 1.;
  const double value = minimise(x, 200, 1e-9, [](const Vector& at, Vector& slope) {
    const double off = at[1] - at[0] * at[0];
    slope.resize(2);
    slope << -400. * at[0] * off - 2. * (1. - at[0]), 200. * off;
    return 100. * off * off + (1. - at[0]) * (1. - at[0]);
  });
  EXPECT_NEAR(x[0], 1., 1e-4);
  EXPECT_NEAR(x[1], 1., 1e-4);
  EXPECT_LT(value, 1e-8);
}

// Down to a wall: no step before it flattens the slope, and one behind it would be followed out of all bounds.
TEST(Minimise, StaysBeforeAWall) {
  for (const double wall : {.3, 1., 7.7}) {
    Vector x = Vector::Zero(1);
    const double value = minimise(x, 50, .01, [&](const Vector& at, Vector& slope) {
      slope = Vector::Constant(1, -1.);
      return at[0] > wall ? infinite : -at[0];
    });
    EXPECT_LE(x[0], wall);
    EXPECT_GT(x[0], .9 * wall);
    EXPECT_EQ(value, -x[0]);
  }
}

TEST(Minimise, StaysWhereItBeginsBehindTheWall) {
  Vector x = Vector::Constant(1, 2.);
  EXPECT_EQ(minimise(x, 50, .01,
                     [](const Vector&, Vector& slope) {
                       slope = Vector::Constant(1, -1.);
                       return infinite;
                     }),
            infinite);
  EXPECT_EQ(x[0], 2.);
}

}  // namespace
}  // namespace forest::cortex
