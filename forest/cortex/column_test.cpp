// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/column.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <boost/math/distributions/chi_squared.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

const std::array<Column::Layer, 3> layers{{{"upper", 100.f}, {"middle", 50.f}, {"lower", 250.f}}};

// p value of Pearson's test that the counts of `seen` come from bins of equal probability.
template <std::size_t n>
double even_p(const std::array<int, n>& seen, int count) {
  double sum = 0., expected = double(count) / double(n);
  for (const int k : seen) sum += (k - expected) * (k - expected) / expected;
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(double(n - 1)), sum));
}

TEST(Column, LayersFillItFromThePiaToTheWhiteMatter) {
  const Column column(200.f, layers);
  EXPECT_EQ(column.height(), 400.f);
  EXPECT_EQ(column.layers().front().top, column.height());
  EXPECT_EQ(column.layers().back().bottom, 0.f);
  for (std::size_t i = 1; i < layers.size(); ++i)
    EXPECT_EQ(column.layers()[i].top, column.layers()[i - 1].bottom);
  for (std::size_t i = 0; i < layers.size(); ++i)
    EXPECT_EQ(column.layers()[i].thickness(), layers[i].thickness);
}

TEST(Column, VolumesOfLayersSumToThatOfTheCylinder) {
  const Column column(200.f, layers);
  double sum = 0.;
  for (std::size_t i = 0; i < layers.size(); ++i) sum += column.volume(i);
  EXPECT_NEAR(sum, std::numbers::pi * 200. * 200. * 400., 1e-6 * sum);
}

TEST(Column, SamplesAreUniformInTheVolumeOfTheirLayer) {
  const Column column(200.f, layers);
  for (std::size_t layer = 0; layer < layers.size(); ++layer) {
    Random random(4, layer);
    constexpr int count = 64000;
    std::array<int, 16> depth{}, angle{}, area{};
    for (int i = 0; i < count; ++i) {
      const Vec3 p = column.sample(layer, random);
      ASSERT_TRUE(column.contains(layer, p)) << p.transpose();
      const Slab& slab = column.layers()[layer];
      const auto bin = [](double share) { return std::min(std::size_t(15), std::size_t(16. * share)); };
      ++depth[bin((p.y() - slab.bottom) / slab.thickness())];
      ++angle[bin(std::atan2(double(p.z()), double(p.x())) / (2. * std::numbers::pi) + .5)];
      ++area[bin(double(p.x() * p.x() + p.z() * p.z()) / (200. * 200.))];
    }
    EXPECT_GT(even_p(depth, count), 1e-4);
    EXPECT_GT(even_p(angle, count), 1e-4);
    EXPECT_GT(even_p(area, count), 1e-4);
  }
}

TEST(Column, RefusesWhatIsNoLength) {
  using testing::HasSubstr;
  for (const float bad :
       {0.f, -1.f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_THROW(Column(bad, layers), Error);
    auto wrong = layers;
    wrong[1].thickness = bad;
    EXPECT_THAT(refused([&] { Column(1.f, wrong); }), HasSubstr("middle")) << bad;
  }
  EXPECT_THROW(Column(1.f, {}), Error);
}

}  // namespace
}  // namespace forest::cortex
