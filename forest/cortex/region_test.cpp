// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/region.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/cortex/curved_elements.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

struct Region : ::testing::Test {
  const std::vector<Hexahedron> elements = folded_sheet(5, 3);
  const std::vector<Junctions> beside = junctions(elements);
  const Sheet sheet{elements, beside};
};

TEST_F(Region, MiddlesAreWhereTheMapHasThem) {
  const auto middles = middles_of(elements);
  ASSERT_EQ(middles.size(), elements.size());
  for (std::size_t e = 0; e < elements.size(); ++e)
    EXPECT_EQ(middles[e], elements[e].at(Place::Constant(.5)));
}

TEST_F(Region, ARowGoesAcrossTheFoldFromNeighbourToNeighbour) {
  for (std::uint32_t middle = 0; middle < elements.size(); ++middle) {
    const auto whole = row_through(sheet, middle, 100);
    EXPECT_EQ(whole.size(), 5u);  // it ends where the sheet does
    EXPECT_EQ(std::ranges::count(whole, middle), 1);
    for (std::size_t i = 1; i < whole.size(); ++i)
      EXPECT_TRUE(std::ranges::any_of(beside[whole[i - 1]], [&](const Junction& j) {
        return j.element == whole[i] && (j.face == Face::u0 || j.face == Face::u1);
      }));
    const auto three = row_through(sheet, middle, 3);
    EXPECT_NE(std::ranges::search(whole, three).begin(), whole.end());
    EXPECT_EQ(row_through(sheet, middle, 1), std::vector{middle});
  }
}

TEST_F(Region, UpIsTowardsThePiaAndYWhereElementsCancelOut) {
  const std::vector<std::uint32_t> one{7};
  const Place up = -elements[7].jacobian(Place::Constant(.5)).col(2).normalized();
  EXPECT_LT((towards_pia(elements, one) - up.cast<float>()).norm(), 1e-6f);

  std::vector<Hexahedron> both{elements[7], elements[7]};
  for (Place& p : both[1].points) p = -p;
  const std::vector<std::uint32_t> two{0, 1};
  EXPECT_EQ(towards_pia(both, two), Vec3::UnitY());
}

}  // namespace
}  // namespace forest::cortex
