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
    ASSERT_GE(marks.size(), selection.subarbor.size());
    const Sphere sphere = around(forest, selection);
    std::size_t section = 0;
    for (const frame::Overlay& mark : marks) {
      section += mark.colour == scene::section_entry;
      EXPECT_LE((mark.a - sphere.centre).norm(), sphere.radius * 1.001f + .01f);
      EXPECT_LE((mark.b - sphere.centre).norm(), sphere.radius * 1.001f + .01f);
    }
    EXPECT_GE(section, 1u);
    const RoundCone picked = scene::in_world(forest, selection.pick.instance, selection.pick.segment);
    // Of both ends of the branch: no thinner than it is there, and hardly thicker.
    const auto as_wide = [](float mark, float branch) {
      return mark > branch && mark < 1.1f * branch + .02f;
    };
    EXPECT_TRUE(std::ranges::any_of(marks, [&](const frame::Overlay& mark) {
      return mark.colour == scene::section_entry && mark.a == picked.a &&
             as_wide(mark.radius, picked.radius_a);
    }));
    EXPECT_TRUE(std::ranges::any_of(marks, [&](const frame::Overlay& mark) {
      return mark.colour == scene::section_entry && (mark.b - picked.b).norm() < 1e-3f &&
             as_wide(mark.radius, picked.radius_b);
    }));
  }
}

TEST(Marks, TaperAsTheirBranchDoes) {
  const RoundCone branch{{0, 0, 0}, {10, 0, 0}, 2.f, .5f};
  std::vector<frame::Overlay> marks;
  add_marks(branch, 7, marks);
  ASSERT_GT(marks.size(), 5u);
  EXPECT_EQ(marks.front().a, branch.a);
  EXPECT_LT((marks.back().b - branch.b).norm(), 1e-4f);
  for (std::size_t i = 0; i < marks.size(); ++i) {
    EXPECT_EQ(marks[i].colour, 7u);
    EXPECT_NEAR(marks[i].radius, 2.f - .15f * marks[i].a.x(), 1e-3f);
    EXPECT_LT((marks[i].a - (i ? marks[i - 1].b : branch.a)).norm(), 1e-4f);  // without gaps
  }
  marks.clear();
  add_marks({{0, 0, 0}, {1, 0, 0}, 1.f, 1.f}, 7, marks);
  EXPECT_EQ(marks.size(), 1u);  // what does not taper is one
}

TEST_F(SelectionOfSample, ASpineIsItsSection) {
  scene::Skin skin(forest);
  std::size_t met = 0;
  for (std::uint32_t i = 0; i < forest.instances().size() && met < 20; ++i) {
    const std::uint32_t own = forest.instances()[i].morphology;
    const scene::Neuron& neuron = forest.neurons()[own];
    const auto& instance = forest.instances()[i];
    const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
    const auto& spines = skin.spines(own);
    if (spines.empty()) continue;
    const scene::Spine& spine = spines[random.below(std::uint32_t(spines.size()))];
    const Vec3 at(instance.x, instance.y, instance.z), tip = at + turn * spine.tip,
                                                       away = (tip - at - turn * spine.base).normalized();
    frame::Camera camera;
    camera.target = tip, camera.eye = tip + 12.f * away, camera.up = away.unitOrthogonal();
    const frame::Viewport viewport{1000, 700};
    const auto all = [](std::uint32_t) { return true; };
    const auto pick = pick_spine(skin, forest, camera, viewport, {500, 350}, all);
    ASSERT_TRUE(pick);
    if (pick->distance < 11.) continue;  // another one stands before it
    ++met;
    EXPECT_EQ(pick->instance, i);
    EXPECT_EQ(pick->segment, neuron.first_segment + spine.segment);
    EXPECT_EQ(pick->section, forest.section_of_segment()[neuron.first_original + spine.segment]);
    EXPECT_FALSE(pick_spine(skin, forest, camera, viewport, {500, 350}, [](std::uint32_t) { return false; }));
    camera.eye = tip + 300.f * away;  // too far for spines to be drawn
    EXPECT_FALSE(pick_spine(skin, forest, camera, viewport, {500, 350}, all));
  }
  EXPECT_GT(met, 0u);
}

}  // namespace
}  // namespace forest::studio
