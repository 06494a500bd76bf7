// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/playback.h"

#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/geometry/polyline.h"
#include "forest/reports/trace.h"

#include "tests/refused.h"
#include "tests/sample_activity.h"
#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

using forest::testing::packed_activity;
using reports::Activity;
using reports::Code;
using reports::Level;
using ::testing::HasSubstr;

// Calls visit(item, index of a segment in it, its palette entry) for all that a cut shows.
template <class Visit>
void for_each_segment(const Cut& cut, Visit&& visit) {
  ASSERT_TRUE(cut.entries);
  const auto walk = [&](const auto& list, const auto& entries, std::size_t each) {
    ASSERT_EQ(entries.size(), list.size() * each);
    for (std::size_t k = 0; k < list.size(); ++k)
      for (std::uint32_t i = 0; i < frame::cluster_size; ++i)
        if (list[k].drawn >> i & 1u) visit(list[k], i, std::uint32_t(entries[k * each + i]));
  };
  walk(cut.dots, cut.entries->dots, 1);
  walk(cut.lines, cut.entries->lines, frame::cluster_size);
  walk(cut.capsules, cut.entries->capsules, frame::cluster_size);
}

std::vector<std::uint32_t> all_entries(const Cut& cut) {
  std::vector<std::uint32_t> all;
  for_each_segment(cut,
                   [&](const frame::Item&, std::uint32_t, std::uint32_t entry) { all.push_back(entry); });
  return all;
}

struct Sample {
  circuit::Circuit circuit = forest::testing::sample_circuit(30);
  std::vector<Morphology> neurons = forest::testing::sample_neurons();
  Forest forest = Forest::from_bytes(pack(circuit, neurons));
  reports::Report report =
      reports::synthetic_report(circuit, neurons, {.compartments = 200, .steps = 130, .step = .5, .seed = 3});

  Activity activity(const std::vector<reports::Spikes>& spikes = {}) const {
    reports::PackOptions options;
    options.tile = 700;  // many tiles of a few neurons each
    return Activity::from_bytes(packed_activity(report, circuit, neurons, spikes, options));
  }
};

constexpr frame::Viewport viewport{320.f, 200.f};

Eye eye_at(const frame::Camera& camera, float error) {
  Detail detail;
  detail.error = error;
  return Eye(camera, viewport, detail);
}

// Where on the branches a place lies, in the coordinates of the forest's neuron.
Vec3 point_at(const Morphology& m, const reports::Place& place) {
  const Vec3 origin = m.soma().sphere().position();
  if (place.section == soma_section) return Vec3::Zero();
  const auto points = m.points(SectionId(place.section));
  float total = 0.f;
  for (std::size_t i = 1; i < points.size(); ++i)
    total += (points[i].position() - points[i - 1].position()).norm();
  float way = place.position * total;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 step = points[i].position() - points[i - 1].position();
    if (way <= step.norm() || i + 1 == points.size())
      return points[i - 1].position() + step * std::min(1.f, way / std::max(step.norm(), 1e-9f)) - origin;
    way -= step.norm();
  }
  return points.front().position() - origin;
}

float distance_to(const frame::Segment& s, const Vec3& point) {
  return distance_to_segment(point, Vec3(s.ax, s.ay, s.az), Vec3(s.bx, s.by, s.bz));
}

TEST(Places, OfOriginalSegmentsAreTheirMiddles) {
  const Sample sample;
  for (std::size_t n = 0; n < sample.neurons.size(); ++n) {
    const Neuron& neuron = sample.forest.neurons()[n];
    for (std::uint32_t i = 0; i < neuron.original_count; ++i) {
      const frame::Segment& s = sample.forest.segments()[neuron.first_segment + i];
      const reports::Place& place = sample.forest.places()[neuron.first_segment + i];
      ASSERT_EQ(place.section, sample.forest.section_of_segment()[neuron.first_original + i]);
      if (place.section == soma_section) continue;
      const Vec3 middle = .5f * (Vec3(s.ax, s.ay, s.az) + Vec3(s.bx, s.by, s.bz));
      EXPECT_LT((point_at(sample.neurons[n], place) - middle).norm(), .01f) << n << " " << i;
    }
  }
}

