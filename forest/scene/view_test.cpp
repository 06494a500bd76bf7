// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/view.h"

#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/scene/cut.h"
#include "forest/scene/pick.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

Forest sample() { return Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons())); }

TEST(View, IsTextAndBack) {
  View view;
  view.camera.eye = {1.5f, -2, 3e3f};
  view.camera.field_of_view = 55;
  view.detail.gaze = Vec2(.25f, .75f);
  view.colour_by = ColourBy::layer;
  view.background = Background::light;
  const View back = parse_view(to_json(view));
  EXPECT_EQ(to_json(back), to_json(view));
  EXPECT_EQ(back.camera.eye, view.camera.eye);
  EXPECT_EQ(*back.detail.gaze, *view.detail.gaze);
}

// A view of which every key says something.
View full_view() {
  View view;
  view.detail.gaze = Vec2(.25f, .75f);
  view.detail.screen = 40.f;
  view.skin = false;
  view.least_width = .5f;
  view.synapses = SynapseColour::target;
  view.targets.resize(1);
  view.targets[0].name = "L5", view.targets[0].opacity = .4f;
  view.activity.emplace();
  view.activity->threshold = -60.f, view.activity->time = 12.5, view.activity->neuron = 3;
  view.plane = {.at = {1, 2, 3}, .normal = {1, 1, 0}, .opacity = .5f};
  return view;
}

TEST(View, EveryKeyIsWrittenAndReadBack) {
  const std::string text = to_json(full_view());
  for (const auto& keys : {view_keys(), activity_keys(), plane_keys()})
    for (const ViewKey& key : keys)
      EXPECT_NE(text.find('"' + key.name + "\":"), std::string::npos) << key.name;
  EXPECT_EQ(to_json(parse_view(text)), text);
}

TEST(View, WithoutEyeAndTargetItIsThatOfAllWhereOneIsKnown) {
  View all;
  all.camera.eye = {7.f, 8.f, 9.f}, all.fog = .25f;
  const View view = parse_view(R"({"background":"light","field_of_view":30})", "view", Vec3::UnitY(), &all);
  EXPECT_EQ(view.camera.eye, all.camera.eye);
  EXPECT_EQ(view.camera.field_of_view, 30.f);
  EXPECT_EQ(view.fog, .25f);
  EXPECT_EQ(view.background, Background::light);
  EXPECT_THROW(parse_view(R"({"eye":[1,2,3]})", "view", Vec3::UnitY(), &all), InputError);
  EXPECT_THROW(parse_view(R"({"fog":1})"), InputError);
  EXPECT_EQ(parse_view(R"({"eye":[1,2,3],"target":[0,0,0]})", "view", Vec3::UnitY(), &all).fog, View().fog);
}

TEST(View, ItsPageHasEveryKeyWithWhatItMayHoldAndNoOther) {
  const MappedFile page(FOREST_SOURCE_DIR "/docs/scene/view.md");
  std::map<std::string, std::string> rows;  // of its tables, by key
  std::istringstream lines{std::string(page.text())};
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("| `")) rows.emplace(line.substr(3, line.find('`', 3) - 3), line);
  std::size_t keys = 0;
  for (const auto& all : {view_keys(), activity_keys(), plane_keys()})
    for (const ViewKey& key : all) {
      ASSERT_TRUE(rows.contains(key.name)) << key.name;
      for (const std::string& value : key.values)
        EXPECT_NE(rows[key.name].find(value), std::string::npos) << key.name << " may be " << value;
      ++keys;
    }
  EXPECT_EQ(rows.size(), keys);
}

