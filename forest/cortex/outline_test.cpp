// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/outline.h"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "forest/cortex/curved_elements.h"

namespace forest::cortex {
namespace {

// Two layers, the upper one a third of w.
Borders two_layers(std::uint32_t) {
  const std::vector<double> ends{1. / 3., 1.};
  return Borders({ends, ends, ends, ends});
}

class Outline : public testing::Test {
 protected:
  std::vector<std::vector<Vec3>> of(const std::vector<std::uint32_t>& chosen) const {
    return outline({elements_, junctions_}, chosen, two_layers);
  }
  const std::vector<Hexahedron> elements_ = folded_sheet(12, 11);
  const std::vector<Junctions> junctions_ = junctions(elements_);
};

TEST_F(Outline, OfOneElementHasItsEdgesAndTheEndOfALayerOnEachSide) {
  const auto lines = of({17});
  ASSERT_EQ(lines.size(), 12u + 4u);
  for (const auto& line : lines) EXPECT_EQ(line.size(), 9u);
  const auto has = [&](double u, double v, double w) {
    const Vec3 corner = elements_[17].at(u, v, w).cast<float>();
    return std::ranges::count_if(lines, [&](const auto& line) {
      return std::ranges::any_of(line, [&](const Vec3& p) { return (p - corner).norm() < .01f; });
    });
  };
  for (const double u : {0., 1.})
    for (const double v : {0., 1.}) {
      EXPECT_EQ(has(u, v, 0.), 3);
      EXPECT_EQ(has(u, v, 1.), 3);
      EXPECT_EQ(has(u, v, 1. / 3.), 2);  // of two sides; on the edge itself it lies between points
    }
  EXPECT_EQ(has(0., .5, 0.), 1);
}

TEST_F(Outline, OfNeighboursHasWhatTheyShareOnceAndLayersOnTheirRimAlone) {
  const std::uint32_t next = junctions_[17][1].element;
  ASSERT_NE(next, Junction::nothing);
  EXPECT_EQ(of({17, next}).size(), 20u + 6u);
  EXPECT_TRUE(of({}).empty());
}

TEST_F(Outline, OfManyIsTheirRim) {
  std::vector<std::uint32_t> all(elements_.size());
  std::iota(all.begin(), all.end(), 0u);
  const std::size_t sides = 2 * (12 + 11);
  EXPECT_EQ(of(all).size(), sides * 4);  // above, below, a layer and an upright edge
}

}  // namespace
}  // namespace forest::cortex
