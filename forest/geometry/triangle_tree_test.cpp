// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/triangle_tree.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace forest {
namespace {

using Point = Eigen::Vector3d;

TEST(TriangleTree, FindsWhatLookingAtEveryTriangleFinds) {
  const Mesh mesh = icosphere({10.f, -20.f, 5.f}, 100.f, 3, 0);
  const TriangleTree tree(mesh);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-150., 150.);
  for (int k = 0; k < 200; ++k) {
    const Point p(place(random), place(random), place(random));
    double least = HUGE_VAL;
    for (const Triangle& t : mesh.triangles)
      least = std::min(least, (nearest_on_triangle(p, mesh.positions[t[0]].cast<double>(),
                                                   mesh.positions[t[1]].cast<double>(),
                                                   mesh.positions[t[2]].cast<double>()) -
                               p)
                                  .norm());
    const auto found = tree.nearest(p);
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->distance, least);
    EXPECT_NEAR((found->point - p).norm(), least, 1e-9);
    EXPECT_FALSE(tree.nearest(p, .999 * least).has_value());
    Bounds box;
    box.add(p.cast<float>(), 40.f);
    std::vector<std::uint32_t> all;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      Bounds own;
      for (const std::uint32_t corner : mesh.triangles[t]) own.add(mesh.positions[corner]);
      if ((own.low.array() <= box.high.array()).all() && (box.low.array() <= own.high.array()).all())
        all.push_back(t);
    }
    EXPECT_EQ(tree.within(box), all);
  }
}

TEST(TriangleTree, OfNothingFindsNothing) {
  const Mesh mesh;
  const TriangleTree tree(mesh);
  EXPECT_FALSE(tree.nearest(Point::Zero()).has_value());
  EXPECT_TRUE(tree.within(Bounds{}).empty());
}

TEST(NearestOnTriangle, LiesOnCornersEdgesAndTheInner) {
  const Point a(0., 0., 0.), b(2., 0., 0.), c(0., 2., 0.);
  EXPECT_EQ(nearest_on_triangle({-1., -1., 3.}, a, b, c), a);
  EXPECT_EQ(nearest_on_triangle({3., -1., 0.}, a, b, c), b);
  EXPECT_EQ(nearest_on_triangle({-1., 3., 0.}, a, b, c), c);
  EXPECT_EQ(nearest_on_triangle({1., -1., 2.}, a, b, c), Point(1., 0., 0.));
  EXPECT_EQ(nearest_on_triangle({-1., 1., 2.}, a, b, c), Point(0., 1., 0.));
  EXPECT_EQ(nearest_on_triangle({2., 2., 0.}, a, b, c), Point(1., 1., 0.));
  EXPECT_LT((nearest_on_triangle({.5, .25, -7.}, a, b, c) - Point(.5, .25, 0.)).norm(), 1e-12);
  EXPECT_EQ(nearest_on_triangle({5., 1., 0.}, a, a, a), a);
}

TEST(SelfIntersection, IsNoneOfABallAndFoundWhereTwoBallsOverlap) {
  Mesh mesh = icosphere({0.f, 0.f, 0.f}, 100.f, 3, 0);
  EXPECT_FALSE(self_intersection(mesh).has_value());
  EXPECT_EQ(count_cut_triangles(mesh), 0u);
  Mesh apart = mesh;
  append(apart, icosphere({250.f, 0.f, 0.f}, 100.f, 3, 0));
  append(apart, icosphere({0.f, 0.f, 0.f}, 50.f, 3, 0));
  EXPECT_FALSE(self_intersection(apart).has_value());
  append(mesh, icosphere({120.f, 3.f, 7.f}, 100.f, 3, 0));
  const auto found = self_intersection(mesh);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->point.norm(), 100., 2.);
  EXPECT_NEAR((found->point - Point(120., 3., 7.)).norm(), 100., 2.);
  EXPECT_GT(count_cut_triangles(mesh), 40u);
}

TEST(SelfIntersection, IsFoundWhenOneVertexIsPushedThroughTheOtherSide) {
  Mesh mesh = icosphere({0.f, 0.f, 0.f}, 100.f, 3, 0);
  mesh.positions[5] = -1.2f * mesh.positions[5] + Vec3(1.f, 2.f, .5f);
  EXPECT_TRUE(self_intersection(mesh).has_value());
}

}  // namespace
}  // namespace forest
