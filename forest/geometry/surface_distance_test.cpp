// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/surface_distance.h"

#include <numbers>

#include <gtest/gtest.h>

namespace forest {
namespace {

TEST(SurfaceDistance, OfNestedBallsIsTheDifferenceOfTheirRadii) {
  const Mesh inner = icosphere(Vec3(5, 6, 7), 10'000.f, 5, 0),
             outer = icosphere(Vec3(5, 6, 7), 12'000.f, 5, 0);
  for (const auto& [from, to] : {std::pair{&inner, &outer}, {&outer, &inner}}) {
    const TriangleTree tree(*to);
    for (const auto& places : {evenly_on(*from), at_vertices(*from)}) {
      const Distances d = distances(places, tree);
      ASSERT_EQ(d.each.size(), places.size());
      EXPECT_NEAR(d.mean, 2000., 12.);
      EXPECT_NEAR(d.median, 2000., 12.);
      EXPECT_NEAR(d.p95, 2000., 12.);
      EXPECT_NEAR(d.greatest, 2000., 12.);
    }
  }
}

TEST(SurfaceDistance, PlacesLieByArea) {
  for (const int halvings : {1, 3, 5}) {
    const Mesh ball = icosphere(Vec3::Zero(), 10'000.f, halvings, 0);
    double area = 0.;
    for (const Triangle& t : ball.triangles) {
      const Vec3 a = ball.positions[t[0]];
      area += double((ball.positions[t[1]] - a).cross(ball.positions[t[2]] - a).norm()) / 2.;
    }
    const auto places = evenly_on(ball);
    EXPECT_NEAR(double(places.size()), area / 2.5e5, 1.);
    const TriangleTree tree(ball);
    TriangleTree::Place middle = TriangleTree::Place::Zero();
    for (const auto& p : places) {
      EXPECT_LT(tree.nearest(p)->distance, .01);
      middle += p / double(places.size());
    }
    EXPECT_LT(middle.norm(), 200.);
  }
}

TEST(SurfaceDistance, HasNoMorePlacesOnWhatIsLargerThanAnyCortex) {
  const Mesh ball = icosphere(Vec3::Zero(), 1e5f, 3, 0), large = icosphere(Vec3::Zero(), 1e7f, 0, 0);
  EXPECT_EQ(area_each(ball), usual_area_each);
  EXPECT_NEAR(area(large) / area_each(large), 1e7, 1.);
  const double each = 1000. * area_each(large);
  EXPECT_NEAR(double(evenly_on(large, each).size()), 1e4, 1.);
}

TEST(SurfaceDistance, TellsWhereItIsGreatestAndHowManyAreNear) {
  const Mesh ball = icosphere(Vec3::Zero(), 1000.f, 3, 0);
  const TriangleTree tree(ball);
  std::vector<TriangleTree::Place> places(99, TriangleTree::Place(1010., 0., 0.));
  for (auto& p : places) p.x() = 1000. * tree.nearest(p)->at.x() / 1000. + 10.;
  places[40] = {0., 0., 5000.};
  const Distances d = distances(places, tree);
  EXPECT_NEAR(d.greatest, 4000., 10.);
  EXPECT_EQ(d.farthest, places[40]);
  EXPECT_NEAR(d.p95, 10., .2);
  EXPECT_NEAR(d.mean, (98. * 10. + 4000.) / 99., .5);
  EXPECT_EQ(distances({}, tree).mean, 0.);
}

}  // namespace
}  // namespace forest
