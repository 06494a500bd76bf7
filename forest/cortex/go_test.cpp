// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/go.h"

#include <gtest/gtest.h>

#include "forest/cortex/slab_test.h"

namespace forest::cortex {
namespace {

constexpr int side = 6;

struct Going : ::testing::Test {
  Elements slab = make_slab(side, [](const Place& p) { return p; });
  const std::vector<Depths> start = slab.curves;
  // All moves by `way`, but not the corner in the middle of the slab, which moves by `other`.
  std::vector<Depths> moved(const Place& way, const Place& other) const {
    std::vector<Depths> aim = start;
    for (std::uint32_t c = 0; c < aim.size(); ++c)
      for (Place& p : aim[c]) p += c == slab_corner(side, 3, 3) ? other : way;
    return aim;
  }
};

TEST_F(Going, GoesAllTheWayWhereNothingIsLost) {
  const auto aim = moved(Place(100., 50., 20.), Place(100., 50., 20.));
  go(slab, aim, to_keep(slab, .5));
  EXPECT_EQ(slab.curves, aim);
}

TEST_F(Going, WhatWouldFoldGoesAPartOfTheWayAndTheRestAllOfIt) {
  const Place way(0., 0., 50.);
  const auto aim = moved(way, Place(700., 0., 50.));
  const auto keep = to_keep(slab, .5);
  go(slab, aim, keep);
  EXPECT_TRUE(uncertified(slab).empty());
  for (std::size_t e = 0; e < slab.size(); ++e) EXPECT_GE(scaled_jacobian(slab.hexahedron(e)), keep[e]);
  const std::uint32_t middle = slab_corner(side, 3, 3), far = slab_corner(side, 0, 0);
  EXPECT_EQ(slab.curves[far], aim[far]);
  EXPECT_NE(slab.curves[middle], aim[middle]);
}

TEST_F(Going, WhatIsNotValidHoldsNothingBack) {
  for (Place& p : slab.curves[slab_corner(side, 3, 3)]) p += Place(700., 0., 0.);
  ASSERT_FALSE(uncertified(slab).empty());
  const auto keep = to_keep(slab, .5);
  for (const std::uint32_t e : uncertified(slab)) EXPECT_EQ(keep[e], -1.);
  go(slab, start, keep);
  EXPECT_TRUE(uncertified(slab).empty());
}

}  // namespace
}  // namespace forest::cortex
