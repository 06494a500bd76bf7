// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/locate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/curved_elements.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

Place somewhere(Random& random) {
  const double u = random.uniform(), v = random.uniform();
  return {u, v, random.uniform()};
}

// A prism whose far end is turned by an angle about its axis, and which narrows.
Hexahedron screw(double angle) {
  std::array<Place, 64> places;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const double turn = angle * k / 3., x = (i / 3. - .5) * (1. - .2 * k), y = j / 3. - .5;
        places[Hexahedron::index(i, j, k)] = 1000. * Place(std::cos(turn) * x - std::sin(turn) * y,
                                                           std::sin(turn) * x + std::cos(turn) * y, k / 2.);
      }
  return through_lattice(places);
}

TEST(FoldedSheet, IsValidSharesItsFacesAndHasElementsOfAboutACubicMillimetre) {
  const auto elements = folded_sheet(24, 3);
  ASSERT_EQ(elements.size(), 72u);
  for (std::size_t n = 0; n < elements.size(); ++n) {
    EXPECT_TRUE(certify(elements[n]).positive()) << n;
    EXPECT_NEAR(elements[n].volume(), 1e9, .25e9) << n;
    if (n % 3 != 2) {
      EXPECT_EQ(elements[n].face(Face::v1).points, elements[n + 1].face(Face::v0).points) << n;
    }
    if (n + 3 < elements.size()) {
      EXPECT_EQ(elements[n].face(Face::u1).points, elements[n + 3].face(Face::u0).points) << n;
    }
  }
}

TEST(Locator, FindsEveryPlaceOfACurvedSheet) {
  const auto elements = folded_sheet(24, 6);
  const Locator locator(elements);
  Random random(1);
  for (int n = 0; n < 20000; ++n) {
    const std::uint32_t element = random.below(std::uint32_t(elements.size()));
    const Place uvw = somewhere(random), place = elements[element].at(uvw);
    const Location found = locator.find(place);
    ASSERT_TRUE(found.found()) << place.transpose();
    ASSERT_LT((elements[found.element].at(found.uvw) - place).norm(), 1e-5);
    ASSERT_EQ(found.element, element);
    ASSERT_LT((found.uvw - uvw).norm(), 1e-7);
  }
}

TEST(Locator, FindsPlacesOnFacesEdgesAndCorners) {
  const auto elements = folded_sheet(6, 3);
  const Locator locator(elements);
  Random random(2);
  for (const Hexahedron& h : elements)
    for (int n = 0; n < 26; ++n) {
      Place uvw = somewhere(random);
      for (int a = 0, code = n + (n >= 13 ? 1 : 0); a < 3; ++a, code /= 3)
        if (code % 3 != 1) uvw[a] = code % 3 / 2.;
      const Location found = locator.find(h.at(uvw));
      ASSERT_TRUE(found.found()) << uvw.transpose();
      EXPECT_LT((elements[found.element].at(found.uvw) - h.at(uvw)).norm(), 2e-5);
      EXPECT_GE(found.uvw.minCoeff(), 0.);
      EXPECT_LE(found.uvw.maxCoeff(), 1.);
    }
}

TEST(Locator, SaysNowhereOutsideAndGrantsTheSlack) {
  const auto elements = folded_sheet(12, 3);
  const Locator strict(elements), generous(elements, 2.);
  for (const Hexahedron& h : elements) {
    const Linear pia = linear(h, {.4, .3, 0.});
    const Place outwards = -pia.jacobian.col(0).cross(pia.jacobian.col(1)).normalized();
    EXPECT_FALSE(strict.find(pia.at + 1. * outwards).found());
    EXPECT_TRUE(strict.find(pia.at + .0005 * outwards).found());
    const Location found = generous.find(pia.at + 1. * outwards);
    ASSERT_TRUE(found.found());
    EXPECT_EQ(found.uvw[2], 0.);
    EXPECT_NEAR((elements[found.element].at(found.uvw) - (pia.at + outwards)).norm(), 1., .1);
    EXPECT_FALSE(generous.find(pia.at + 20. * outwards).found());
  }
  EXPECT_FALSE(strict.find(Place(1e9, 0, 0)).found());
  EXPECT_FALSE(strict.find(Place(0, std::numeric_limits<double>::quiet_NaN(), 0)).found());
  EXPECT_FALSE(Locator({}).find(Place(0, 0, 0)).found());
}

