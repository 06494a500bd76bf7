// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colour_map.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace forest::scene {
namespace {

TEST(ColourMap, MoreIsLighterAndADivergingMapIsLightestInTheMiddle) {
  for (const ColourMap& map : colour_maps()) {
    constexpr int steps = 200;
    float before = lightness(map(0.f)), largest = 0.f;
    for (int i = 1; i <= steps; ++i) {
      const float now = lightness(map(float(i) / steps));
      if (map.diverging && i > steps / 2)
        EXPECT_LT(now, before + .05f) << map.name << " at " << i;
      else
        EXPECT_GT(now, before - .05f) << map.name << " at " << i;
      largest = std::max(largest, std::abs(now - before));
      before = now;
    }
    // Perceptually even: no step is much larger than the mean one.
    EXPECT_LT(largest, 4.f * 100.f / steps) << map.name;
    EXPECT_GT(std::abs(lightness(map(map.diverging ? .5f : 1.f)) - lightness(map(0.f))), 40.f) << map.name;
  }
}

TEST(ColourMap, HasAPointAtEveryPublishedColour) {
  for (const ColourMap& map : colour_maps())
    for (std::size_t i = 0; i < map.points.size(); ++i) {
      const Vec3 c = map.screen(float(i) / float(map.points.size() - 1));
      const Vec3 published(float(map.points[i] >> 16 & 255), float(map.points[i] >> 8 & 255),
                           float(map.points[i] & 255));
      EXPECT_LT((255.f * c - published).norm(), .01f) << map.name << " at " << i;
    }
}

TEST(ColourMap, BeyondItsEndsAreItsEnds) {
  for (const ColourMap& map : colour_maps()) {
    EXPECT_EQ(map(-3.f), map(0.f));
    EXPECT_EQ(map(7.f), map(1.f));
  }
}

TEST(ColourMap, IsFoundByItsName) {
  std::set<std::string> names;
  for (const ColourMap& map : colour_maps()) {
    EXPECT_EQ(find_colour_map(map.name), &map);
    EXPECT_TRUE(names.insert(map.name).second);
  }
  EXPECT_EQ(find_colour_map("jet"), nullptr);
}

}  // namespace
}  // namespace forest::scene
