// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/triangle_tree.h"

#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace forest {
namespace {

using Point = Eigen::Vector3d;

TEST(TriangleTree, FindsTheNearestPointOfABallAndAllTrianglesInABox) {
  const Point centre(10., -20., 5.);
  const Mesh mesh = icosphere(centre.cast<float>(), 100.f, 4, 0);
  const TriangleTree tree(mesh);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-150., 150.);
  for (int k = 0; k < 200; ++k) {
    const Point p(place(random), place(random), place(random));
    const auto found = tree.nearest(p);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->distance, std::abs((p - centre).norm() - 100.), .4);  // a polyhedron's
    EXPECT_NEAR((found->at - p).norm(), found->distance, 1e-9);
    EXPECT_FALSE(tree.nearest(p, .999 * found->distance).has_value());
    const Point low = p - Point::Constant(40.), high = p + Point::Constant(40.);
    std::set<std::uint32_t> seen;
    tree.for_overlapping(low, high, [&](std::uint32_t t) { EXPECT_TRUE(seen.insert(t).second); });
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Point vertex = mesh.positions[mesh.triangles[t][0]].cast<double>();
      const bool within = (vertex.array() >= low.array()).all() && (vertex.array() <= high.array()).all();
      EXPECT_TRUE(!within || seen.contains(t));
    }
  }
}

}  // namespace
}  // namespace forest