// Whatever the search leaves out, a look at every element alone finds nothing else.
TEST(Locator, AgreesWithLookingAtEveryElement) {
  const auto elements = folded_sheet(10, 2);
  const Locator locator(elements);
  Place low = elements[0].points[0], high = low;
  for (const auto& h : elements)
    for (const auto& p : h.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  Random random(9);
  int inside = 0, outside = 0;
  for (int n = 0; n < 1000; ++n) {
    const Place place = low + (high - low).cwiseProduct(somewhere(random));
    bool any = false;
    for (const auto& h : elements) any = any || invert(h, place).has_value();
    EXPECT_EQ(locator.find(place).found(), any) << place.transpose();
    (any ? inside : outside)++;
  }
  EXPECT_GT(inside, 200);
  EXPECT_GT(outside, 200);
}

TEST(Invert, ComesBackFromStronglyTurnedElements) {
  for (const double angle : {.5, 1.2, 1.8}) {
    const Hexahedron h = screw(angle);
    ASSERT_TRUE(certify(h).positive()) << angle;
    Random random(4);
    for (int n = 0; n < 2000; ++n) {
      const Place uvw = somewhere(random);
      const auto found = invert(h, h.at(uvw));
      ASSERT_TRUE(found.has_value()) << angle << ": " << uvw.transpose();
      EXPECT_LT((h.at(*found) - h.at(uvw)).norm(), 1e-5) << angle;
    }
  }
}

// Most of a turn in one element: Newton's method from the middle runs away from one place in 24, halving finds them.
TEST(Invert, FindsPlacesOfAnElementThatIsBentLikeAHook) {
  std::array<Place, 64> places;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const double angle = 5. * j * j / 9., r = 300. + 100. * i;
        places[Hexahedron::index(i, j, k)] = {r * std::cos(angle), r * std::sin(angle), 300. * k};
      }
  const Hexahedron h = through_lattice(places);
  ASSERT_TRUE(certify(h).positive());
  Random random(6);
  for (int n = 0; n < 3000; ++n) {
    const Place place = h.at(somewhere(random));
    const auto found = invert(h, place);
    ASSERT_TRUE(found.has_value()) << place.transpose();
    EXPECT_LT((h.at(*found) - place).norm(), 1e-5);
  }
  EXPECT_FALSE(invert(h, Place(0, 0, 400)).has_value());       // within the bow
  EXPECT_FALSE(invert(h, Place(420, -180, 400)).has_value());  // between its ends
}

TEST(Locator, GivesTheSameAtAnyNumberOfThreads) {
  const auto elements = folded_sheet(8, 4);
  const Locator locator(elements);
  std::vector<Place> places;
  Random random(3);
  for (int n = 0; n < 5000; ++n)
    places.push_back(elements[random.below(std::uint32_t(elements.size()))].at(somewhere(random)));
  const auto many = locator.find(places);
  const ThreadLimit one(1);
  const auto alone = locator.find(places);
  for (std::size_t n = 0; n < places.size(); ++n) {
    ASSERT_EQ(many[n].element, alone[n].element);
    ASSERT_EQ(many[n].uvw, alone[n].uvw);
  }
}

TEST(Locator, NamesAnElementThatIsBroken) {
  auto elements = folded_sheet(2, 2);
  elements[3].point(1, 2, 3).z() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refused([&] { const Locator locator(elements); }), testing::HasSubstr("element 3"));
}

}  // namespace
}  // namespace forest::cortex
