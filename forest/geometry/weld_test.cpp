// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/weld.h"

#include <gtest/gtest.h>

namespace forest {
namespace {

// Each triangle with corners of its own.
Mesh loose(const Mesh& mesh) {
  Mesh result;
  for (const Triangle& t : mesh.triangles) {
    const auto first = std::uint32_t(result.positions.size());
    for (const std::uint32_t v : t)
      result.positions.push_back(mesh.positions[v]), result.labels.push_back(mesh.labels[v]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

TEST(Weld, LooseTrianglesHangTogetherAgain) {
  const Mesh ball = icosphere({1, 2, 3}, 5.f, 2, 4), apart = loose(ball);
  EXPECT_FALSE(is_closed(apart));
  const Mesh whole = welded(apart);
  EXPECT_TRUE(is_closed(whole));
  EXPECT_EQ(whole.positions.size(), ball.positions.size());
  EXPECT_EQ(whole.triangles.size(), ball.triangles.size());
  EXPECT_EQ(whole.labels, std::vector<std::uint8_t>(ball.positions.size(), 4));
  EXPECT_NEAR(volume(whole), volume(ball), 1e-3);
}

TEST(Weld, MinusZeroIsZeroAndATriangleThatShrinksToALineIsNone) {
  Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.f, 0, 0}, {0, 0, 1}},
            {0, 0, 0, 0, 0},
            {{0, 1, 2}, {0, 3, 1}, {3, 2, 4}}};
  const Mesh whole = welded(mesh);
  EXPECT_EQ(whole.positions.size(), 4u);
  EXPECT_EQ(whole.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Weld, WhatIsClosedKeepsItsNumbersAlsoWhereItTouchesItself) {
  Mesh two = icosphere({0, 0, 0}, 1.f, 0, 0);
  Mesh other = two;
  for (Vec3& p : other.positions) p -= 2.f * two.positions[0];  // one vertex each at one place
  append(two, other);
  EXPECT_EQ(welded_if_open(two).positions.size(), two.positions.size());
  EXPECT_EQ(welded_if_open(loose(two)).positions.size(), two.positions.size() - 1);
  Mesh open = loose(two);
  open.triangles.pop_back();
  EXPECT_EQ(welded_if_open(open).positions, open.positions);
}

}  // namespace
}  // namespace forest
