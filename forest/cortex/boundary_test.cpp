// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/boundary.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/cortex/w_curve.h"

namespace forest::cortex {
namespace {

// A roof over 20 by 20 mm: its ridge along y, its sides this steep.
Mesh roof(double slope) {
  Mesh mesh;
  const float h = float(1e4 * slope);
  for (const float y : {-1e4f, 1e4f})
    for (const float x : {-1e4f, 0.f, 1e4f}) mesh.positions.emplace_back(x, y, x == 0.f ? 0.f : -h);
  mesh.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
  return mesh;
}

TEST(Boundary, IsARoofsSideFarFromTheRidgeAndTurnsOnIt) {
  for (const double slope : {.2, .6, 1.5}) {
    const Boundary surface(roof(slope));
    const auto normal = [&](double x) {
      return surface.normal(*surface.tree().nearest({x, 1234., -slope * std::abs(x)}));
    };
    for (const double side : {-1., 1.}) {
      const Place own = Place(side * slope, 0., 1.).normalized();
      EXPECT_LT(degrees_between(normal(side * 2000.), own), .1) << slope;
      EXPECT_GT(normal(side * 50.).x() * side, -.1) << slope;
    }
    EXPECT_LT(degrees_between(normal(0.), Place::UnitZ()), 25.)
        << slope;                                 // places on the edge are of one side
    for (double x = -1500.; x < 1500.; x += 30.)  // with no edge to be seen
      EXPECT_LT(degrees_between(normal(x), normal(x + 30.)), 15.) << slope << ' ' << x;
  }
}

TEST(Boundary, IsRadialOnABallAndUnitEverywhere) {
  for (const int halvings : {2, 5}) {  // triangles of 6 and .7 mm
    const Mesh ball = icosphere(Vec3::Zero(), 1e4f, halvings, 0);
    const Boundary surface(ball);
    Random random(7);
    for (int i = 0; i < 500; ++i) {
      const Place way =
          Place(random.uniform() - .5, random.uniform() - .5, random.uniform() - .5).normalized();
      const auto hit = surface.tree().nearest(1.2e4 * way);
      const Place normal = surface.normal(*hit);
      EXPECT_NEAR(normal.norm(), 1., 1e-6);
      EXPECT_LT(degrees_between(normal, hit->at), halvings == 2 ? 12. : 2.);
    }
  }
}

TEST(Boundary, CornersAndEdgesOfTrianglesAndSliversHaveOne) {
  Mesh mesh = roof(.5);
  mesh.triangles.push_back({1, 1, 4});  // without an area
  const Boundary surface(mesh);
  for (const Vec3& p : mesh.positions)
    EXPECT_GT(surface.normal(*surface.tree().nearest(p.cast<double>())).z(), .5);
  EXPECT_EQ(surface.normal({4, Place(0., 0., 0.), 0.}), Place(Place::Zero()));
}

// Around a groove whose floor is an edge of 90° curves of the field alone come in askew: nodes are farther apart than it turns.
TEST(WCurves, MeetSurfacesAtRightAnglesEvenInAGrooveOnceNormalsAreSeenOverADisc) {
  const auto star = [](auto&& radius) {
    Mesh mesh = icosphere(Vec3::Zero(), 1.f, 6, 0);
    for (Vec3& p : mesh.positions) p = p.normalized() * float(radius(p.normalized()));
    return mesh;
  };
  const Mesh outer_mesh = star([](const Vec3& d) {
    return 10000. - std::max(0., 1200. - 10000. * std::abs(std::asin(double(d.z()))));
  });
  const Mesh inner_mesh = star([](const Vec3&) { return 7000.; });
  const Laplace field(outer_mesh, inner_mesh, {.spacing = 300.});
  const Boundary outer(outer_mesh), inner(inner_mesh);
  const WCurves curves(field, outer, inner);
  std::vector<double> angles, lean;
  std::vector<std::pair<double, double>> order;  // of latitudes half way down and at both ends
  for (int i = 0; i < 200; ++i) {
    const double height = -700. + 7. * i;
    const auto curve = curves.through(Place(7900., 311., height), Place(-1., 0., 0.));
    ASSERT_TRUE(curve && curve->arrived) << height;
    angles.push_back(end_angles(*curve, {outer.tree(), inner.tree()}).outer);
    const Place in = curve->at_length(1. - 150. / curve->length()) - curve->points.back();
    lean.push_back(degrees_between(in, curve->points.back()));
    order.emplace_back(curve->points.front().z(), curve->points.back().z());
  }
  std::ranges::sort(angles), std::ranges::sort(lean);
  EXPECT_LT(angles[100], 2.);
  EXPECT_LT(angles[190], 12.);
  EXPECT_LT(lean[198], 4.);
  for (std::size_t i = 5; i < order.size(); ++i) {  // and those 35 µm apart keep their order
    EXPECT_GT(order[i].first, order[i - 5].first) << i;
    EXPECT_GT(order[i].second, order[i - 5].second) << i;
  }
}

}  // namespace
}  // namespace forest::cortex
