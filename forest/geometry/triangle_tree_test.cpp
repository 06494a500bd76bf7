// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/triangle_tree.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest {
namespace {

using Place = TriangleTree::Place;

Place anywhere(Random& random, double reach) {
  return {random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)};
}

TEST(TriangleTree, AnswersAsOneTriangleAfterTheOtherDoes) {
  const Mesh mesh = icosphere(Vec3(1, 2, 3), 10.f, 2, 0);
  const TriangleTree tree(mesh);
  Random random(1);
  for (int k = 0; k < 300; ++k) {
    const Place from = anywhere(random, 20.), to = anywhere(random, 20.);
    double nearest = 1e300, first = 1e300;
    for (const Triangle& t : mesh.triangles) {
      const TriangleTree one(
          Mesh{{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]}, {}, {{0, 1, 2}}});
      nearest = std::min(nearest, one.nearest(from)->distance);
      if (const auto hit = one.first(from, to)) first = std::min(first, hit->distance);
    }
    EXPECT_NEAR(tree.nearest(from)->distance, nearest, 1e-9);
    const auto hit = tree.first(from, to);
    EXPECT_EQ(hit.has_value(), first < 1e300);
    if (hit) {
      EXPECT_NEAR(hit->distance, first, 1e-9) << k;
    }
    EXPECT_FALSE(tree.nearest(from, .99 * nearest));
  }
}

TEST(TriangleTree, KnowsWhatASurfaceEncloses) {
  const TriangleTree tree(icosphere(Vec3::Zero(), 10.f, 4, 0));
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    const Place p = anywhere(random, 15.);
    if (std::abs(p.norm() - 10.) > .1) {
      EXPECT_EQ(tree.encloses(p), p.norm() < 10.);
    }
  }
}

TEST(TriangleTree, OfNothingOrOfALineIsNoTrouble) {
  const TriangleTree nothing{Mesh{}};
  EXPECT_FALSE(nothing.nearest(Place::Zero()));
  EXPECT_FALSE(nothing.first(Place::Zero(), Place::Ones()));
  EXPECT_FALSE(nothing.encloses(Place::Zero()));
  const TriangleTree line(Mesh{{Vec3(0, 0, 0), Vec3(10, 0, 0)}, {}, {{0, 1, 1}}});
  EXPECT_NEAR(line.nearest(Place(4., 3., 0.))->distance, 3., 1e-12);
  EXPECT_NEAR(line.nearest(Place(-4., 3., 0.))->distance, 5., 1e-12);
}

}  // namespace
}  // namespace forest
