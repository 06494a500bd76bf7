// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/surfaces.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/scene/colouring.h"

namespace forest::scene {
namespace {

// A ball of 80 mm with waves: gyri where the waves are high.
Mesh wavy_ball(float height) {
  Mesh mesh = icosphere(Vec3::Zero(), 80'000.f, 5, 0);
  for (Vec3& p : mesh.positions) p *= 1.f + height * std::sin(p.x() / 6'000.f);
  return mesh;
}

TEST(Surfaces, SulciAreDarkerThanGyriAndABallIsBrightEverywhere) {
  for (const float height : {0.f, .06f}) {
    Surfaces surfaces;
    const Mesh mesh = wavy_ball(height);
    surfaces.add(mesh);
    frame::Frame frame;
    surfaces.show(frame, Colouring{}, false);
    ASSERT_EQ(frame.surfaces.size(), 1u);
    const frame::Surface& s = frame.surfaces[0];
    EXPECT_NO_THROW(frame::check(s, {}));
    double high = 0., low = 0.;
    int highs = 0, lows = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      if (std::abs(mesh.positions[i].x()) > 50'000.f) continue;
      const float wave = std::sin(mesh.positions[i].x() / 6'000.f / (1.f + height));
      if (wave > .8f) high += s.openness[i], ++highs;
      if (wave < -.8f) low += s.openness[i], ++lows;
    }
    high /= highs, low /= lows;
    if (height > 0.f) {
      EXPECT_GT(high, 200.);
      EXPECT_LT(low, 175.);
    } else {
      EXPECT_GT(low, 180.);
      EXPECT_NEAR(high, low, 3.);
    }
  }
}

TEST(Surfaces, ValuesAreColouredFromEndToEndAndWhatHasNoneIsPlain) {
  Surfaces surfaces;
  const Mesh mesh = icosphere(Vec3::Zero(), 1000.f, 3, 0);
  surfaces.add(mesh, .5f);
  std::vector<float> values;
  for (const Vec3& p : mesh.positions) values.push_back(p.z() / 1000.f);
  values[5] = NAN;
  surfaces.colour(values);
  surfaces.range = {-.5f, .5f};
  surfaces.map = find_colour_map("viridis");
  for (const bool playing : {false, true}) {
    // Neurons of all classes leave little, and lose nothing.
    Colouring colouring{.palette = frame::black_palette(), .states = {}, .parts = {}, .legend = {}};
    for (std::uint8_t c = 0; c < colour_classes; ++c) colouring.states.push_back({.colour_class = c});
    frame::Frame frame;
    surfaces.show(frame, colouring, playing);
    const frame::Surface& s = frame.surfaces[0];
    EXPECT_EQ(s.opacity, 128);
    const std::uint32_t first = playing ? 114 : 112;
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_GE(s.entries[i], first);
      EXPECT_LT(s.entries[i], 120);
    }
    for (std::uint32_t entry = 0; entry < first; ++entry) EXPECT_EQ(frame.palette[entry], Vec3::Zero());
    const std::uint8_t low = s.entries[std::size_t(std::ranges::min_element(values) - values.begin())];
    EXPECT_LT((frame.palette[low] - (*surfaces.map)(0.f)).norm(), 1e-5f);
    EXPECT_NE(s.entries[5], low);
    EXPECT_EQ(frame.palette[s.entries[5]], light_of(0xD9CDBF));
    std::set<std::uint8_t> used(s.entries.begin(), s.entries.end());
    EXPECT_EQ(used.size(), playing ? 6u : 8u);
  }
  // Without neurons there is a map of many steps.
  frame::Frame frame;
  surfaces.show(frame, Colouring{}, false);
  EXPECT_GT(std::set<std::uint8_t>(frame.surfaces[0].entries.begin(), frame.surfaces[0].entries.end()).size(),
            40u);
}

TEST(Surfaces, AreasHaveTheirColours) {
  Surfaces surfaces;
  const Mesh mesh = icosphere(Vec3::Zero(), 1000.f, 2, 0);
  surfaces.add(mesh);
  std::vector<float> keys;
  for (const Vec3& p : mesh.positions) keys.push_back(p.z() > 0.f ? 7.f : p.x() > 0.f ? -2.f : 3.f);
  const std::vector<AreaColour> areas{{7, {1, 0, 0}, "FA"}, {-2, {0, 0, 1}, "FB"}, {9, {0, 1, 0}, "none"}};
  surfaces.colour(keys, areas);
  frame::Frame frame;
  surfaces.show(frame, Colouring{}, false);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Vec3 colour = frame.palette[frame.surfaces[0].entries[i]];
    EXPECT_EQ(colour, keys[i] == 7.f ? Vec3(1, 0, 0) : keys[i] == -2.f ? Vec3(0, 0, 1) : light_of(0xD9CDBF));
  }
  for (const Triangle& t : frame.surfaces[0].triangles) {  // no colours that no area has
    EXPECT_EQ(frame.surfaces[0].entries[t[0]], frame.surfaces[0].entries[t[1]]);
    EXPECT_EQ(frame.surfaces[0].entries[t[0]], frame.surfaces[0].entries[t[2]]);
  }
  EXPECT_NO_THROW(frame::check(frame.surfaces[0], {}));
  ASSERT_EQ(surfaces.legend().size(), 2u);  // of those that are there
  EXPECT_EQ(surfaces.legend()[0].name, "FA");
  EXPECT_EQ(surfaces.legend()[1].colours, std::vector<Vec3>{Vec3(0, 0, 1)});
  // More colours than a picture has.
  std::vector<AreaColour> many;
  for (int i = 0; i < 200; ++i) many.push_back({i, Vec3::Constant(float(i) / 200.f), ""});
  surfaces.colour(keys, many);
  EXPECT_THROW(surfaces.show(frame, Colouring{}, false), Error);
}

TEST(Surfaces, TheRangeLeavesOutWhatHasNoValue) {
  Surfaces surfaces;
  surfaces.add(icosphere(Vec3::Zero(), 1.f, 3, 0));
  const std::size_t count = 642;
  const auto range_of = [&](auto value) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(value(i));
    surfaces.colour(values);
    return surfaces.shown_range();
  };
  const auto thickness = [](std::size_t i) { return 1.5f + 2.f * float(i % 101) / 100.f; };
  const auto whole = range_of(thickness);
  EXPECT_NEAR(whole.first, 1.5f, 1e-5f);  // about 1.54 and 3.46, in round numbers
  EXPECT_NEAR(whole.second, 3.5f, 1e-5f);
  // The medial wall, a tenth of it, as FreeSurfer writes it, or as a file without values there does.
  for (const float none : {0.f, float(NAN)}) {
    const auto range = range_of([&](std::size_t i) { return i % 10 ? thickness(i) : none; });
    EXPECT_NEAR(range.first, whole.first, .05f);
    EXPECT_NEAR(range.second, whole.second, .05f);
  }
  // Where values lie on both sides of it, zero is a value; so is that of a few vertices among many.
  EXPECT_LT(range_of([&](std::size_t i) { return i % 10 ? thickness(i) - 2.f : 0.f; }).first, -.4f);
  EXPECT_FALSE(zero_means_none(std::vector<float>{0.f, 0.f}));
  std::vector<float> distances(1000, 1.f);
  distances[7] = 0.f;
  EXPECT_FALSE(zero_means_none(distances));
  EXPECT_EQ(range_of([](std::size_t i) { return i % 3 ? 4.f : 0.f; }).first, 4.f);
  EXPECT_GT(range_of([&](std::size_t i) { return i % 10   ? thickness(i)
                                                 : i % 20 ? 0.f
                                                          : -.003f; }).first,
            .5f);
  // Few values far from all others are beyond the ends: between the wall and the cortex averages have some.
  const auto edged = range_of([&](std::size_t i) { return i % 25 ? thickness(i) : .02f * float(i % 50); });
  EXPECT_GT(edged.first, .5f);
  EXPECT_NEAR(edged.second, whole.second, .2f);
  // The middle of a diverging map is zero, where values lie on both sides.
  surfaces.map = find_colour_map("cool-warm");
  const auto even = range_of([&](std::size_t i) { return thickness(i) - 2.f; });
  EXPECT_EQ(even.first, -even.second);
  EXPECT_GT(even.second, 1.4f);
  EXPECT_GT(range_of(thickness).first, 1.f);
  // What a person says holds.
  surfaces.range = {0.f, 3.f};
  EXPECT_EQ(surfaces.shown_range(), std::pair(0.f, 3.f));
}

TEST(Surfaces, RefuseValuesOfAnotherSurface) {
  Surfaces surfaces;
  surfaces.add(icosphere(Vec3::Zero(), 1.f, 1, 0));
  EXPECT_THROW(surfaces.colour(std::vector<float>(41)), Error);
  EXPECT_NO_THROW(surfaces.colour(std::vector<float>(42)));
}

TEST(Surfaces, AViewFromAnySideShowsAllOfIt) {
  for (const float middle : {-30'000.f, 0.f, 30'000.f}) {
    Surfaces surfaces;
    Mesh mesh = icosphere({middle, 5'000.f, -2'000.f}, 20'000.f, 4, 0);
    for (Vec3& p : mesh.positions) p.y() *= 2.f;
    surfaces.add(mesh);
    EXPECT_EQ(surfaces.outside(), middle < 0.f ? Side::left : middle > 0.f ? Side::right : Side::above);
    for (const Side side : {Side::left, Side::right, Side::front, Side::back, Side::above, Side::below})
      for (const float aspect : {.5f, 1.f, 1.8f}) {
        const frame::Camera camera = surfaces.camera(side, aspect);
        const frame::Viewport viewport{400.f * aspect, 400.f};
        float most = 0.f;
        for (const Vec3& p : mesh.positions) {
          const Vec3 at = frame::project(camera, viewport, p);
          EXPECT_GT(at.z(), camera.near);
          most = std::max(
              {most, std::abs(at.x() / viewport.width - .5f), std::abs(at.y() / viewport.height - .5f)});
        }
        EXPECT_NEAR(most, .47f, .002f);
      }
  }
  EXPECT_EQ(Surfaces().outside(), Side::above);
}

TEST(Surfaces, DepthIsThatOfAnyMeshOfTheSameShape) {
  // Two meshes of one shape, one finer: the same depths where both have vertices.
  std::vector<float> depths[2];
  for (const int halvings : {4, 5}) {
    Mesh mesh = icosphere(Vec3::Zero(), 80'000.f, halvings, 0);
    for (Vec3& p : mesh.positions) p *= 1.f + .06f * std::sin(p.x() / 12'000.f);
    depths[halvings - 4] = depth_below_smoothed(mesh, vertex_normals(mesh), 8'000.f);
  }
  double squares = 0., difference = 0.;
  for (std::size_t i = 0; i < depths[0].size(); ++i) {
    squares += std::pow(double(depths[0][i]), 2.);
    difference += std::pow(double(depths[0][i] - depths[1][i]), 2.);
  }
  EXPECT_LT(difference, .1 * squares);
  EXPECT_EQ(depth_below_smoothed(Mesh{}, {}, 1.f).size(), 0u);
}

}  // namespace
}  // namespace forest::scene
