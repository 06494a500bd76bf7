// SPDX-License-Identifier: Apache-2.0
// The grammars of glia grow cells like the published ones; what each figure is from is said at the head of the grammar.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/io/format.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/validate.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/real_data.h"

namespace forest {
namespace {

std::vector<Morphology> grown(const std::string& name, std::size_t count) {
  return lsystem::grow_population(lsystem::parse_file(FOREST_SOURCE_DIR "/data/grammars/" + name + ".lsys"),
                                  count, 1906);
}

std::vector<double> values(const std::vector<Morphology>& cells, const char* metric) {
  std::vector<double> out;
  for (const Morphology& m : cells)
    out.push_back(statistics::mean(statistics::find_metric(metric)->values(statistics::Arbors(m))));
  return out;
}

struct Figure {
  const char* metric;
  double mean, apart;  // published, and how far the grown mean may lie from it
};

void expect_figures(const std::vector<Morphology>& cells, std::initializer_list<Figure> figures) {
  for (const Figure& f : figures)
    EXPECT_NEAR(statistics::mean(values(cells, f.metric)), f.mean, f.apart) << f.metric;
}

// Their mean within the deviation of the others.
void expect_like(const std::vector<Morphology>& cells, const std::vector<Morphology>& others,
                 std::initializer_list<const char*> metrics) {
  for (const char* metric : metrics) {
    const auto wanted = values(others, metric);
    EXPECT_NEAR(statistics::mean(values(cells, metric)), statistics::mean(wanted),
                statistics::summarize(wanted).sd)
        << metric;
  }
}

TEST(Glia, MicrogliaHaveThePublishedFigures) {
  const auto cells = grown("microglia", 100);
  expect_figures(cells, {{"number_of_neurites", 3.25, .6},
                         {"number_of_leaves", 94., 18.},
                         {"number_of_bifurcations", 87., 17.},
                         {"total_length", 1043., 215.},
                         {"section_term_lengths", 6.1, .5},
                         {"section_bif_lengths", 5.2, .6},
                         {"contraction", .893, .013},
                         {"partition_asymmetry", .62, .05},
                         {"max_radial_distance", 50., 7.7},
                         {"sholl_maximum", 20.7, 6.5},
                         {"sholl_critical_radius", 20., 6.},  // 15 µm in rats, 26 µm in the traced cells
                         {"segment_radii", .38, .04}});
  for (const Morphology& m : cells) {
    EXPECT_TRUE(
        std::ranges::all_of(m.sections(), [](const Section& s) { return s.kind == SectionKind::glia; }));
    EXPECT_GE(m.roots().size(), 2u);
    EXPECT_LE(m.roots().size(), 5u);
  }
}

TEST(Glia, AstrocytesHaveThePublishedFigures) {
  const auto cells = grown("astrocyte", 40);
  expect_figures(cells, {{"total_width", 56., 5.},  // 56.0 ± 2.0 µm across
                         {"total_height", 56., 5.},
                         {"total_depth", 56., 5.},
                         {"hull_volume", 66e3, 9e3},  // µm³
                         {"number_of_leaves", 1410., 140.},
                         {"total_length", 4000., 700.},
                         {"partition_asymmetry", .587, .03},
                         {"sholl_maximum", 113., 35.},
                         {"soma_radius", 5.3, .4}});
  for (const Morphology& m : cells) {
    EXPECT_GE(m.roots().size(), 4u);  // main processes
    EXPECT_LE(m.roots().size(), 8u);
    const double reach = statistics::mean(values({m}, "max_radial_distance"));
    EXPECT_GE(reach, 25.);  // soma and 20 to 30 µm of processes
    EXPECT_LE(reach, 40.);
  }
}

// A sponge: three of four places of the territory are near a process, in all directions.
TEST(Glia, AstrocytesFillTheirTerritory) {
  int near = 0, asked = 0;
  for (const Morphology& m : grown("astrocyte", 8)) {
    Random random(3, 1);
    for (int i = 0; i < 200; ++i, ++asked) {
      const Vec3 to(float(random.normal()), float(random.normal()), float(random.normal()));
      const Vec3 at =
          to.normalized() *
          (8.f + 14.f * float(std::cbrt(random.uniform())));  // beyond the soma, within the border
      near +=
          std::ranges::any_of(m.points(), [&](const Point& p) { return (p.position() - at).norm() < 5.f; });
    }
  }
  EXPECT_GT(near, .68 * asked);
}

TEST(Glia, AreSound) {
  for (const char* name : {"astrocyte", "microglia"})
    for (const Morphology& m : grown(name, 5))
      for (const Finding& f : validate(m))
        EXPECT_EQ(f.severity, Severity::note) << name << ": " << f.sentence;
}

TEST(Glia, MicrogliaAreLikeTheTracedOnes) {
  FOREST_REAL_DATA(folder, "morphologies/glia/mouse_microglia__morphomics");
  std::vector<Morphology> traced;
  for (const auto& file : files_below(folder, ".swc")) traced.push_back(io::read(file).morphology);
  ASSERT_EQ(traced.size(), 12u);
  const auto cells = grown("microglia", 60);
  expect_like(cells, traced,
              {"number_of_neurites", "number_of_leaves", "total_length", "max_radial_distance",
               "max_path_distance", "section_term_lengths", "section_bif_lengths", "contraction",
               "partition_asymmetry", "sholl_maximum", "hull_volume"});
}

TEST(Glia, AstrocytesAreAsManyTipsAndAsLongAsThoseOfACircuit) {
  FOREST_REAL_DATA(folder, "morphologies/glia/astrocyte_h5__bbp");
  std::vector<Morphology> others;
  for (const auto& file : files_below(folder, ".h5")) others.push_back(io::read(file).morphology);
  ASSERT_EQ(others.size(), 5u);
  const auto cells = grown("astrocyte", 20);
  expect_like(cells, others, {"number_of_leaves", "total_length", "total_width", "sholl_maximum"});
}

}  // namespace
}  // namespace forest