TEST(Places, OfCoarseSegmentsLieWithinTheirError) {
  const Sample sample;
  std::size_t coarse = 0;
  for (std::size_t n = 0; n < sample.neurons.size(); ++n) {
    const Neuron& neuron = sample.forest.neurons()[n];
    for (const Cluster& c : sample.forest.clusters().subspan(neuron.first_cluster, neuron.cluster_count))
      for (std::uint32_t i = c.first_segment; i < c.first_segment + c.segment_count; ++i) {
        if (sample.forest.places()[i].section == soma_section) continue;
        const Vec3 at = point_at(sample.neurons[n], sample.forest.places()[i]);
        EXPECT_LE(distance_to(sample.forest.segments()[i], at), 1.1f * c.error + .01f) << n << " " << i;
        coarse += !c.is_leaf();
      }
  }
  EXPECT_GT(coarse, 100u);
}

// Of what segment `i` of an item shows: straws have owners.
frame::Owner source_of(const Sample& sample, const frame::Item& item, std::uint32_t i) {
  return item.instance == FOREST_IN_WORLD ? sample.forest.geometry().owner(item.first_segment + i)
                                          : frame::Owner{item.instance, item.first_segment + i};
}

// What a segment should show, found the long way.
std::uint32_t expected(const Sample& sample, const Activity& activity, const frame::Owner& source,
                       std::uint64_t step, const ActivityView& view) {
  const auto [instance, segment] = source;
  const auto row = activity.row_of_instance(instance);
  if (!row) return no_value_entry;
  const auto layout = activity.layout(activity.rows()[*row].layout);
  const reports::Place place = sample.forest.places()[segment];
  const auto compartment = layout.at(place.section, place.position).value_or(layout.soma);
  std::vector<Code> code(1);
  activity.values(Level::compartment, step, activity.rows()[*row].first[0] + compartment, code);
  if (code[0] == reports::no_value) return no_value_entry;
  const float value = activity.facts().range.value(code[0]);
  if (view.threshold && value < *view.threshold) return below_entry;
  const float at = std::clamp((value - view.low) / (view.high - view.low), 0.f, 1.f);
  if (!view.neuron) return std::uint32_t(std::lround(at * 95.f));
  return std::uint32_t(std::lround(at * 47.f)) + (instance == *view.neuron ? 0 : 48);
}

TEST(Playback, EverySegmentHasTheColourOfItsCompartmentAtEveryLevelOfShape) {
  const Sample sample;
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  ActivityView view = playback.view();
  view.low = -72.f, view.high = -40.f, view.threshold = -69.f;
  const View whole = overview(sample.forest);
  for (const float error : {.05f, 1.f, 8.f}) {
    view.time = 20.;
    const Eye eye = eye_at(whole.camera, error);
    Cut cut = choose(sample.forest, eye);
    playback.colour(cut, eye, view, {.pixels = 0.f});
    std::set<std::uint32_t> colours;
    std::size_t seen = 0;
    for_each_segment(cut, [&](const frame::Item& item, std::uint32_t i, std::uint32_t entry) {
      ASSERT_EQ(entry, expected(sample, activity, source_of(sample, item, i), 40, view));
      colours.insert(entry);
      ++seen;
    });
    EXPECT_EQ(seen, cut.segments);
    EXPECT_GT(colours.size(), 10u);
    EXPECT_TRUE(colours.contains(below_entry));
    const Colouring colouring = colour(sample.forest, ColourBy::type, Background::dark);
    const frame::Frame frame = compose(sample.forest, whole, colouring, cut, 320, 200);
    EXPECT_NO_THROW(frame::check(frame, sample.forest.geometry()));
  }
}

