// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/polyline.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest {
namespace {

TEST(Polyline, NoDroppedVertexIsFurtherThanTheTolerance) {
  Random random(5);
  for (int round = 0; round < 50; ++round) {
    std::vector<Vec4> line{Vec4::Zero()};
    for (int i = 0; i < 100; ++i)
      line.push_back(line.back() +
                     Vec4(1, float(random.normal()), float(random.normal()), float(random.normal(0, .01))));
    const float tolerance = float(random.uniform(.1, 5));
    const auto kept = simplify(line, tolerance);
    EXPECT_EQ(kept.front(), 0u);
    EXPECT_EQ(kept.back(), 100u);
    for (std::size_t k = 1; k < kept.size(); ++k)
      for (std::uint32_t i = kept[k - 1]; i <= kept[k]; ++i)
        EXPECT_LE(
            distance_to_segment(line[i].head<3>(), line[kept[k - 1]].head<3>(), line[kept[k]].head<3>()),
            tolerance * 1.0001f);
  }
}

TEST(Polyline, AStraightLineBecomesOneSegment) {
  std::vector<Vec4> line;
  for (int i = 0; i < 10; ++i) line.push_back(Vec4(float(i), 0, 0, 1));
  EXPECT_EQ(simplify(line, .01f).size(), 2u);
  EXPECT_TRUE(simplify({}, 1.f).empty());
}

}  // namespace
}  // namespace forest
