// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/angles.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

TEST(Angles, AreThoseOfTheStandardLibrary) {
  Random random(1);
  std::vector<double> y{0., 0., 1., 1., 1., 1., 1e-300, 1e100, 0.},
      x{1., -1., 0., 1., -1., 1e-17, 1e300, 1., 0.};
  for (int i = 0; i < 100'000; ++i) {
    y.push_back(std::exp(random.uniform(-20., 20.))), x.push_back(random.normal(0., 3.));
  }
  std::vector<double> angles(x.size());
  angles_of(x.size(), y.data(), x.data(), angles.data());
  EXPECT_TRUE(std::isnan(angles[8]));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double expected = std::atan2(y[i], x[i]) * 180. / std::numbers::pi;
    if (i != 8) {
      EXPECT_NEAR(angles[i], expected, 5e-16 * expected) << y[i] << " " << x[i];
    }
  }
  angles_of(x.size(), y.data(), x.data(), y.data());
  for (std::size_t i = 0; i < x.size(); ++i)
    if (i != 8) {
      EXPECT_EQ(y[i], angles[i]);
    }
}

}  // namespace
}  // namespace forest::statistics
