// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/split_areas.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

namespace forest {
namespace {

// Two, three and five areas around a ball, of which three meet at its poles.
std::vector<std::uint16_t> sectors(const Mesh& mesh, int count) {
  std::vector<std::uint16_t> out;
  for (const Vec3& p : mesh.positions)
    out.push_back(std::uint16_t(double(count) * (std::atan2(p.y(), p.x()) + 3.1415927) / 6.2831856));
  return out;
}

Mesh split(const Mesh& mesh, std::span<const std::uint16_t> areas, SplitAreas& parts) {
  parts = split_areas(mesh.triangles, areas);
  return {parts.carried(std::span<const Vec3>(mesh.positions)), {}, parts.triangles};
}

TEST(SplitAreas, EveryTriangleBelongsToOneAreaAndTheSurfaceIsTheSame) {
  for (const int count : {1, 2, 3, 5, 40}) {
    const Mesh ball = icosphere(Vec3::Zero(), 10.f, 2, 0);
    const std::vector<std::uint16_t> areas = sectors(ball, count);
    SplitAreas parts;
    const Mesh cut = split(ball, areas, parts);
    ASSERT_EQ(parts.areas.size(), cut.positions.size());
    EXPECT_TRUE(std::equal(areas.begin(), areas.end(), parts.areas.begin()));
    for (const Triangle& t : parts.triangles) {
      EXPECT_EQ(parts.areas[t[0]], parts.areas[t[1]]);
      EXPECT_EQ(parts.areas[t[0]], parts.areas[t[2]]);
    }
    EXPECT_NEAR(area(cut), area(ball), 1e-4 * area(ball));
    EXPECT_NEAR(volume(cut), volume(ball), 1e-4 * volume(ball));
    if (count == 1) {
      EXPECT_EQ(parts.triangles, ball.triangles);
      EXPECT_TRUE(parts.middles.empty());
    }
    // Closed, once the copies of a place are one.
    std::map<std::array<float, 3>, std::uint32_t> places;
    Mesh joined;
    for (Triangle t : parts.triangles) {
      for (std::uint32_t& corner : t) {
        const Vec3& p = cut.positions[corner];
        corner = places.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(places.size())).first->second;
      }
      joined.triangles.push_back(t);
    }
    joined.positions.resize(places.size());
    EXPECT_TRUE(is_closed(joined)) << count << " areas";
  }
}

TEST(SplitAreas, ATriangleIsCutWhereItsEdgesHaveTheirMiddle) {
  const std::vector<Triangle> triangle{{0, 1, 2}};
  const std::vector<float> x{0.f, 6.f, 12.f};
  const SplitAreas two = split_areas(triangle, std::vector<std::uint16_t>{4, 4, 9});
  EXPECT_EQ(two.triangles.size(), 3u);
  EXPECT_EQ(two.areas, (std::vector<std::uint16_t>{4, 4, 9, 9, 9, 4, 4}));
  EXPECT_EQ(two.carried(std::span(x)), (std::vector<float>{0, 6, 12, 6, 9, 6, 9}));
  const SplitAreas three = split_areas(triangle, std::vector<std::uint16_t>{1, 2, 3});
  EXPECT_EQ(three.triangles.size(), 6u);
  EXPECT_EQ(three.middles.size(), 9u);  // three edges between two areas, and the middle between three
  EXPECT_EQ(three.carried(std::span(x))[3], 6.f);
}

}  // namespace
}  // namespace forest
