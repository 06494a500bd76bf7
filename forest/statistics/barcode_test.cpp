// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/barcode.h"

#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/statistics/metric.h"

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

using Points = std::vector<Point>;
using testing::UnorderedElementsAre;

/// By the words of the definition: a branch goes on at a branch point when no tip beyond it is further out.
std::vector<Bar> plain_bars(const Arbors& a, std::uint32_t stem, Filtration filtration) {
  const Vec3 start = a.points(a.section(stem)).front().position();
  const double path_start = a.section(stem).path_distance - a.section(stem).length;
  std::vector<std::vector<std::uint32_t>> daughters(a.sections().size());
  for (std::uint32_t i = 0; i < a.sections().size(); ++i)
    if (a.section(i).parent >= 0) daughters[std::size_t(a.section(i).parent)].push_back(i);
  const auto distance = [&](std::uint32_t s) {
    const Point end = a.points(a.section(s)).back();
    return filtration == Filtration::path ? a.section(s).path_distance - path_start
                                          : (end.position().cast<double>() - start.cast<double>()).norm();
  };
  std::vector<Bar> bars;
  const std::function<double(std::uint32_t)> walk =
      [&](std::uint32_t s) {  // distance of the tip that goes on
        if (daughters[s].empty()) return distance(s);
        std::vector<double> tips;
        for (const std::uint32_t d : daughters[s]) tips.push_back(walk(d));
        std::ranges::sort(tips);
        for (std::size_t i = 0; i + 1 < tips.size(); ++i) bars.push_back({tips[i], distance(s)});
        return tips.back();
      };
  bars.push_back({walk(stem), 0.});
  return bars;
}

TEST(Barcodes, AreThoseOfTheDefinition) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Arbors a(specimen.morphology);
    for (const Filtration filtration : {Filtration::radial, Filtration::path}) {
      const Barcodes barcodes(a, filtration);
      ASSERT_EQ(barcodes.size(), a.stems().size());
      EXPECT_EQ(barcodes.bars().size(), specimen.tips);
      for (std::size_t i = 0; i < barcodes.size(); ++i) {
        if (specimen.name.starts_with("caterpillar")) continue;  // too deep to be walked
        std::vector<Bar> is(barcodes.of_arbor(i).begin(), barcodes.of_arbor(i).end());
        std::vector<Bar> expected = plain_bars(a, a.stems()[i], filtration);
        for (auto* bars : {&is, &expected})
          std::ranges::sort(*bars, {}, [](const Bar& b) { return std::pair(b.birth, b.death); });
        ASSERT_EQ(is.size(), expected.size());
        for (std::size_t k = 0; k < is.size(); ++k) {
          EXPECT_NEAR(is[k].birth, expected[k].birth, 1e-6 * (1. + expected[k].birth));
          EXPECT_NEAR(is[k].death, expected[k].death, 1e-6 * (1. + expected[k].death));
        }
      }
    }
  }
}

// A stem of 10 µm upwards, where a twig of 5 leaves it sideways; 20 further a tip of 10 and one of 40.
//
//        50──────────────┐ 40
//        path 70: 10+20+40, 40: 10+20+10, 15: 10+5
TEST(Barcodes, OfATreeWorkedByHand) {
  MorphologyBuilder b;
  const auto stem = b.add_section({}, SectionKind::basal, Points{{0, 0, 0, 1}, {0, 10, 0, 1}});
  b.add_section(stem, SectionKind::basal, Points{{5, 10, 0, 1}});
  const auto trunk = b.add_section(stem, SectionKind::basal, Points{{0, 30, 0, 1}});
  b.add_section(trunk, SectionKind::basal, Points{{0, 40, 0, 1}});
  b.add_section(trunk, SectionKind::basal, Points{{40, 30, 0, 1}});
  const Arbors a(b.build());
  const Barcodes path(a, Filtration::path), radial(a, Filtration::radial);
  EXPECT_THAT(path.bars(), UnorderedElementsAre(Bar{70., 0.}, Bar{40., 30.}, Bar{15., 10.}));
  EXPECT_THAT(radial.bars(), UnorderedElementsAre(Bar{50., 0.}, Bar{40., 30.}, Bar{std::sqrt(125.), 10.}));
  EXPECT_EQ(total_persistence(path.bars()), 70. + 10. + 5.);
  EXPECT_EQ(longest_bar(path.bars()), 70.);
  double h = 0.;
  for (const double share : {70. / 85., 10. / 85., 5. / 85.}) h -= share * std::log(share);
  EXPECT_NEAR(entropy(path.bars()), h, 1e-12);
  EXPECT_EQ(find_metric("tmd_path_long_bars")->values(a), std::vector{2.});  // at least 7 µm
}

TEST(Barcodes, ByPathAddUpToThePathLengthOfTheTree) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    const Arbors a(zoo_parts::random_tree(seed, 200));
    double length = 0.;
    for (const Branch& b : a.sections()) length += b.length;
    EXPECT_NEAR(total_persistence(Barcodes(a, Filtration::path).bars()), length, 1e-9 * length);
  }
}

TEST(Barcodes, EntropyIsThatOfTheShares) {
  EXPECT_EQ(entropy(std::vector{Bar{7., 0.}}), 0.);
  EXPECT_NEAR(entropy(std::vector{Bar{7., 0.}, Bar{8., 1.}, Bar{1., 8.}}), std::log(3.), 1e-12);
  EXPECT_TRUE(std::isnan(entropy({})));
  EXPECT_TRUE(std::isnan(entropy(std::vector{Bar{7., 7.}})));
}

}  // namespace
}  // namespace forest::statistics
