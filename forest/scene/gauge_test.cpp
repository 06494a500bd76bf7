// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/gauge.h"

#include <bit>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/half.h"
#include "forest/morphology/measure.h"
#include "forest/scene/colour_bar.h"
#include "forest/scene/gallery.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

constexpr ColourBy gauged[] = {ColourBy::order, ColourBy::radius, ColourBy::distance};

Forest sample(std::size_t count = 40) {
  return Forest::from_bytes(pack(testing::sample_circuit(count), testing::sample_neurons()));
}

Colouring coloured(const Forest& forest, ColourBy by, std::vector<Appearance> targets = {}) {
  View view;
  view.colour_by = by, view.targets = std::move(targets);
  return colour(Targets(forest), view);
}

// Found the long way: along the neuron itself.
float expected(const Morphology& neuron, ColourBy by, const reports::Place& place) {
  const SectionId id(place.section);
  if (by == ColourBy::order) return float(neuron.order(id));
  float before = 0.f;
  for (SectionId s = neuron.section(id).parent; s.valid(); s = neuron.section(s).parent)
    before += float(section_length(neuron, s));
  return before + place.position * float(section_length(neuron, id));
}

TEST(Gauge, IsWhatTheBranchMeasuresInTheMiddleOfEverySegmentAtAnyLevelOfDetail) {
  const std::vector<Morphology> neurons = testing::sample_neurons();
  const Forest forest = sample();
  for (const ColourBy by : {ColourBy::order, ColourBy::distance}) {
    const Gauge gauge = gauge_of(forest, by);
    const float step = gauge.high / float(Gauge::steps - 1);
    float most = 0.f;
    for (std::size_t n = 0; n < neurons.size(); ++n) {
      const Neuron& neuron = forest.neurons()[n];
      for (std::uint32_t i = neuron.first_segment; i < end_of(forest, neuron); ++i) {
        const reports::Place& place = forest.places()[i];
        ASSERT_EQ(gauge.step[i] == Gauge::none, place.section == soma_section);
        if (place.section == soma_section) continue;
        const float value = expected(neurons[n], by, place);
        EXPECT_NEAR(float(gauge.step[i]) * step, value, .51f * step + 1e-3f * value);
        most = std::max(most, value);
      }
    }
    EXPECT_GE(gauge.high, .999f * most);
    EXPECT_LT(gauge.high, 1.15f * most + 1.f);
    EXPECT_FALSE(gauge.above);
  }
}

TEST(Gauge, RadiiAreThoseOfOriginalSegmentsHoweverWideCoarseOnesAreDrawn) {
  const Forest forest = sample();
  const Gauge gauge = gauge_of(forest, ColourBy::radius);
  const float step = gauge.high / float(Gauge::steps - 1);
  for (const Neuron& neuron : forest.neurons()) {
    const auto radius = [&](std::uint32_t i) {
      const std::uint32_t radii = forest.segments()[i].radii;
      return .5f * (from_half(radii & 0xffffu) + from_half(radii >> 16));
    };
    for (std::uint32_t i = neuron.first_segment; i < end_of(forest, neuron); ++i) {
      if (gauge.step[i] == Gauge::none) continue;
      const float shown = float(gauge.step[i]) * step;
      if (i < neuron.first_segment + neuron.original_count) {
        EXPECT_NEAR(shown, std::min(radius(i), gauge.high), .51f * step);
        continue;
      }
      const auto& place = forest.places()[i];
      float least = INFINITY, most = 0.f;  // of its section
      for (std::uint32_t k = neuron.first_segment; k < neuron.first_segment + neuron.original_count; ++k)
        if (forest.places()[k].section == place.section)
          least = std::min(least, radius(k)), most = std::max(most, radius(k));
      EXPECT_GE(shown, std::min(least, gauge.high) - .51f * step);
      EXPECT_LE(shown, most + .51f * step);
    }
  }
}

TEST(Gauge, NearlyAllRadiiAreWithinItsRangeAndItSaysWhereSomeAreNot) {
  MorphologyBuilder builder;  // a thick stem of a hundredth of the length
  builder.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 8}}, .parents = {}, .contour_starts = {}});
  const SectionId stem =
      builder.add_section({}, SectionKind::basal, std::vector<Point>{{8, 0, 0, 9}, {18, 0, 0, 9}});
  builder.add_section(stem, SectionKind::basal, std::vector<Point>{{18, 0, 0, 1}, {518, 0, 0, 1}});
  builder.add_section(stem, SectionKind::basal, std::vector<Point>{{18, 0, 0, 1}, {18, 500, 0, 1}});
  const std::vector<Morphology> neurons{builder.build()};
  const Gauge gauge = gauge_of(gallery(neurons, {"one"}, 1.5f), ColourBy::radius);
  EXPECT_LT(gauge.high, 1.2f);
  EXPECT_TRUE(gauge.above);
}

