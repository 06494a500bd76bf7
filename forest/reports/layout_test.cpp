// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/layout.h"

#include <algorithm>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/morphology/measure.h"
#include "forest/reports/synthetic.h"

#include "tests/zoo.h"

namespace forest::reports {
namespace {

using testing::ElementsAre;

/// One neuron of this shape, reported with these elements (and places).
Match match_of(const Morphology& m, std::vector<std::uint32_t> elements, std::vector<float> positions = {}) {
  circuit::Circuit c;
  c.morphologies = {"one"};
  c.instances = {{}};
  const Report report{.source = "report.h5",
                      .populations = {c.name},
                      .nodes = {{0, 0}},
                      .first_column = {0, elements.size()},
                      .element_ids = std::move(elements),
                      .element_positions = std::move(positions),
                      .read = {}};
  Report steps = report;
  steps.steps = 1;
  return match(steps, c, std::vector<Morphology>{m}, nodes_of(c));
}

/// Stem of 10 µm; daughters of 10 (1) and 30 µm (2); 1 has a daughter of 40 µm (3); an axon of 5 µm (4).
Morphology fork() {
  MorphologyBuilder b;
  b.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 5}}, .parents = {}, .contour_starts = {}});
  using Points = std::vector<Point>;
  const auto stem = b.add_section({}, SectionKind::apical, Points{{0, 5, 0, 1}, {0, 15, 0, 1}}, 4, 0);
  const auto one = b.add_section(stem, SectionKind::apical, Points{{10, 15, 0, 1}});
  b.add_section(stem, SectionKind::apical, Points{{-30, 15, 0, 1}});
  b.add_section(one, SectionKind::basal, Points{{50, 15, 0, 1}});
  b.add_section({}, SectionKind::axon, Points{{0, -5, 0, 1}, {0, -10, 0, 1}}, 2, 0);
  return b.build();
}

TEST(Elements, AreAxonThenBasalThenApicalThenTheRestEachInTheOrderOfTheFile) {
  std::vector<std::uint32_t> order;
  for (const SectionId id : sections_of_elements(fork())) order.push_back(id.value());
  EXPECT_THAT(order, ElementsAre(4, 3, 0, 1, 2));
}

TEST(Layout, FollowsTheLongestPath) {
  const Match m = match_of(fork(), {0, 1, 2, 3, 4, 5});
  const Layout& layout = m.layouts.at(0);
  std::vector<std::uint32_t> sections, elements, columns;
  for (const SectionRun& run : layout.sections)
    sections.push_back(run.section), elements.push_back(run.element);
  for (const Compartment& c : layout.compartments) columns.push_back(c.column);
  EXPECT_THAT(sections,
              ElementsAre(soma_run, 0, 1, 3, 2, 4));  // the path of 60 µm goes on, that of 40 is a branch
  EXPECT_THAT(elements, ElementsAre(0, 3, 4, 2, 5, 1));
  EXPECT_THAT(columns, ElementsAre(0, 3, 4, 2, 5, 1));
  EXPECT_THAT(layout.branches, ElementsAre(1, 4, 5, 6));
  EXPECT_EQ(layout.soma, 0u);
  EXPECT_EQ(layout.compartments[0].weight, 100u);  // the soma's diameter
  EXPECT_EQ(layout.compartments[3].weight, 400u);
}

TEST(Layout, SortsCompartmentsOfASectionByPlace) {
  const Match m = match_of(fork(), {2, 0, 2, 2}, {.75f, .5f, .25f, 1.f});
  const Layout& layout = m.layouts.at(0);
  std::vector<std::uint32_t> columns;
  for (const Compartment& c : layout.compartments) columns.push_back(c.column);
  EXPECT_THAT(columns, ElementsAre(1, 2, 0, 3));
  EXPECT_EQ(layout.compartments[1].weight, 133u);
  const Match even = match_of(fork(), {2, 2});  // no places told
  EXPECT_FLOAT_EQ(even.layouts[0].compartments[0].position, .25f);
  EXPECT_FLOAT_EQ(even.layouts[0].compartments[1].position, .75f);
}

TEST(Layout, WithoutSomaTakesTheCompartmentNearestToIt) {
  const Match m = match_of(fork(), {2, 5, 3, 3}, {.5f, .5f, .9f, .1f});
  const Layout& layout = m.layouts.at(0);
  EXPECT_EQ(layout.compartments[layout.soma].column, 3u);
}

TEST(Layout, OfEveryNeuronOfTheZooHasEachColumnOnce) {
  for (const Specimen& specimen : zoo()) {
    circuit::Circuit c;
    c.morphologies = {"one"};
    c.instances = {{}, {}};
    const std::vector<Morphology> all{specimen.morphology};
    const Report report = synthetic_report(c, all, {.compartments = 300, .steps = 2});
    const Match m = match(report, c, all, nodes_of(c));
    ASSERT_EQ(m.layouts.size(), 1u) << specimen.name;  // shared by both
    const Layout& layout = m.layouts[0];
    std::vector<std::uint32_t> columns;
    for (const Compartment& compartment : layout.compartments) {
      columns.push_back(compartment.column);
      ASSERT_GE(compartment.weight, 1u);
    }
    std::ranges::sort(columns);
    std::vector<std::uint32_t> wanted(report.first_column[1]);
    std::iota(wanted.begin(), wanted.end(), 0u);
    ASSERT_EQ(columns, wanted) << specimen.name;
    ASSERT_EQ(layout.sections.size(), specimen.sections + 1) << specimen.name;
    ASSERT_EQ(layout.branches.size(), 1 + (specimen.sections ? specimen.tips : 0)) << specimen.name;
  }
}

}  // namespace
}  // namespace forest::reports
