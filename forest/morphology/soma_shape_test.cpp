// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/soma_shape.h"

#include <cmath>

#include <gtest/gtest.h>

namespace forest {
namespace {

Soma outline(float along, float across, const Quat& turn, const Vec3& at) {
  Soma soma{.kind = SomaKind::contours, .points = {}, .parents = {}, .contour_starts = {0}};
  for (int i = 0; i < 60; ++i) {
    const float angle = 2.f * float(pi) * float(i) / 60.f;
    const Vec3 p = at + turn * Vec3(along * std::cos(angle), across * std::sin(angle), 0.f);
    soma.points.push_back({p.x(), p.y(), p.z(), .1f});
  }
  return soma;
}

TEST(SomaShape, OfASphereOrNoneIsEmpty) {
  EXPECT_TRUE(soma_shape(Soma()).empty());
  EXPECT_TRUE(
      soma_shape({.kind = SomaKind::sphere, .points = {{1, 2, 3, 4}}, .parents = {}, .contour_starts = {}})
          .empty());
}

TEST(SomaShape, OfASpindleIsAsLongAndAsWideWhereverItLies) {
  const Vec3 at(100, -20, 7);
  for (const float angle : {0.f, .7f, 2.f}) {
    const Quat turn(Eigen::AngleAxisf(angle, Vec3(.3f, .5f, .8f).normalized()));
    const auto shape = soma_shape(outline(20.f, 8.f, turn, at));
    ASSERT_EQ(shape.size(), 1u);
    float most = 0.f, low = INFINITY, high = -INFINITY;
    for (const Point& p : shape[0]) {
      const Vec3 local = turn.conjugate() * Vec3(p.position() - at);
      EXPECT_NEAR(local.y(), 0.f, .05f);
      EXPECT_NEAR(local.z(), 0.f, .05f);
      // On the ellipse, as far as sixty corners are one.
      EXPECT_NEAR(p.radius, 8.f * std::sqrt(std::max(0.f, 1.f - local.x() * local.x() / 400.f)), .15f);
      most = std::max(most, p.radius), low = std::min(low, local.x() - p.radius),
      high = std::max(high, local.x() + p.radius);
    }
    EXPECT_NEAR(most, 8.f, .05f);
    EXPECT_NEAR(high - low, 40.f, 3.f);
  }
}

TEST(SomaShape, OfCylindersEndsWhereTheyDo) {
  const Soma soma{.kind = SomaKind::cylinders,
                  .points = {{0, 0, 0, 2}, {0, 10, 0, 6}, {0, 30, 0, 3}},
                  .parents = {-1, 0, 1},
                  .contour_starts = {}};
  const auto shape = soma_shape(soma);
  ASSERT_EQ(shape.size(), 2u);
  EXPECT_FLOAT_EQ(shape[0][0].y - shape[0][0].radius, 0.f);
  EXPECT_FLOAT_EQ(shape[0][1].y, 10.f);  // within nothing is drawn in
  EXPECT_FLOAT_EQ(shape[1][0].y, 10.f);
  EXPECT_FLOAT_EQ(shape[1][1].y + shape[1][1].radius, 30.f);
}

TEST(SomaShape, OfAStackGoesThroughItsMiddles) {
  Soma soma = outline(5.f, 5.f, Quat::Identity(), Vec3(0, 0, 0));
  for (const Point& p : outline(7.f, 7.f, Quat::Identity(), Vec3(1, 0, 4)).points) soma.points.push_back(p);
  soma.contour_starts.push_back(60);
  const auto shape = soma_shape(soma);
  ASSERT_EQ(shape.size(), 1u);
  EXPECT_NEAR(shape[0][0].radius, 5.f, 1e-3f);
  EXPECT_NEAR(shape[0][1].radius, 7.f, 1e-3f);
  EXPECT_NEAR(shape[0][1].z, 4.f, 1e-5f);
}

// Nothing of these has a direction or a width.
TEST(SomaShape, OfWhatIsNoShapeIsEmpty) {
  Soma soma = outline(0.f, 0.f, Quat::Identity(), Vec3(3, 3, 3));
  EXPECT_TRUE(soma_shape(soma).empty());
  soma = outline(5.f, 0.f, Quat::Identity(), Vec3::Zero());
  for (const auto& run : soma_shape(soma))
    for (const Point& p : run) EXPECT_TRUE(std::isfinite(p.radius) && p.position().allFinite());
  soma.points.resize(2);
  EXPECT_TRUE(soma_shape(soma).empty());
}

}  // namespace
}  // namespace forest
