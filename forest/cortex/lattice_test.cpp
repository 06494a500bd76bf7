// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/lattice.h"

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::cortex {
namespace {

// Sites on a plane in a net of squares with one diagonal each, numbered in no order.
Level net(std::uint32_t side) {
  const std::uint32_t n = side * side;
  std::vector<std::uint32_t> number(n);
  for (std::uint32_t i = 0; i < n; ++i) number[i] = i;
  Random random(1, 2, 3);
  for (std::uint32_t i = n; i-- > 1;) std::swap(number[i], number[random.below(i + 1)]);
  std::vector<Triangle> triangles;
  for (std::uint32_t j = 0; j + 1 < side; ++j)
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const auto at = [&](std::uint32_t x, std::uint32_t y) { return number[x + side * y]; };
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  const Neighbours near = neighbours(n, triangles);
  Level level;
  level.starts = near.starts, level.list = near.list, level.weights.assign(near.list.size(), 1.f);
  level.sites.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Place at(300. * (i % side), 300. * (i / side), 10. * random.normal());
    level.sites[number[i]] = {.at = at,
                              .normal = Place::UnitZ(),
                              .along = Place(1., .2 * random.normal(), 0.).normalized(),
                              .spacing = 0.,
                              .area = 9e4,
                              .point = at,
                              .line = {}};
  }
  return level;
}

TEST(Lattice, WavesKeepNeighboursInTheirOrder) {
  const Level level = net(20);
  const Waves made = waves(level);
  std::vector<std::uint32_t> wave(level.sites.size(), ~0u);
  for (std::uint32_t k = 0; k + 1 < made.starts.size(); ++k)
    for (std::uint32_t n = made.starts[k]; n < made.starts[k + 1]; ++n) wave[made.sites[n]] = k;
  EXPECT_EQ(made.starts.back(), level.sites.size());
  for (std::uint32_t i = 0; i < wave.size(); ++i) {
    ASSERT_NE(wave[i], ~0u) << i;
    for (std::uint32_t e = level.starts[i]; e < level.starts[i + 1]; ++e) {
      EXPECT_EQ(wave[level.list[e]] < wave[i], level.list[e] < i);
    }
  }
  EXPECT_LT(made.starts.size(), level.sites.size() / 10);
}

TEST(Lattice, IsTheSameAtAnyNumberOfThreadsAndWhateverWasSettledBefore) {
  const std::size_t n = net(40).sites.size();
  const std::vector<double> narrow(n, 900.), wide(n, 1300.);
  Lattice lattice(net(40));
  const std::vector<LatticeSite> first = lattice.settle(wide).sites;
  (void)lattice.settle(narrow);
  const std::vector<LatticeSite> again = lattice.settle(wide).sites;
  const ThreadLimit one(1);
  const std::vector<LatticeSite> alone = Lattice(net(40)).settle(wide).sites;
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(first[i].point, again[i].point);
    EXPECT_EQ(first[i].point, alone[i].point);
    EXPECT_EQ(first[i].spacing, 1300.);
  }
}

}  // namespace
}  // namespace forest::cortex
