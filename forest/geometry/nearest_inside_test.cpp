// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/nearest_inside.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest {
namespace {

Eigen::Vector3d place(const ScalarGrid& grid, std::size_t i) {
  const std::size_t x = i % grid.size[0], y = i / grid.size[0] % grid.size[1],
                    z = i / grid.size[0] / grid.size[1];
  return grid.step.cwiseProduct(Eigen::Vector3d(double(x), double(y), double(z)));
}

// Points inside at random, so many of a thousand.
ScalarGrid scattered(std::uint64_t seed, double thousandths) {
  ScalarGrid grid{.size = {17, 11, 9}, .step = {1., 2.5, .7}, .values = {}};
  Random random(seed, 0);
  for (std::size_t i = 0; i < grid.count(); ++i)
    grid.values.push_back(random.uniform() < thousandths / 1000. ? -1.f : 1.f);
  return grid;
}

TEST(NearestInside, IsWhatAPlainSearchFinds) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u})
    for (const double thousandths : {1., 10., 200., 1000.}) {
      const ScalarGrid grid = scattered(seed, thousandths);
      const std::vector<std::uint32_t> found = nearest_inside(grid);
      for (std::size_t i = 0; i < grid.count(); ++i) {
        double least = HUGE_VAL;
        for (std::size_t j = 0; j < grid.count(); ++j)
          if (grid.values[j] < 0.f) least = std::min(least, (place(grid, i) - place(grid, j)).norm());
        if (least == HUGE_VAL) {
          ASSERT_EQ(found[i], no_point);
        } else {
          ASSERT_LT(grid.values[found[i]], 0.f);
          ASSERT_NEAR((place(grid, i) - place(grid, found[i])).norm(), least, 1e-9);
        }
      }
    }
}

TEST(NearestInside, IsTheSameAtAnyNumberOfThreads) {
  const ScalarGrid grid = scattered(7, 5.);
  const auto with = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return nearest_inside(grid);
  };
  EXPECT_EQ(with(1), with(2));
}

}  // namespace
}  // namespace forest