// The entries of all that a cut draws, with their segments, instances and kinds.
void each_entry(const Forest& forest, const Cut& cut, auto&& take) {
  const auto list = [&](const std::vector<frame::Item>& items, const std::vector<std::uint8_t>& entries,
                        std::size_t each) {
    ASSERT_EQ(entries.size(), items.size() * each);
    for (std::size_t i = 0; i < items.size(); ++i)
      for (std::uint32_t drawn = items[i].drawn; drawn; drawn &= drawn - 1) {
        const auto at = std::uint32_t(std::countr_zero(drawn));
        const std::uint32_t segment = items[i].first_segment + at;
        const bool straw = items[i].instance == FOREST_IN_WORLD;
        const frame::Owner owner =
            straw ? forest.geometry().owner(segment) : frame::Owner{items[i].instance, segment};
        take(entries[i * each + (each > 1 ? at : 0)], owner, forest.segments()[segment].meta & 7u);
      }
  };
  list(cut.dots, cut.entries->dots, 1);
  list(cut.lines, cut.entries->lines, frame::cluster_size);
  list(cut.capsules, cut.entries->capsules, frame::cluster_size);
}

TEST(Gauge, ColoursBranchesAndLeavesSomataAndOthersTheirColours) {
  const Forest forest = sample(150);
  Appearance second;
  second.name = "second", second.colour = 0x123456;
  for (const ColourBy by : gauged)
    for (const float away : {300.f, 3000.f, 60'000.f}) {
      const Colouring colouring = coloured(forest, by, {second});
      ASSERT_TRUE(colouring.gauge);
      View view;
      view.camera.eye = {0.f, 300.f, away}, view.camera.target = {0.f, 300.f, 0.f};
      Cut cut = choose(forest, Eye(view.camera, {640, 400}, view.detail), colouring.shown());
      paint(forest, colouring, cut);
      std::size_t steps = 0, others = 0;
      each_entry(forest, cut, [&](std::uint8_t entry, const frame::Owner& owner, std::uint32_t kind) {
        const frame::State& state = colouring.states[owner.instance];
        const bool own = forest.types()[owner.instance] == 1;
        EXPECT_EQ(entry, colouring.entry(state, owner.segment, kind));
        if (own) {
          EXPECT_EQ(colouring.palette[entry], light_of(0x123456));
        } else if (kind == 1) {
          EXPECT_EQ(colouring.palette[entry], gauge_soma(Background::dark));
        } else if (colouring.gauge->step[owner.segment] != Gauge::none) {
          EXPECT_EQ(entry, gauge_entry + colouring.gauge->step[owner.segment]);
          ++steps;
        }
        others += own;
      });
      EXPECT_GT(steps, 100u);
      EXPECT_GT(others, 100u);
      EXPECT_NO_THROW(frame::check(compose(forest, view, colouring, cut, 640, 400), forest.geometry()));
    }
}

TEST(Gauge, IsToldByABarWhoseColoursAreThoseOfTheBranches) {
  const Forest forest = sample();
  for (const ColourBy by : gauged)
    for (const Background background : {Background::dark, Background::light, Background::transparent}) {
      const Colouring colouring = colour(forest, by, background);
      const auto bar = bar_of(colouring, background);
      ASSERT_TRUE(bar);
      EXPECT_EQ(bar->units, by == ColourBy::order ? "" : "µm");
      EXPECT_EQ(bar->low, 0.f);
      EXPECT_EQ(bar->high, colouring.gauge->high);
      float before = -1.f;
      for (std::uint32_t i = 0; i < Gauge::steps; ++i) {
        const Vec3& shown = colouring.palette[gauge_entry + i];
        EXPECT_LT((screen_of(shown) - bar->at(float(i) / float(Gauge::steps - 1))).norm(), .01f);
        EXPECT_GT(lightness(shown), before);  // more is lighter, evenly
        before = lightness(shown);
      }
      // All of it is told from the ground.
      const float ground = lightness(ground_of(background).top);
      for (const std::uint32_t i : {gauge_entry, gauge_entry + Gauge::steps - 1u})
        EXPECT_GT(std::abs(lightness(colouring.palette[i]) - ground), 15.f);
    }
  EXPECT_FALSE(bar_of(colour(forest, ColourBy::kind, Background::dark), Background::dark));
}

TEST(Gauge, APictureHasOne) {
  const Forest forest = sample();
  Appearance first;
  first.name = "first", first.colour_by = ColourBy::radius;
  const Colouring some = coloured(forest, ColourBy::type, {first});
  ASSERT_TRUE(some.gauge);
  EXPECT_EQ(some.gauge->by, ColourBy::radius);
  EXPECT_NO_THROW(coloured(forest, ColourBy::radius, {first}));
  EXPECT_THROW(coloured(forest, ColourBy::order, {first}), Error);
}

}  // namespace
}  // namespace forest::scene
