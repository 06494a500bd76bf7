// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/persistence_image.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

std::vector<Bars> cells(std::uint64_t seed, std::size_t count, double further) {
  std::vector<Bars> cells(count);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    for (int k = 0; k < 10; ++k) {
      const double birth = further * random.uniform(50., 200.);
      cells[i].push_back({birth, random.uniform(0., .8 * birth)});
    }
  }
  return cells;
}

std::vector<Bars> both(std::vector<Bars> a, const std::vector<Bars>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(PersistenceImages, WeighEveryCellAlike) {
  const PersistenceImages p = persistence_images(std::vector<Bars>{{{100, 0}}, {{50, 0}, {60, 20}}, {}});
  EXPECT_NEAR(p.reach, 98., 1e-9);  // 95 of 100 between the two cells that have bars
  EXPECT_NEAR(p.images.row(0).sum(), 1., 1e-12);
  EXPECT_NEAR(p.images.row(1).sum(), 1., 1e-12);
  EXPECT_EQ(p.images.row(2).sum(), 0.);
  Eigen::Index pixel = 0;
  p.images.row(0).maxCoeff(&pixel);
  EXPECT_EQ(pixel % p.side, p.side - 1);  // birth at the end of its axis
  EXPECT_EQ(pixel / p.side, 0);           // death at the start of its own
}

// One tip that is ten times as far as all others must not press all others into a corner.
TEST(PersistenceImages, AreNotDecidedByOneCell) {
  std::vector<Bars> far = both(cells(1, 30, 1.), cells(2, 30, 1.5));
  const double before = barcode_distance(persistence_images(far), 30, 99, 1).distance;
  far[3].push_back({5000., 0.});
  EXPECT_NEAR(barcode_distance(persistence_images(far), 30, 99, 1).distance, before, .1 * before);
  EXPECT_NEAR(persistence_images(far).images.row(3).sum(), 1., 1e-9);
}

TEST(BarcodeDistance, IsNothingForTheSameAndOneForWhatNeverMeets) {
  const auto some = cells(1, 5, 1.);
  EXPECT_NEAR(barcode_distance(persistence_images(both(some, some)), 5, 99, 1).distance, 0., 1e-12);
  const std::vector<Bars> apart{{{10, 0}}, {{10, 0}}, {{1000, 900}}, {{1000, 900}}};
  EXPECT_NEAR(barcode_distance(persistence_images(apart), 2, 99, 1).distance, 1., 1e-6);
  EXPECT_EQ(barcode_distance(persistence_images(some), 0, 99, 1).p, 1.);
  EXPECT_EQ(barcode_distance(persistence_images(std::vector<Bars>(6)), 3, 99, 1).p, 1.);
}

TEST(BarcodeDistance, SeesLongerBranches) {
  EXPECT_LE(barcode_distance(persistence_images(both(cells(1, 20, 1.), cells(2, 20, 1.5))), 20, 199, 1).p,
            .01);
  int rejected = 0;
  for (std::uint64_t trial = 0; trial < 100; ++trial)
    rejected +=
        barcode_distance(persistence_images(both(cells(100 + trial, 10, 1.), cells(900 + trial, 10, 1.))), 10,
                         99, 1)
            .p <= .05;
  EXPECT_LE(rejected, 14);
}

}  // namespace
}  // namespace forest::statistics