TEST(View, SaysWhichKeyIsWrong) {
  const auto error_of = [](const char* text) -> std::string {
    try {
      parse_view(text, "v.json");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(error_of("{").find("v.json"), std::string::npos);
  EXPECT_NE(error_of("[]").find("object"), std::string::npos);
  EXPECT_NE(error_of((R"({"eye":)" + std::string(100'000, '[')).c_str()).find("brackets"), std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1]})").find("target"), std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0],"target":[0,0,0]})").find("eye"), std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,1]})").find("same point"), std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,0],"up":[0,0,0]})").find("no direction"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,0],"gaze":[2,0.5]})").find("beside the picture"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,0],"field_of_view":900})").find("field_of_view"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,0],"colour_by":"mood"})").find("layer"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"eye":[0,0,1],"target":[0,0,0],"fovv":4})").find("fovv"), std::string::npos);
  for (const char* doubled : {R"({"eye":[0,0,1],"target":[0,0,0],"eye":[0,0,1]})",
                              R"({"eye":[0,0,1],"target":[0,0,0],"activity":{"eye":1,"eye":2}})"})
    EXPECT_NE(error_of(doubled).find("has 'eye' twice"), std::string::npos);
  for (const char* samples : {"2.7", "0", "1025", "\"4\"", "-3"})
    EXPECT_NE(error_of(fmt::format(R"({{"eye":[0,0,1],"target":[0,0,0],"samples":{}}})", samples).c_str())
                  .find("'samples' must be a whole number from 1 to 1024"),
              std::string::npos)
        << samples;
  EXPECT_EQ(parse_view(R"({"eye":[0,0,1],"target":[0,0,0],"samples":2.0})").samples, 2u);
}

TEST(View, FogTakesLessContrastOnLightGroundThanOnDark) {
  const Forest forest = sample();
  const Cut nothing;
  std::array<float, 2>
      kept{};  // of the contrast of a colour with the ground, where fog on dark ground leaves 1/e of light
  float depth = 0.f;
  for (const Background background : {Background::dark, Background::light}) {
    View view = overview(forest);
    view.background = background;
    const Colouring colouring = colour(forest, view.colour_by, background);
    const frame::Frame frame = compose(forest, view, colouring, nothing, 320, 200);
    if (background == Background::dark) depth = frame.style.fog_length;
    const float fog = 1.f - std::exp(-depth / frame.style.fog_length);
    const float ground = lightness(frame.style.fog_colour);
    float clear = 0.f, foggy = 0.f;
    for (const frame::State& state : colouring.states) {
      const Vec3& base = frame.palette[8u * state.colour_class + 4u];
      clear += std::abs(lightness(base) - ground);
      foggy += std::abs(lightness(Vec3(base + fog * (frame.style.fog_colour - base))) - ground);
    }
    kept[std::size_t(background)] = foggy / clear;
    // What is chosen knows the same fog.
    EXPECT_EQ(detail_for(view, 320, 200).fog, fog_strength(view));
  }
  EXPECT_GT(kept[1], kept[0] + .1f);  // hues go before contrast does
  EXPECT_LT(kept[1], .9f);
  View without;
  without.fog = 0.f, without.background = Background::light;
  EXPECT_EQ(fog_strength(without), 0.f);
}

TEST(View, TheOverviewHoldsBranchesAndFillsThePicture) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(200), testing::sample_neurons()));
  for (const float aspect : {.5f, 1.f, 16.f / 9.f, 3.f}) {
    SCOPED_TRACE(aspect);
    const frame::Camera camera = overview(forest, aspect).camera;
    const frame::Viewport viewport{600.f * aspect, 600.f};
    std::size_t ends = 0, outside = 0;
    float farthest = 0.f;  // from the middle, 1 at the edges
    for (const frame::Instance& i : forest.instances()) {
      const Neuron& neuron = forest.neurons()[i.morphology];
      for (const frame::Segment& s : forest.segments().subspan(neuron.first_segment, neuron.original_count)) {
        const Vec3 end = Vec3(i.x, i.y, i.z) + Quat(i.qw, i.qx, i.qy, i.qz) * Vec3(s.bx, s.by, s.bz);
        const Vec3 at = project(camera, viewport, end);
        ASSERT_GT(at.z(), 0.f);
        const float out = std::max(std::abs(2.f * at.x() / viewport.width - 1.f),
                                   std::abs(2.f * at.y() / viewport.height - 1.f));
        ++ends, outside += out > 1.f;
        if (out <= 1.f) farthest = std::max(farthest, out);
      }
    }
    EXPECT_LT(double(outside), .002 * double(ends));
    EXPECT_GT(farthest, .85f);
  }
}

TEST(View, TheOverviewOfASmallForestHoldsAllAndGoesByLayersOnlyWhereItStandsInThem) {
  circuit::Circuit c = testing::sample_circuit(3);
  for (const float down : {0.f, 20000.f}) {
    for (circuit::Instance& i : c.instances) i.position.y() -= down;
    c.layers.push_back({"none " + std::to_string(down), 0.f, 0.f});
    const Forest forest = Forest::from_bytes(pack(c, testing::sample_neurons()));
    EXPECT_EQ(forest.layers_in_place().empty(), down > 0.f);
    const frame::Camera camera = overview(forest, 1.5f).camera;
    float farthest = 0.f;
    for (const frame::Instance& i : forest.instances()) {
      const Neuron& neuron = forest.neurons()[i.morphology];
      for (const frame::Segment& s : forest.segments().subspan(neuron.first_segment, neuron.original_count)) {
        const Vec3 end = Vec3(i.x, i.y, i.z) + Quat(i.qw, i.qx, i.qy, i.qz) * Vec3(s.bx, s.by, s.bz);
        const Vec3 at = project(camera, {900.f, 600.f}, end);
        farthest = std::max({farthest, std::abs(at.x() / 450.f - 1.f), std::abs(at.y() / 300.f - 1.f)});
      }
    }
    EXPECT_LT(farthest, 1.f);
    EXPECT_GT(farthest, down > 0.f ? .5f : .3f);  // the column is larger than they are
  }
}

TEST(View, TheOverviewHoldsASomaThatLiesAtTheEdge) {
  circuit::Circuit c = testing::sample_circuit(1);
  c.layers = {{"traced", -1.f, 1.f}}, c.radius = 0.f;
  c.instances[0] = {};
  MorphologyBuilder builder;  // a long one, under a tuft
  builder.set_soma({.kind = SomaKind::cylinders,
                    .points = {{0, -80, 0, 12}, {0, -40, 0, 12}, {0, 0, 0, 10}},
                    .parents = {-1, 0, 1},
                    .contour_starts = {}});
  for (const float x : {-60.f, 60.f})
    builder.add_section({}, SectionKind::basal, std::vector<Point>{{0, 20, 0, 1}, {x, 200, 0, 1}});
  const std::vector<Morphology> neurons(c.morphologies.size(), builder.build());
  const frame::Camera camera = overview(Forest::from_bytes(pack(c, neurons)), 1.5f).camera;
  const Vec3 middle = neurons[0].soma().sphere().position();
  for (const float turn : {0.f, .8f, 2.4f, 3.1f, 5.5f}) {
    const Vec3 rim = Vec3(8.f * std::cos(turn), -76.f, 8.f * std::sin(turn)) - middle;
    EXPECT_LT(project(camera, {900.f, 600.f}, rim).y(), 600.f);
  }
}

TEST(View, WhatIsSeenThroughHasMoreSamplesAtRest) {
  const Targets targets(sample());
  View view = overview(targets.forest());
  EXPECT_EQ(still_samples(view, colour(targets, view)), view.samples);
  view.targets.resize(1);
  view.targets[0].name = "all", view.targets[0].opacity = .2f;
  const Colouring clear = colour(targets, view);
  for (const auto& [asked, has] : {std::pair{1u, 1u}, {4u, 4u}, {16u, 64u}, {100u, 100u}}) {
    view.samples = asked;
    EXPECT_EQ(still_samples(view, clear), has);
  }
}

TEST(View, WhatIsHiddenNeedsNoRoom) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(60), testing::sample_neurons()));
  const frame::Camera whole = overview(forest, 1.5f).camera;
  std::vector<frame::State> states(forest.instances().size());
  EXPECT_EQ(overview(forest, 1.5f, states).camera, whole);
  for (frame::State& s : states) s.flags = 0;
  EXPECT_EQ(overview(forest, 1.5f, states).camera, whole);  // nothing is seen from anywhere
  for (const std::size_t only : {5u, 59u}) {
    states[only].flags = frame::State::visible;
    const frame::Camera camera = overview(forest, 1.5f, states).camera;
    states[only].flags = 0;
    const frame::Instance& at = forest.instances()[only];
    EXPECT_LT((camera.eye - camera.target).norm(), .7f * (whole.eye - whole.target).norm());
    const Vec3 seen = project(camera, {900.f, 600.f}, {at.x, at.y, at.z});
    EXPECT_TRUE(seen.x() > 0.f && seen.x() < 900.f && seen.y() > 0.f && seen.y() < 600.f) << seen.transpose();
  }
}

TEST(View, SomataMayAllLieInOnePlace) {
  circuit::Circuit circuit = testing::sample_circuit(4);
  for (auto& instance : circuit.instances) instance.position = {0.f, 300.f, 0.f};
  const Forest forest = Forest::from_bytes(pack(circuit, testing::sample_neurons()));
  std::vector<frame::State> states(4);
  states[1].flags = 0;
  EXPECT_EQ(overview(forest, 1.5f, states).fog, View().fog);
}

TEST(View, NeuronsOfAColumnStandUprightAndThoseInAFoldDoNot) {
  circuit::Circuit circuit = testing::sample_circuit(20);
  const auto forest = [&] { return Forest::from_bytes(pack(circuit, testing::sample_neurons())); };
  EXPECT_EQ(towards_pia(forest()), Vec3(Vec3::UnitY()));
  for (std::size_t i = 0; i < circuit.instances.size(); ++i)
    circuit.instances[i].orientation =
        Quat(Eigen::AngleAxisf(float(i), Vec3::UnitX())) * circuit.instances[i].orientation;
  EXPECT_EQ(towards_pia(forest()), std::nullopt);
  circuit.up = Vec3(3.f, 0.f, 4.f);
  EXPECT_LT((*towards_pia(forest()) - Vec3(.6f, 0.f, .8f)).norm(), 1e-6f);
}

TEST(View, WhatStandsAnotherWayUpIsSeenAsIfItDidNot) {
  circuit::Circuit circuit = testing::sample_circuit(30);
  circuit.radius = 0.f, circuit.layers.resize(1);
  for (circuit::Instance& i : circuit.instances) i.layer = 0;
  const auto seen = [&](const circuit::Circuit& c) {
    const Forest forest = Forest::from_bytes(pack(c, testing::sample_neurons()));
    const frame::Camera camera = overview(forest, 1.5f).camera;
    std::vector<Vec3> places;
    for (const frame::Instance& i : forest.instances())
      places.push_back(project(camera, {900.f, 600.f}, {i.x, i.y, i.z}));
    return places;
  };
  const auto before = seen(circuit);
  const Vec3 up = Vec3(-1.f, -2.f, .5f).normalized();
  const Quat turn = Quat::FromTwoVectors(Vec3::UnitY(), up);
  circuit.up = up;
  for (circuit::Instance& i : circuit.instances)
    i.position = turn * i.position, i.orientation = turn * i.orientation;
  const auto after = seen(circuit);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((before[i] - after[i]).head<2>().norm(), 90.f) << i;  // of 600; their boxes differ a little
}

// A row of elements: 6 mm wide, 2 mm high, .4 mm thick, and turned about the way up and over.
Forest row_of_elements(const Quat& turn) {
  circuit::Circuit circuit = testing::sample_circuit(400);
  circuit.radius = 0.f, circuit.layers.resize(1), circuit.up = turn * Vec3::UnitY();
  Random random(3);
  for (circuit::Instance& i : circuit.instances) {
    i.layer = 0;
    i.position = turn * Vec3(float(random.uniform(-3e3, 3e3)), float(random.uniform(-1e3, 1e3)),
                             float(random.uniform(-200., 200.)));
  }
  return Forest::from_bytes(pack(circuit, testing::sample_neurons()));
}

TEST(View, ARowOfElementsShowsItsFaceAndIsNotLostInFog) {
  for (const Vec3& turned : {Vec3(0.f, .3f, .2f), Vec3(1.f, 2.f, -.4f), Vec3(-2.f, 1.2f, .9f)}) {
    const Quat turn = Quat(Eigen::AngleAxisf(turned.x(), Vec3::UnitX())) *
                      Quat(Eigen::AngleAxisf(turned.z(), Vec3::UnitZ())) *
                      Quat(Eigen::AngleAxisf(turned.y(), Vec3::UnitY()));
    const Forest forest = row_of_elements(turn);
    const Mat3 stands = standing(forest);
    EXPECT_NEAR(stands.determinant(), 1.f, 1e-5f);
    EXPECT_LT((stands.col(1) - turn * Vec3::UnitY()).norm(), 1e-5f);
    EXPECT_GT(std::abs(stands.col(2).dot(turn * Vec3::UnitZ())), .99f);
    const frame::Camera camera = overview(forest, 2.f).camera;
    float farthest = 0.f;
    for (const frame::Instance& i : forest.instances()) {
      const Vec3 at = project(camera, {1200.f, 600.f}, {i.x, i.y, i.z});
      farthest = std::max({farthest, std::abs(at.x() / 600.f - 1.f), std::abs(at.y() / 300.f - 1.f)});
    }
    EXPECT_GT(farthest, .8f);
    // From 2.5 mm away much of the light of what lies in its middle arrives.
    frame::Camera near = camera;
    near.target = forest.soma_bounds().centre(), near.eye = near.target + 2500.f * stands.col(2);
    const Fog fog = fog_of(forest, near, 1.f);
    EXPECT_GT(std::exp(-(2500.f - fog.start) / fog.length), .4f);
  }
}

TEST(View, OneNeuronIsNotLostInFogNorTheFootOfATallForest) {
  circuit::Circuit circuit = testing::sample_circuit(1);
  const Forest one = Forest::from_bytes(pack(circuit, testing::sample_neurons()));
  const auto light = [](const Forest& forest, const frame::Camera& camera, const Vec3& at) {
    const Fog fog = fog_of(forest, camera, 1.f);
    return std::exp(-std::max(0.f, -camera.axes().col(2).dot(at - camera.eye) - fog.start) / fog.length);
  };
  const frame::Camera camera = overview(one).camera;
  const Sphere& all = one.spheres()[0];
  EXPECT_GT(light(one, camera, all.centre - all.radius * camera.axes().col(2)), .25f);

  circuit = testing::sample_circuit(40);
  for (std::size_t i = 0; i < 40; ++i) circuit.instances[i].position = {0.f, 250.f * float(i), 0.f};
  const Forest tall = Forest::from_bytes(pack(circuit, testing::sample_neurons()));
  EXPECT_GT(light(tall, overview(tall).camera, Vec3::Zero()), .15f);
}

TEST(View, AColumnIsAsDeepAsItIsWide) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(2000), testing::sample_neurons()));
  const float wide = .5f * std::hypot(forest.soma_bounds().extent().x(), forest.soma_bounds().extent().z());
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(.6f, 0, .8f)})
    EXPECT_GT(reach_along(forest, way), wide + 50.f);
  EXPECT_EQ(standing(forest), Mat3(Mat3::Identity()));
}

