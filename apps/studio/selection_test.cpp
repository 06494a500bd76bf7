// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/selection.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "forest/core/random.h"
#include "forest/morphology/measure.h"
#include "forest/scene/view.h"

#include "tests/sample_forest.h"

namespace forest::studio {
namespace {

class SelectionOfSample : public ::testing::Test {
 protected:
  circuit::Circuit circuit = testing::sample_circuit();
  std::vector<Morphology> neurons = testing::sample_neurons();
  scene::Forest forest = scene::Forest::from_bytes(scene::pack(circuit, neurons));
  Random random{3};

  // Some segment of some neuron.
  scene::Pick any() {
    scene::Pick pick;
    pick.instance = random.below(std::uint32_t(forest.instances().size()));
    const scene::Neuron& n = forest.neurons()[forest.instances()[pick.instance].morphology];
    const std::uint32_t segment = random.below(n.original_count);
    pick.segment = n.first_segment + segment;
    pick.section = forest.section_of_segment()[n.first_original + segment];
    return pick;
  }
  const Morphology& morphology(const scene::Pick& pick) const {
    return neurons[circuit.instances[pick.instance].morphology];
  }
};

TEST_F(SelectionOfSample, FactsAreThoseOfTheMorphology) {
  for (int i = 0; i < 200; ++i) {
    const scene::Pick pick = any();
    const auto json = to_json(forest, select(forest, pick));
    EXPECT_EQ(json["neuron"], pick.instance);
    EXPECT_EQ(json["type"], circuit.types[circuit.instances[pick.instance].type].name);
    EXPECT_EQ(json["layer"], circuit.layers[circuit.instances[pick.instance].layer].name);
    if (pick.section == scene::soma_section) {
      EXPECT_EQ(json["kind"], "soma");
      EXPECT_FALSE(json.contains("order"));
      continue;
    }
    const Morphology& m = morphology(pick);
    const SectionId id(pick.section);
    EXPECT_EQ(json["section"], pick.section);
    EXPECT_EQ(json["kind"], name_of(m.section(id).kind));
    EXPECT_EQ(json["order"], m.order(id));
    EXPECT_EQ(json["daughters"], m.children(id).size());
    EXPECT_NEAR(json["length"].get<double>(), section_length(m, id), 1e-2);
    EXPECT_NEAR(json["diameter_end"].get<double>(), 2. * double(m.points(id).back().radius), 1e-2);
    if (m.section(id).parent.valid())
      EXPECT_EQ(json["parent"], m.section(id).parent.value());
    else
      EXPECT_EQ(json["parent"], "soma");
  }
}

TEST_F(SelectionOfSample, SubarborCountsAreThoseOfAWalkOverDaughters) {
  for (int i = 0; i < 100; ++i) {
    const scene::Pick pick = any();
    if (pick.section == scene::soma_section) continue;
    const Morphology& m = morphology(pick);
    std::vector<SectionId> open{SectionId(pick.section)};
    std::size_t sections = 0, tips = 0;
    double sum = 0.;
    while (!open.empty()) {
      const SectionId id = open.back();
      open.pop_back();
      ++sections;
      tips += m.is_terminal(id);
      sum += section_length(m, id);
      open.insert(open.end(), m.children(id).begin(), m.children(id).end());
    }
    const auto json = to_json(forest, select(forest, pick));
    EXPECT_EQ(json["subarbor_sections"], sections);
    EXPECT_EQ(json["subarbor_tips"], tips);
    EXPECT_NEAR(json["subarbor_length"].get<double>(), sum, 1e-3 * sum + 1e-2);
  }
}

TEST_F(SelectionOfSample, PanelAndJsonTellTheSame) {
  for (int i = 0; i < 50; ++i) {
    const Selection selection = select(forest, any());
    EXPECT_EQ(facts(forest, selection).size() + 1,
              to_json(forest, selection).size());  // JSON has the segment, too
  }
}

TEST_F(SelectionOfSample, ParentsLeadToTheSoma) {
  for (int i = 0; i < 50; ++i) {
    std::optional<scene::Pick> pick = any();
    int steps = pick->section == scene::soma_section ? -1 : morphology(*pick).order(SectionId(pick->section));
    while (pick->section != scene::soma_section) {
      const auto parent = parent_of(forest, *pick);
      ASSERT_TRUE(parent);
      if (parent->section != scene::soma_section) --steps;
      pick = parent;
    }
    EXPECT_EQ(steps, steps < 0 ? -1 : 0);
    EXPECT_FALSE(parent_of(forest, *pick));
    EXPECT_NEAR(forest.segments()[pick->segment].ax, 0.f, 1e-3f);  // the soma is at the neuron's origin
  }
}

TEST_F(SelectionOfSample, HighlightHoldsTheBranchesAndTheSectionIsMarkedApart) {
  for (int i = 0; i < 50; ++i) {
    const Selection selection = select(forest, any());
    const auto marks = highlight(forest, selection);
    ASSERT_EQ(marks.size(), selection.subarbor.size());
    const Sphere sphere = around(forest, selection);
    std::size_t section = 0;
    for (const frame::Overlay& mark : marks) {
      section += mark.colour == scene::section_entry;
      EXPECT_LE((mark.a - sphere.centre).norm(), sphere.radius * 1.001f + .01f);
      EXPECT_LE((mark.b - sphere.centre).norm(), sphere.radius * 1.001f + .01f);
    }
    EXPECT_GE(section, 1u);
    const RoundCone picked = scene::in_world(forest, selection.pick.instance, selection.pick.segment);
    EXPECT_TRUE(std::ranges::any_of(marks, [&](const frame::Overlay& mark) {
      return mark.colour == scene::section_entry && mark.a == picked.a && mark.b == picked.b &&
             mark.radius > std::max(picked.radius_a, picked.radius_b);
    }));
  }
}

}  // namespace
}  // namespace forest::studio
