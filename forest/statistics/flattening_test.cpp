// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/flattening.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/morphology/transform.h"

namespace forest::statistics {
namespace {

/// Branches straight to all sides alike, or of another kind along x alone.
Morphology star(std::uint64_t item, SectionKind others = SectionKind::basal) {
  Random random(9, item);
  MorphologyBuilder builder;
  for (int i = 0; i < 30; ++i) {
    const double z = random.uniform(-1., 1.), turn = random.uniform(0., 2. * std::numbers::pi);
    const double across = std::sqrt(1. - z * z);
    const Vec3 end = 100.f * Vec3(float(across * std::cos(turn)), float(across * std::sin(turn)), float(z));
    builder.add_section({}, SectionKind::basal,
                        std::vector<Point>{{0, 0, 0, 1}, {end.x(), end.y(), end.z(), 1}});
  }
  if (others != SectionKind::basal)
    builder.add_section({}, others, std::vector<Point>{{0, 0, 0, 1}, {9000, 0, 0, 1}});
  return builder.build();
}

std::vector<Morphology> stars(float flat) {
  std::vector<Morphology> all;
  for (std::uint64_t i = 0; i < 40; ++i)
    all.push_back(stretched(star(i, SectionKind::axon), {1.f, 1.f, 1.f / flat}));
  return all;
}

TEST(Flattening, SaysHowFlatASliceBecame) {
  for (const float flat : {1.f, 1.5f, 4.f}) {
    const Flattening found = flattening(stars(flat));
    EXPECT_LT(found.error / found.ratio, .05);
    EXPECT_NEAR(found.ratio, flat, 3. * found.error);
  }
}

TEST(Flattening, IsUndoneByStretching) {
  const double before = flattening(stars(1.5f)).ratio;
  std::vector<Morphology> all = stars(1.5f);
  for (Morphology& m : all) m = stretched(m, {1.f, 1.f, float(before)});
  EXPECT_NEAR(flattening(all).ratio, 1., 1e-5);
}

TEST(Flattening, LooksAtDendritesAndWhereThereAreNoneAtAll) {
  EXPECT_NEAR(flattening(std::vector{star(1)}).ratio,
              flattening(std::vector{star(1, SectionKind::axon)}).ratio, 1e-12);
  MorphologyBuilder builder;
  builder.add_section({}, SectionKind::axon, std::vector<Point>{{0, 0, 0, 1}, {30, 5, -10, 1}});
  const Flattening axon = flattening(std::vector{builder.build()});
  EXPECT_DOUBLE_EQ(axon.ratio, 3.);
  EXPECT_TRUE(std::isnan(axon.error));
}

TEST(Flattening, DoesNotCountStepsOfFocus) {  // z to and fro within a few µm is none of the way
  MorphologyBuilder builder;
  std::vector<Point> points;
  for (int i = 0; i <= 100; ++i) points.push_back({float(i), 0, .1f * float(i) + float(i % 2), 1});
  builder.add_section({}, SectionKind::basal, points);
  EXPECT_NEAR(flattening(std::vector{builder.build()}).ratio, 10., 3.);
}

TEST(Flattening, OfNothingIsNoNumber) {
  EXPECT_TRUE(std::isnan(flattening({}).ratio));
  EXPECT_TRUE(std::isnan(flattening(std::vector{Morphology()}).ratio));
}

}  // namespace
}  // namespace forest::statistics
