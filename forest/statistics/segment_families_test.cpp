// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/segment_families.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

// A stem of 20 µm along y that thins from 4 to 2 µm and forks in the x-y plane: 30° to one side, 2 µm thick, and 60° to the
// other, 1 µm thick, each 20 µm. The thicker forks again in a plane a quarter turn from the first, 45° to both sides.
Morphology forked() {
  const auto at = [](double x, double y, double z, double r) {
    return Point{float(x), float(y), float(z), float(r)};
  };
  const double c = std::cos(M_PI / 6), s = std::sin(M_PI / 6), q = std::sqrt(.5);
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  const auto stem = b.add_section({}, SectionKind::basal, std::vector{at(0, 5, 0, 2), at(0, 25, 0, 1)}, 3, 0);
  const auto big =
      b.add_section(stem, SectionKind::basal, std::vector{at(0, 25, 0, 1), at(20 * s, 25 + 20 * c, 0, 1)});
  b.add_section(stem, SectionKind::basal, std::vector{at(0, 25, 0, .5), at(-20 * c, 25 + 20 * s, 0, .5)});
  const double x = 20 * s, y = 25 + 20 * c;
  for (const double side : {1., -1.})
    b.add_section(
        big, SectionKind::basal,
        std::vector{at(x, y, 0, .5), at(x + 30 * q * s, y + 30 * q * c, side * 30 * q, side > 0 ? .5 : .25)});
  return b.build();
}

const Quantity& quantity(const SegmentValues& v, std::string_view name) {
  return *std::ranges::find(v.quantities, name, &Quantity::name);
}

TEST(SegmentFamilies, AreWhatAPencilSays) {
  const SegmentValues v = segment_values(std::vector{forked()});
  EXPECT_EQ(v.forks, (std::vector<char>{1, 1, 0, 0, 0}));
  EXPECT_NEAR(v.places[1][0], 1., 0);
  EXPECT_NEAR(v.places[1][1], 40., 1e-4);
  EXPECT_NEAR(v.places[1][3], 25 + 20 * std::cos(M_PI / 6), 1e-4);
  EXPECT_EQ(quantity(v, "length_of_nonterminal_segments").values.size(), 2u);
  EXPECT_NEAR(quantity(v, "length_of_terminal_segments").values[1], 30., 1e-4);
  EXPECT_NEAR(quantity(v, "angle_of_thicker_daughter").values[0], 30., 1e-3);
  EXPECT_NEAR(quantity(v, "angle_of_thinner_daughter").values[0], 60., 1e-3);
  EXPECT_NEAR(quantity(v, "amplitude").values[1], 90., 1e-3);
  ASSERT_EQ(quantity(v, "torque").values.size(), 1u);
  EXPECT_NEAR(std::abs(quantity(v, "torque").values[0]), 90., 1e-3);
  EXPECT_NEAR(quantity(v, "stem_diameter").values[0], 4., 1e-6);
  EXPECT_NEAR(quantity(v, "taper").values[0], 0.1, 1e-6);
  EXPECT_NEAR(quantity(v, "daughter_ratio").values[0], 2., 1e-6);
  EXPECT_NEAR(quantity(v, "daughter_ratio").values[1], 2., 1e-6);
  EXPECT_EQ(quantity(v, "parent_daughter_ratio").values.size(), 4u);
  for (const double turn : quantity(v, "turn").values) EXPECT_NEAR(turn, 0., 1e-2);
  for (const double c : quantity(v, "contraction").values) EXPECT_NEAR(c, 1., 1e-6);
}

TEST(SegmentFamilies, AnyNeuronHasThem) {
  std::vector<Morphology> cells;
  for (const Specimen& s : zoo()) cells.push_back(s.morphology);
  for (const Given given : {Given::nothing, Given::order, Given::path, Given::radius, Given::height}) {
    const SegmentFamilies f =
        segment_families(cells, {.kinds = KindSet::all(), .given = given, .fit = {.replicates = 0}});
    EXPECT_EQ(f.cells, cells.size());
    EXPECT_EQ(f.tables.size(), 4u);
    for (const auto& [name, text] : f.texts()) {
      EXPECT_TRUE(text.find("distribution " + name) != text.npos ||
                  text.find("function " + name) != text.npos)
          << text;
      EXPECT_EQ(text.find("nan"), text.npos) << text;
    }
    EXPECT_EQ(given_of(name_of(given)), given);
  }
  const SegmentFamilies none = segment_families({}, {});
  EXPECT_EQ(none.sections, 0u);
  EXPECT_TRUE(none.texts().empty());
  EXPECT_FALSE(given_of("mood"));
}

TEST(SegmentFamilies, FindWhatATreeWasMadeWith) {
  // Sections fork with a chance of 0.8, 0.5, 0.2, 0 by order; their lengths are gamma.
  std::vector<Morphology> cells;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, 0, 3);
    MorphologyBuilder b;
    b.set_soma(zoo_parts::sphere(5));
    struct Growing {
      SectionId id;
      Vec3 end;
      int order;
    };
    std::vector<Growing> growing;
    for (int i = 0; i < 5; ++i) growing.push_back({{}, Vec3(5, 0, 0), 0});
    while (!growing.empty()) {
      const Growing g = growing.back();
      growing.pop_back();
      const Vec3 end =
          g.end +
          float(random.gamma(4, 20)) *
              Vec3(float(random.normal()), float(random.normal()), float(random.normal())).normalized();
      const std::vector<Point> points{{g.end.x(), g.end.y(), g.end.z(), 1}, {end.x(), end.y(), end.z(), 1}};
      const SectionId id = b.add_section(g.id, SectionKind::basal, points, 3, g.id.valid() ? -1 : 0);
      if (random.uniform() < 0.8 - 0.3 * g.order && g.order < 3)
        for (int k = 0; k < 2; ++k) growing.push_back({id, end, g.order + 1});
    }
    cells.push_back(b.build());
  }
  const SegmentFamilies f = segment_families(cells, {.fit = {.replicates = 19}});
  const auto& by_order = f.tables[0].bins;
  ASSERT_EQ(by_order.size(), 4u);
  for (int order = 0; order < 4; ++order) {
    const ParameterEstimate& chance = by_order[std::size_t(order)].chance;
    EXPECT_EQ(by_order[std::size_t(order)].upper, order);
    EXPECT_LE(chance.lower, std::max(0., 0.8 - 0.3 * order) + 0.02);
    EXPECT_GE(chance.upper, std::max(0., 0.8 - 0.3 * order) - 0.02);
  }
  const FittedQuantity& length = f.quantities[1];
  EXPECT_EQ(length.name, "length_of_terminal_segments");
  EXPECT_EQ(length.fit.name, "gamma");
  EXPECT_NEAR(length.fit.distribution.components[0].parameters[0], 4., 0.8);
  EXPECT_NEAR(length.fit.distribution.quantile(0.5), 73.4, 5.);
  const FittedQuantity& ratios = f.quantities[10];
  EXPECT_EQ(ratios.name, "daughter_ratio");
  EXPECT_EQ(ratios.fit.distribution.expression(), "1");
}

}  // namespace
}  // namespace forest::statistics
