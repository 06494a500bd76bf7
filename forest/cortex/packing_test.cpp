// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/packing.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/curved_elements.h"
#include "forest/cortex/locate.h"

#include "tests/effort.h"
#include "tests/refused.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

double least_distance(const PackedCube& cube) {
  const auto shared = std::make_shared<const PackedCube>(cube);
  const Packing packing(shared, 1., 1, 0);
  double least = 1e9;
  for (const Place& p : cube.points)
    packing.for_box(p - Place::Ones(), p + Place::Ones(), [&](std::uint64_t, const Place& q) {
      if (p != q) least = std::min(least, (p - q).norm());
    });
  return least;
}

TEST(PackedCube, NoTwoPointsAreTooNearAlsoAcrossItsSides) {
  for (const double spacing : {.5, .8, PackedCube::most_spacing}) {
    const PackedCube cube = pack_cube(spacing, 3);
    EXPECT_EQ(cube.points.size(), 13824u);
    EXPECT_GE(least_distance(cube), spacing);
    EXPECT_LT(least_distance(cube), 1.1 * spacing);
  }
  EXPECT_THAT(refused([] { pack_cube(1., 3); }), testing::HasSubstr("0.985"));
}

TEST(PackedCube, IsTheSameOnAnyNumberOfThreads) {
  const PackedCube many = pack_cube(.9, 8);
  const ThreadLimit one(1);
  EXPECT_EQ(pack_cube(.9, 8).points, many.points);
  EXPECT_NE(pack_cube(.9, 9).points, many.points);
}

TEST(Packing, HasItsDensityAndItsSpacingEverywhere) {
  const Packing packing(std::make_shared<const PackedCube>(pack_cube(.9, 1)), 5e-5, 1, 0);
  EXPECT_NEAR(packing.spacing(), .9 / std::cbrt(5e-5), 1e-9);
  for (const Place& middle : {Place(0., 0., 0.), Place(-70'000., 51'000., 12'345.)}) {
    std::size_t count = 0;
    packing.for_near(middle, 500.,
                     [&](std::uint64_t, const Place& p) { count += (p - middle).norm() < 500.; });
    EXPECT_NEAR(double(count), 5e-5 * 4. / 3. * std::numbers::pi * 1.25e8, 300.);
  }
}

TEST(PlacesIn, AreAllThatALocatorFindsInTheElementEachOnce) {
  LONG_TEST();
  const auto elements = folded_sheet(3, 2);
  const Locator locator(elements, 0.);
  const Packing packing(std::make_shared<const PackedCube>(pack_cube(.8, 1)), 8e-6, 1, 0);
  std::set<std::uint64_t> taken;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const auto places = places_in(packing, elements[e], .2, .7);
    std::set<std::uint64_t> items;
    for (const Packed& p : places) {
      EXPECT_TRUE(items.insert(p.item).second);
      EXPECT_TRUE(taken.insert(p.item).second) << "two elements have it";
    }
    const Place middle = elements[e].at(.5, .5, .5);
    std::size_t found = 0;
    packing.for_near(middle, 2500., [&](std::uint64_t item, const Place& place) {
      const Location where = locator.find(place);
      const bool here = where.element == e && where.uvw[2] >= .2 && where.uvw[2] < .7;
      found += here;
      EXPECT_EQ(items.contains(item), here);
    });
    EXPECT_EQ(found, places.size());
    EXPECT_GT(found, 2000u);
  }
}

}  // namespace
}  // namespace forest::cortex
