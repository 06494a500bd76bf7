// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/self_intersection.h"

#include <gtest/gtest.h>

namespace forest {
namespace {

using Point = Eigen::Vector3d;

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