TEST(Playback, WhileANeuronStandsOutTheOthersShowTheSameInQuietColours) {
  const Sample sample;
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  View whole = overview(sample.forest);
  ActivityView& view = whole.activity.emplace(playback.view());
  view.low = -72.f, view.high = -40.f, view.threshold = -69.f, view.time = 20., view.neuron = 1,
  view.speed = 0.f;
  const Eye eye = eye_at(whole.camera, 1.f);
  Cut cut = choose(sample.forest, eye);
  playback.colour(cut, eye, view, {.pixels = 0.f});
  std::set<std::uint32_t> own, other;
  for_each_segment(cut, [&](const frame::Item& item, std::uint32_t i, std::uint32_t entry) {
    const frame::Owner source = source_of(sample, item, i);
    ASSERT_EQ(entry, expected(sample, activity, source, 40, view));
    if (entry < map_steps) (source.instance == 1 ? own : other).insert(entry);
  });
  EXPECT_GT(own.size(), 2u);
  EXPECT_GT(other.size(), 2u);
  const Colouring colouring = colour(sample.forest, ColourBy::type, Background::dark);
  for (const Background background : {Background::dark, Background::light}) {
    whole.background = background;
    const frame::Palette palette = compose(sample.forest, whole, colouring, cut, 320, 200).palette;
    const frame::Palette ground = [&] {
      whole.activity->map = &colour_maps().back();
      return compose(sample.forest, whole, colouring, cut, 320, 200).palette;
    }();
    for (std::uint32_t i = 0; i < half_map_steps; ++i)  // maps differ less there
      EXPECT_NEAR((palette[half_map_steps + i] - ground[half_map_steps + i]).norm(),
                  (background == Background::dark ? .15f : .25f) * (palette[i] - ground[i]).norm(), 1e-5f);
  }
  view.neuron = std::uint32_t(sample.forest.instances().size());
  EXPECT_THROW(playback.colour(cut, eye, view), Error);
}

TEST(Playback, FarNeuronsAreColouredByMeansThatAreNearTheirCompartments) {
  const Sample sample;
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  for (std::uint32_t row = 0; row < 3; ++row) {
    auto before = Level::compartment;
    std::set<Level> met;
    for (float magnification = 100.f; magnification > 1e-4f; magnification *= .9f) {
      const Level level = playback.level(row, magnification);
      EXPECT_GE(level, before);  // never finer when farther
      met.insert(before = level);
    }
    EXPECT_EQ(met.size(), 4u);
  }
  ActivityView view = playback.view();
  view.time = 20.;
  frame::Camera camera = overview(sample.forest).camera;
  const Vec3 back = camera.eye - camera.target;
  std::uint64_t values = 1u << 30;
  for (const float farther : {1.f, 4.f, 30.f, 200.f}) {
    camera.eye = camera.target + farther * back;
    const Eye eye = eye_at(camera, 1.f);
    Cut means = choose(sample.forest, eye), exact = means;
    playback.colour(exact, eye, view, {.pixels = 0.f});
    playback.begin_picture();
    playback.colour(means, eye, view);
    EXPECT_LE(playback.figures().values, values);
    values = playback.figures().values;
    if (means.dots.size() == 30u) {
      // Somata keep their own value at any distance.
      for (std::size_t i = 0; i < means.dots.size(); ++i)
        EXPECT_EQ(means.entries->dots[i], exact.entries->dots[i]);
    }
    double sum = 0., mean_sum = 0.;
    const auto by_means = all_entries(means), by_values = all_entries(exact);
    for (std::size_t i = 0; i < by_means.size(); ++i) sum += by_values[i], mean_sum += by_means[i];
    EXPECT_NEAR(mean_sum / double(by_means.size()), sum / double(by_means.size()), 4.) << farther;
  }
  EXPECT_EQ(values, 60u);  // of each neuron its mean and its soma
}