TEST(View, ElementsHaveTheirOutlineAndColumnsTheirs) {
  circuit::Circuit circuit = testing::sample_circuit(3);
  const auto lines = [&] { return outline(Forest::from_bytes(pack(circuit, testing::sample_neurons()))); };
  const std::size_t of_column = lines().size();
  EXPECT_GT(of_column, 100u);
  circuit.radius = 0.f;
  EXPECT_TRUE(lines().empty());
  circuit.outline = {{{0, 0, 0}, {1, 0, .1f}, {2, 5, 0}}, {{7, 7, 7}, {8, 8, 1e5f}}};
  const auto own = lines();
  ASSERT_EQ(own.size(), 3u);
  EXPECT_EQ(own[0].b, own[1].a);
  EXPECT_EQ(own[0].b, Vec3(1, 0, .1f));
  EXPECT_EQ(own[2].b, Vec3(8, 8, 1e5f));
  circuit.outline[0][1].y() = NAN;
  EXPECT_THROW(lines(), Error);
}

TEST(View, EveryFrameKeepsTheContract) {
  const Forest forest = sample();
  const auto lines = outline(forest);
  for (const ColourBy by : {ColourBy::type, ColourBy::layer, ColourBy::kind, ColourBy::neuron})
    for (const Background background : {Background::dark, Background::light}) {
      View view = overview(forest);
      view.colour_by = by, view.background = background;
      const Colouring colouring = colour(forest, by, background);
      const Cut cut = choose(forest, Eye(view.camera, {320, 200}, view.detail));
      EXPECT_NO_THROW(
          frame::check(compose(forest, view, colouring, cut, 320, 200, lines), forest.geometry()));
    }
}

}  // namespace
}  // namespace forest::scene
