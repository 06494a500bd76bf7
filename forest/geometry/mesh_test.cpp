// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/mesh.h"

#include <cmath>

#include <gtest/gtest.h>

namespace forest {
namespace {

TEST(Mesh, ATubeIsClosedAndHasTheVolumeOfItsPrism) {
  for (const int sides : {3, 8, 24}) {
    const std::vector<Vec4> axis{{0, 0, 0, 1}, {0, 5, 0, 1}, {0, 10, 0, 1}};
    const Mesh mesh = tube(axis, sides, Cap::flat, Cap::flat, 3);
    EXPECT_TRUE(is_closed(mesh));
    const double n = sides, across = n / 2. * std::sin(2. * pi / n);
    EXPECT_NEAR(volume(mesh), 10. * across, 1e-3);
  }
}

TEST(Mesh, ATubeWithDomesIsClosedAndLonger) {
  const std::vector<Vec4> axis{{0, 0, 0, 1}, {3, 5, 0, 2}, {3, 5, 0, .5}, {3, 5, 4, .5}};
  const Mesh mesh = tube(axis, 12, Cap::dome, Cap::dome, 3);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(count_pieces(mesh), 1u);
  EXPECT_GT(volume(mesh), volume(tube(axis, 12, Cap::flat, Cap::flat, 3)));
}

TEST(Mesh, ATubeOfOddAxesIsFiniteAndClosed) {
  const std::vector<std::vector<Vec4>> axes{{{1, 2, 3, 1}},                              // one place
                                            {{1, 2, 3, 1}, {1, 2, 3, 2}},                // twice
                                            {{0, 0, 0, 1}, {0, 9, 0, 1}, {0, 1, 0, 1}},  // there and back
                                            {{0, 0, 0, 1}, {0, 0, 0, 1}, {9, 0, 0, .01f}}};
  for (const auto& axis : axes) {
    const Mesh mesh = tube(axis, 9, Cap::dome, Cap::flat, 2);
    EXPECT_TRUE(is_closed(mesh));
    for (const Vec3& p : mesh.positions) EXPECT_TRUE(p.allFinite());
    for (const Vec3& n : vertex_normals(mesh)) EXPECT_NEAR(n.norm(), 1.f, 1e-5f);
  }
}

TEST(Mesh, RingsAlongAHelixTurnLeast) {
  std::vector<Vec4> axis;
  for (int i = 0; i <= 200; ++i) {
    const float t = float(i) * .1f;
    axis.emplace_back(5.f * std::cos(t), 2.f * t, 5.f * std::sin(t), .2f);
  }
  const int sides = 8;
  const Mesh mesh = tube(axis, sides, Cap::flat, Cap::flat, 2);
  for (int ring = 1; ring < 200;
       ++ring) {  // the line from ring to ring is as long as the axis, but for the bend
    const std::size_t at = std::size_t(1 + ring * sides);
    for (std::size_t k = 0; k < std::size_t(sides); ++k) {
      const float step = (mesh.positions[at + k] - mesh.positions[at + k - std::size_t(sides)]).norm();
      EXPECT_NEAR(step, (axis[1] - axis[0]).norm(), .03f);
    }
  }
}

TEST(Mesh, AnIcosphereNearsTheSphere) {
  const Mesh mesh = icosphere({10, 20, 30}, 2.f, 4, 1);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(mesh.triangles.size(), 20u * 256u);
  EXPECT_NEAR(volume(mesh), 4. / 3. * pi * 8., .15);
  EXPECT_NEAR(area(mesh), 4. * pi * 4., .15);
}

TEST(Mesh, AHoleATurnedTriangleAndATwiceUsedEdgeAreNotClosed) {
  Mesh mesh = icosphere({0, 0, 0}, 1.f, 0, 1);
  Mesh turned = mesh, doubled = mesh;
  mesh.triangles.pop_back();
  EXPECT_FALSE(is_closed(mesh));
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_FALSE(is_closed(turned));
  doubled.triangles.insert(doubled.triangles.end(), doubled.triangles.begin(),
                           doubled.triangles.begin() + 20);
  EXPECT_FALSE(is_closed(doubled));
}

TEST(Mesh, PartsThatShareAVertexArePinchedThere) {
  Mesh mesh = icosphere({0, 0, 0}, 1.f, 1, 1);
  EXPECT_FALSE(pinched_vertex(mesh));
  const auto size = std::uint32_t(mesh.positions.size());
  append(mesh, icosphere({2, 0, 0}, 1.f, 1, 1));
  EXPECT_FALSE(pinched_vertex(mesh));
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t)
      if (v == size + 3) v = 5;
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(count_pieces(mesh), 1u);
  EXPECT_EQ(pinched_vertex(mesh), 5u);
}

}  // namespace
}  // namespace forest