TEST(Playback, OnlyWhatTheCutShowsIsTouched) {
  const Sample sample;
  frame::Camera camera = overview(sample.forest).camera;
  ActivityView view;
  const auto touched = [&](const frame::Camera& from) {
    const Activity activity = sample.activity();
    Playback playback(sample.forest, activity);
    const Eye eye = eye_at(from, 1.f);
    Cut cut = choose(sample.forest, eye);
    const std::uint64_t before = activity.touched();
    playback.colour(cut, eye, view, {.pixels = 0.f});
    EXPECT_EQ(playback.figures().segments, cut.segments);
    return activity.touched() - before;
  };
  const std::uint64_t all = touched(camera);
  EXPECT_GT(all, 0u);
  // Past the outermost soma, with a narrow view: a few neurons.
  const frame::Instance& one = *std::ranges::max_element(sample.forest.instances(), {}, &frame::Instance::x);
  camera.target = {one.x, one.y, one.z};
  camera.eye = camera.target + Vec3(0.f, 0.f, 600.f);
  camera.field_of_view = 1.f;
  const std::uint64_t few = touched(camera);
  EXPECT_GT(few, 0u);
  EXPECT_LT(few, all / 2);
  camera.eye = {5000.f, 0.f, 0.f}, camera.target = {6000.f, 0.f, 0.f};  // nothing is in sight
  EXPECT_EQ(touched(camera), 0u);
}

TEST(Playback, IsTheSameAtAnyNumberOfThreads) {
  const Sample sample;
  const View whole = overview(sample.forest);
  const Eye eye = eye_at(whole.camera, 1.f);
  const auto entries = [&] {
    Playback playback(sample.forest, sample.activity());
    Cut cut = choose(sample.forest, eye);
    playback.colour(cut, eye, playback.view());
    return all_entries(cut);
  };
  const auto all = entries();
  const ThreadLimit one(1);
  EXPECT_EQ(all, entries());
}

TEST(Playback, WhatIsNoNumberAndWhoWasNotReportedIsNeutral) {
  Sample sample;
  const auto plain = sample.report.read;
  const std::size_t width = sample.report.columns();
  sample.report.read = [plain, width](std::size_t first, std::size_t rows, std::size_t column,
                                      std::size_t columns, float* out) {
    plain(first, rows, column, columns, out);
    for (std::size_t i = 0; i < rows * columns; ++i)
      if (column + i % columns < width / 3) out[i] = NAN;
  };
  // The last neuron is not reported.
  sample.report.nodes.pop_back();
  sample.report.first_column.pop_back();
  sample.report.element_ids.resize(sample.report.first_column.back());
  sample.report.element_positions.resize(
      sample.report.element_positions.empty() ? 0 : sample.report.first_column.back());
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  const View whole = overview(sample.forest);
  const Eye eye = eye_at(whole.camera, 1.f);
  Cut cut = choose(sample.forest, eye);
  const ActivityView view = playback.view();
  playback.colour(cut, eye, view, {.pixels = 0.f});
  std::size_t neutral = 0, other = 0;
  for_each_segment(cut, [&](const frame::Item& item, std::uint32_t i, std::uint32_t entry) {
    ASSERT_EQ(entry, expected(sample, activity, source_of(sample, item, i), 0, view));
    if (source_of(sample, item, i).instance == 29) {
      EXPECT_EQ(entry, no_value_entry);
    }
    ++(entry == no_value_entry ? neutral : other);
  });
  EXPECT_GT(neutral, 500u);
  EXPECT_GT(other, 500u);
  const std::uint32_t shape = sample.forest.instances()[29].morphology;
  EXPECT_FALSE(playback.compartment(29, sample.forest.neurons()[shape].first_segment));
}

