// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/borders.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/cortex/elements.h"
#include "forest/cortex/slab_test.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

using testing::HasSubstr;

// The pia over a slab of 2 × 2 blocks, triangles of 250 µm, and three layers: the first one is thin where x is small.
Mesh pia() {
  Mesh mesh;
  for (int j = 0; j <= 4; ++j)
    for (int i = 0; i <= 4; ++i) mesh.positions.emplace_back(250.f * float(i), 250.f * float(j), 0.f);
  for (std::uint32_t j = 0; j < 4; ++j)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = 5 * j + i;
      mesh.triangles.push_back({a, a + 1, a + 6}), mesh.triangles.push_back({a, a + 6, a + 5});
    }
  return mesh;
}
double first_share(double x) { return .1 + .3 * x / 1000.; }
constexpr double last_share = .25;
std::vector<std::vector<float>> thickness(const Mesh& mesh) {
  std::vector<std::vector<float>> layers(3);
  for (const Vec3& p : mesh.positions) {
    const double first = first_share(double(p.x())), mm = 2. + double(p.y()) / 1000.;  // only shares count
    layers[0].push_back(float(mm * first)), layers[1].push_back(float(mm * (1. - last_share - first)));
    layers[2].push_back(float(mm * last_share));
  }
  return layers;
}
// w goes half as fast at the pia as in the mean, so that it is no length.
Place slow(const Place& p) {
  const double t = -p.z() / 2000.;
  return {p.x(), p.y(), -2000. * (.5 * t + .5 * t * t)};
}
double length_share(double w) { return .5 * w + .5 * w * w; }

TEST(Borders, LieWhereTheLayersWereMeasured) {
  const Elements elements = make_slab(2, slow);
  const Mesh surface = pia();
  const MeasuredBorders measured(elements, surface, shares_of(surface, thickness(surface)));
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const Borders borders = measured.of(elements, e);
    ASSERT_EQ(borders.size(), 3u);
    EXPECT_TRUE(measured.measured(elements, e));
    const Hexahedron h = elements.hexahedron(e);
    for (const double u : {0., 1.})
      for (const double v : {0., .3, 1.}) {
        const double x = h.at(u, v, 0.).x();
        EXPECT_NEAR(length_share(borders.end(u, v, 0)), first_share(x), 1e-3);
        EXPECT_NEAR(length_share(borders.end(u, v, 1)), 1. - last_share, 1e-3);
        EXPECT_EQ(borders.end(u, v, 2), 1.);
        EXPECT_EQ(borders.begin(u, v, 0), 0.);
        EXPECT_EQ(borders.begin(u, v, 2), borders.end(u, v, 1));
      }
    double sum = 0.;
    for (std::size_t l = 0; l < 3; ++l) {
      const auto [low, high] = borders.range(l);
      for (const double u : {0., .25, 1.}) {
        EXPECT_LE(low, borders.begin(u, .5, l));
        EXPECT_GE(high, borders.end(u, .5, l));
      }
      sum += borders.volume(h, l);
    }
    EXPECT_NEAR(sum / h.volume(), 1., 1e-12);
    // The mean of the first layer's share over the element, which is as wide everywhere.
    EXPECT_NEAR(borders.volume(h, 0) / h.volume(), first_share(h.at(.5, .5, 0.).x()), .005);
    EXPECT_NEAR(borders.volume(h, 2) / h.volume(), last_share, 1e-3);
    // Shares of volume are the same everywhere, which is not what was measured.
    const std::array depths{.4, .8, 1.};
    EXPECT_NEAR(Borders(Layers{}, depths).volume(h, 0) / h.volume(), length_share(.4), 1e-9);
  }
}

TEST(Borders, GoOnFromElementToElementWithoutAStep) {
  const Elements elements = make_slab(2, slow);
  const Mesh surface = pia();
  const MeasuredBorders measured(elements, surface, shares_of(surface, thickness(surface)));
  const Borders one = measured.of(elements, 1), next = measured.of(elements, 0);  // u runs against x
  ASSERT_EQ(elements.corners_of(1)[1] == elements.corners_of(0)[1], false);
  const auto a = elements.corners_of(0), b = elements.corners_of(1);
  ASSERT_EQ(a[1], b[0]);
  ASSERT_EQ(a[3], b[2]);
  for (const double v : {0., .2, .7, 1.})
    for (std::size_t l = 0; l < 3; ++l) EXPECT_EQ(next.end(1., v, l), one.end(0., v, l));
}

TEST(Borders, WhatIsNotMeasuredHasWhatTheNearestPlaceHas) {
  const Elements elements = make_slab(2, slow);
  const Mesh surface = pia();
  auto layers = thickness(surface);
  for (std::size_t v = 0; v < 25; ++v) {
    if (v % 5 == 3) layers[1][v] = NAN;
    if (v % 5 == 4) layers[0][v] = layers[1][v] = layers[2][v] = 0.f;
  }
  const LayerShares shares = shares_of(surface, layers);
  EXPECT_EQ(std::count(shares.measured.begin(), shares.measured.end(), 0), 10);
  for (const std::size_t v : {3, 4, 13, 24}) EXPECT_NEAR(shares.of_layers[0][v], first_share(500.), 1e-6);
  const MeasuredBorders measured(elements, surface, shares);
  std::size_t known = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) known += measured.measured(elements, e);
  EXPECT_LT(known, elements.size());
}

TEST(Borders, MapsThatCannotBeAreRefused) {
  const Elements elements = make_slab(2, slow);
  Mesh surface = pia();
  auto layers = thickness(surface);
  const LayerShares shares = shares_of(surface, layers);
  layers[2][7] = -1.f;
  EXPECT_THAT(refused([&] { shares_of(surface, layers); }),
              HasSubstr("layer 3 has a thickness of -1 at vertex 7"));
  for (auto& layer : layers) layer.assign(25, 0.f);
  EXPECT_THAT(refused([&] { shares_of(surface, layers); }), HasSubstr("give maps of thickness"));
  for (Vec3& p : surface.positions) p.x() += 3000.f;
  EXPECT_THAT(refused([&] { MeasuredBorders(elements, surface, shares); }),
              HasSubstr("9 of 9 corners of elements lie more than .3 mm from the surface of the maps"));
}

}  // namespace
}  // namespace forest::cortex