// Their values are not read, and no flash runs on them.
TEST(Playback, WhatIsNotSimulatedIsNeutral) {
  const Sample sample;
  std::vector<frame::State> states(sample.forest.instances().size());
  for (std::size_t i = 0; i < states.size(); i += 2)
    states[i].flags &= std::uint8_t(~frame::State::simulated);
  const reports::Nodes nodes = reports::nodes_of(sample.circuit);
  reports::Spikes spikes{.source = "spikes", .population = nodes.populations[0], .times = {}, .nodes = {}};
  for (std::uint32_t i = 0; i < states.size(); ++i)
    spikes.times.push_back(.5), spikes.nodes.push_back(nodes.of_instance[i].id);
  const Eye eye = eye_at(overview(sample.forest).camera, 1.f);
  const auto entries = [&](std::span<const frame::State> of, std::uint64_t& values, std::uint64_t& flashes) {
    Playback playback(sample.forest, sample.activity({spikes}));
    ActivityView view = playback.view();
    view.time = .7;
    Cut cut = choose(sample.forest, eye);
    playback.colour(cut, eye, view, {.pixels = 0.f, .states = of});
    values = playback.figures().values, flashes = playback.figures().flashes;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
    for_each_segment(cut, [&](const frame::Item& item, std::uint32_t i, std::uint32_t entry) {
      all.push_back({source_of(sample, item, i).instance, entry});
    });
    return all;
  };
  std::uint64_t values = 0, flashes = 0, fewer_values = 0, fewer_flashes = 0;
  const auto all = entries({}, values, flashes), some = entries(states, fewer_values, fewer_flashes);
  ASSERT_EQ(all.size(), some.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    EXPECT_EQ(some[k].second, all[k].first % 2 ? all[k].second : std::uint32_t(no_value_entry));
  EXPECT_LT(fewer_values, values);
  EXPECT_EQ(flashes, states.size());
  EXPECT_EQ(fewer_flashes, states.size() / 2);
}

// One neuron with a straight axon of 600 µm and a dendrite.
struct Cable {
  circuit::Circuit circuit;
  std::vector<Morphology> neurons;

  Cable() {
    MorphologyBuilder builder;
    builder.set_soma(
        {.kind = SomaKind::sphere, .points = {{0, 0, 0, 8}}, .parents = {}, .contour_starts = {}});
    std::vector<Point> axon, dendrite;
    for (int i = 0; i <= 60; ++i) axon.push_back({0, -8.f - 10.f * float(i), float(i % 2), .5f});
    for (int i = 0; i <= 60; ++i) dendrite.push_back({0, 8.f + 10.f * float(i), float(i % 2), .5f});
    builder.add_section({}, SectionKind::axon, axon);
    builder.add_section({}, SectionKind::apical, dendrite);
    neurons.push_back(builder.build());
    circuit.layers = {{"tissue", -1000.f, 1000.f}};
    circuit.types = {{"cell", "cell", true}};
    circuit.morphologies = {"cable"};
    circuit.instances = {{.position = Vec3::Zero(), .morphology = 0}};
  }
};

TEST(Playback, ASpikeTravelsAlongTheAxonAtItsSpeedAndFades) {
  const Cable cable;
  const Forest forest = Forest::from_bytes(pack(cable.circuit, cable.neurons));
  auto report =
      reports::synthetic_report(cable.circuit, cable.neurons, {.compartments = 60, .steps = 128, .step = .1});
  // The farther half of the axon has no values.
  const auto made = report.read;
  const auto ids = report.element_ids;
  const auto places = report.element_positions;
  report.read = [=](std::size_t first, std::size_t rows, std::size_t column, std::size_t columns,
                    float* out) {
    made(first, rows, column, columns, out);
    for (std::size_t i = 0; i < rows * columns; ++i)
      if (const std::size_t c = column + i % columns; ids[c] == 1 && places[c] > .48f) out[i] = NAN;
  };
  const auto nodes = reports::nodes_of(cable.circuit);
  const std::vector<reports::Spikes> spikes{
      {"spikes", nodes.populations[0], {5.}, {nodes.of_instance[0].id}}};
  Playback playback(forest,
                    Activity::from_bytes(packed_activity(report, cable.circuit, cable.neurons, spikes)));
  frame::Camera camera;
  camera.eye = {900.f, 0.f, 0.f}, camera.target = Vec3::Zero(), camera.field_of_view = 90.f;
  ActivityView view = playback.view();
  view.speed = 100.f, view.fade = .5f;  // µm/ms, ms
  for (const float error : {.01f, 2.f})
    for (const double time : {4.9, 5., 6., 8., 10., 12.5}) {
      view.time = time;
      const Eye eye = eye_at(camera, error);
      Cut cut = choose(forest, eye);
      playback.colour(cut, eye, view);
      std::size_t lit = 0;
      for_each_segment(cut, [&](const frame::Item& item, std::uint32_t i, std::uint32_t entry) {
        const frame::Segment& s = forest.segments()[item.first_segment + i];
        const bool flash = entry >= flash_entry && entry < flash_entry + flash_steps;
        const float y = .5f * (s.ay + s.by);
        if (y > 8.f) {  // the dendrite
          EXPECT_FALSE(flash) << y;
          return;
        }
        if (std::abs(s.ay - s.by) > 12.f) {  // coarse: its middle decides
          lit += flash;
          return;
        }
        const double way = std::max(0., (-8. - double(y)) * std::sqrt(1.01)), age = time - 5. - way / 100.;
        const double bright = age < 0. ? 0. : std::exp(-age / .5);
        // Of a branch that has a value of its own the bright part of a flash is shown, of others all of it.
        const double least = y < -300.f ? 1. / 16. : .4;
        if (std::abs(age) > .1 && std::abs(bright - least) > .02) {
          EXPECT_EQ(flash, bright > least) << time << " at " << y;
        }
        if (flash) {
          EXPECT_NEAR(double(entry - flash_entry + 1) / 16., bright, .14 + (std::abs(age) < .1 ? 1. : 0.));
        }
        lit += flash;
      });
      if (error < 1.f || time < 5. || time > 12.) {  // coarse, a straight axon is one segment
        EXPECT_EQ(lit > 0, time >= 5. && time < 12.) << time;
      }
    }
  view.speed = 0.f, view.time = 6.;
  const Eye eye = eye_at(camera, .01f);
  Cut cut = choose(forest, eye);
  playback.colour(cut, eye, view);
  for (const std::uint32_t entry : all_entries(cut)) EXPECT_LT(entry, flash_entry);
}

// A cable whose soma spikes at 5 ms, or does not, and of which no value is a number.
struct WithoutValues {
  Cable cable;
  Forest forest = Forest::from_bytes(pack(cable.circuit, cable.neurons));
  reports::Nodes nodes = reports::nodes_of(cable.circuit);
  std::vector<reports::Spikes> spikes{{"spikes", nodes.populations[0], {5.}, {nodes.of_instance[0].id}}};

  Playback played(const std::vector<reports::Spikes>& told) const {
    return {forest, Activity::from_bytes(packed_activity(reports::without_values(spikes, nodes),
                                                         cable.circuit, cable.neurons, told))};
  }
};

// … and are not taken for spikes alone.
TEST(Playback, ValuesThatAreNoNumbersAreShownAsSuch) {
  const WithoutValues sample;
  const Forest& forest = sample.forest;
  Playback playback = sample.played({});
  EXPECT_TRUE(playback.has_values());
  EXPECT_FALSE(playback.numbers());
  Cut cut = choose(forest, eye_at(overview(forest).camera, 1.f));
  playback.colour(cut, eye_at(overview(forest).camera, 1.f), playback.view());
  ASSERT_FALSE(all_entries(cut).empty());
  for (const std::uint32_t entry : all_entries(cut)) EXPECT_EQ(entry, no_value_entry);
}

TEST(Playback, SpikesAloneRunAsMarksThatAreWideAtAnySizeOfPicture) {
  const WithoutValues sample;
  const Forest& forest = sample.forest;
  Playback playback = sample.played(sample.spikes);
  EXPECT_FALSE(playback.has_values());
  frame::Camera camera;
  camera.eye = {900.f, 0.f, 0.f}, camera.target = Vec3::Zero(), camera.field_of_view = 90.f;
  ActivityView view = playback.view();
  view.speed = 100.f, view.fade = .5f;  // µm/ms, ms
  EXPECT_NEAR(playback.busiest(view), 5., .25);
  const Targets targets(forest);
  Colouring colouring = colour(forest, ColourBy::type, Background::dark);
  for (const float height : {200.f, 1080.f, 8000.f})
    for (const double time : {4.9, 5., 6., 8., 20.}) {
      view.time = time;
      const auto marks = playback.flashes(camera, height, colouring, view);
      EXPECT_EQ(marks.empty(), time < 5. || time > 19.) << time;
      for (const frame::Overlay& mark : marks) {
        // It lies nearer to the eye than what it marks, in the same place of the picture; the cable lies at x = 0.
        const float nearer = (camera.eye.x() - .5f * (mark.a.x() + mark.b.x())) / camera.eye.x();
        EXPECT_LT(nearer, .5f);
        const float y = .5f * (mark.a.y() + mark.b.y()) / nearer;
        EXPECT_LT(y, 10.f);  // no dendrite
        const double way = std::max(0., (-8. - double(y)) * std::sqrt(1.01)), age = time - 5. - way / 100.;
        EXPECT_GT(age, -.2) << "it is not there yet";
        EXPECT_LT(age, 1.7) << "it has faded";
        if (age < 0. || age > .25) continue;
        EXPECT_EQ(mark.colour, spike_entry);
        const float depth = (camera.eye - .5f * (mark.a + mark.b)).x();
        // Of the picture's height, whatever that is.
        EXPECT_GT(2.f * mark.radius / camera.pixel_size(height, depth), .0015f * height);
      }
    }
  // What is hidden does not flash.
  view.time = 6.;
  for (frame::State& state : colouring.states) state.flags = 0;
  playback.begin_picture();
  EXPECT_TRUE(playback.flashes(camera, 200.f, colouring, view).empty());
  EXPECT_EQ(playback.figures().flashes, 0u);
}

TEST(Playback, BehindFlashesColoursAreQuietAndStillDiffer) {
  for (const Background background : {Background::dark, Background::light}) {
    frame::Palette palette = frame::black_palette();
    for (std::uint32_t i = 0; i < 112; ++i) palette[i] = light_of(i % 2 ? 0xF28E2B : 0x4A9DE6);
    const frame::Palette loud = palette;
    make_quiet(palette, background);
    const float ground = background == Background::dark ? 0.f : 96.f;
    const float spike = lightness(palette[spike_entry]);
    for (std::uint32_t i = 0; i < 112; ++i) {
      EXPECT_LT(std::abs(lightness(palette[i]) - ground), std::abs(lightness(loud[i]) - ground));
      EXPECT_GT(std::abs(lightness(palette[i]) - spike), 35.f);
    }
    EXPECT_GT((palette[0] - palette[1]).norm(), .02f);
  }
}

TEST(Playback, APictureOfALongWhileShowsTheGreatest) {
  const Sample sample;
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  ActivityView view = playback.view();
  view.time = 30.;
  const Eye eye = eye_at(overview(sample.forest).camera, 1.f);
  Cut now = choose(sample.forest, eye), longer = now;
  playback.colour(now, eye, view, {.pixels = 0.f});
  playback.colour(longer, eye, view, {.window = 2.5, .pixels = 0.f});
  const auto at_once = all_entries(now), greatest = all_entries(longer);
  for (std::size_t i = 0; i < at_once.size(); ++i) ASSERT_GE(greatest[i], at_once[i]);
  EXPECT_NE(greatest, at_once);
}

TEST(Playback, PicturesOneAfterTheOtherMissNoStepAndShowNoneThatIsToCome) {
  const Sample sample;
  const Activity activity = sample.activity();
  Playback playback(sample.forest, activity);
  const Eye eye = eye_at(overview(sample.forest).camera, 1.f);
  const Cut cut = choose(sample.forest, eye);
  const auto shown = [&](double time, double window) {
    Cut now = cut;
    ActivityView view = playback.view();
    view.time = time, view.speed = 0.f;
    playback.colour(now, eye, view, {.window = window, .pixels = 0.f});
    return all_entries(now);
  };
  const double step = activity.facts().step;
  for (const double steps : {1., 1.4, 3., 7., 21., 70.}) {
    std::uint64_t next = 0;  // the first step that no picture has shown
    for (double time = playback.begin() + .3 * step; time <= playback.end(); time += steps * step) {
      const auto picture = shown(time, steps * step);
      std::vector<std::uint32_t> greatest(picture.size(), no_value_entry);
      for (; next <= playback.step_at(time); ++next) {
        const auto one = shown(activity.facts().time(next), 0.);
        for (std::size_t i = 0; i < one.size(); ++i)
          if (one[i] != no_value_entry)
            greatest[i] = greatest[i] == no_value_entry ? one[i] : std::max(greatest[i], one[i]);
      }
      ASSERT_EQ(picture, greatest) << steps << " steps, " << time << " ms";
    }
  }
}

TEST(Playback, ASimulationOfAnotherCircuitIsRefusedAndTheMismatchNamed) {
  const Sample sample;
  const Activity activity = sample.activity();
  const auto refusal = [&](const circuit::Circuit& circuit, const std::vector<Morphology>& neurons) {
    return refused<InputError>(
        [&] { Playback(Forest::from_bytes(pack(circuit, neurons)), activity, "run.activity"); });
  };
  EXPECT_EQ(refusal(sample.circuit, sample.neurons), "");
  circuit::Circuit fewer = sample.circuit;
  fewer.instances.pop_back();
  EXPECT_THAT(refusal(fewer, sample.neurons), HasSubstr("with 30 neurons and the forest has 29"));
  EXPECT_THAT(refusal(fewer, sample.neurons), HasSubstr("run.activity"));
  circuit::Circuit other = sample.circuit;
  other.instances[7].morphology = (other.instances[7].morphology + 1) % 3;
  EXPECT_THAT(refusal(other, sample.neurons), HasSubstr("for neuron 7, which in the forest has shape"));
  auto pruned = sample.neurons;
  pruned[0] = forest::testing::random_tree(1, 3);
  EXPECT_THAT(refusal(sample.circuit, pruned), HasSubstr("of 'one', which has 3 in the forest"));
}

TEST(Playback, APickedSegmentHasItsHistory) {
  const Sample sample;
  const Activity activity = sample.activity();
  const Playback playback(sample.forest, activity);
  const std::uint32_t instance = 11;
  const Neuron& neuron = sample.forest.neurons()[sample.forest.instances()[instance].morphology];
  ActivityView view = playback.view();
  for (std::uint32_t i = 0; i < neuron.original_count; i += 17) {
    const auto compartment = playback.compartment(instance, neuron.first_segment + i);
    ASSERT_TRUE(compartment);
    const float value = reports::trace(activity, compartment->row, compartment->index).values[40];
    const auto entry = expected(sample, activity, {instance, neuron.first_segment + i}, 40, view);
    EXPECT_EQ(std::uint32_t(std::lround(std::clamp((value + 80.f) / 100.f, 0.f, 1.f) * 95.f)), entry);
  }
  EXPECT_FALSE(playback.compartment(99, 0));
  EXPECT_FALSE(playback.compartment(instance, 0xfffffff0u));
}

TEST(ActivityView, IsPartOfAViewsText) {
  const std::string base = R"({"eye":[0,0,9],"target":[0,0,0],"activity":)";
  const View view = parse_view(
      base + R"({"map":"magma","range":[-70,-20],"threshold":-60,"speed":250,"fade":2,"time":12.25}})");
  ASSERT_TRUE(view.activity);
  EXPECT_STREQ(view.activity->map->name, "magma");
  EXPECT_EQ(view.activity->low, -70.f);
  EXPECT_EQ(view.activity->high, -20.f);
  EXPECT_EQ(view.activity->threshold, -60.f);
  EXPECT_EQ(view.activity->speed, 250.f);
  EXPECT_EQ(view.activity->fade, 2.f);
  EXPECT_EQ(view.activity->time, 12.25);
  EXPECT_EQ(to_json(parse_view(to_json(view))), to_json(view));
  for (const char* wrong :
       {"3}", R"({"map":"jet"}})", R"({"range":[-20,-70]}})", R"({"range":[1]}})", R"({"speed":-1}})",
        R"({"threshold":"low"}})", R"({"colour":1}})", R"({"fade":0}})", R"({"time":null}})"})
    EXPECT_THROW(parse_view(base + wrong), InputError) << wrong;
}

}  // namespace
}  // namespace forest::scene
