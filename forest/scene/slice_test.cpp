// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/slice.h"

#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/scene/pick.h"
#include "forest/scene/slice_picture.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

Forest sample() { return Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons())); }

std::vector<Plane> planes(const Forest& forest) {
  const Vec3 centre = forest.soma_bounds().centre();
  return {Plane::through(centre, {0, 0, 1}), Plane::through(centre, {0, 1, 0}),
          Plane::through(centre + Vec3(40, -60, 10), {1, 2, -3})};
}

bool in_profiles(const Slice& slice, const Forest& forest, const Vec3& point) {
  for (const Profile& p : slice.profiles)
    if (signed_distance(point, in_world(forest, p.instance, p.segment)) < 0.f) return true;
  return false;
}

TEST(Slice, HasAProfileOfEverySegmentThatThePlaneCuts) {
  const Forest forest = sample();
  for (const Plane& plane : planes(forest)) {
    const Slice found = slice(forest, plane);
    std::size_t expected = 0;
    for (std::uint32_t i = 0; i < forest.instances().size(); ++i) {
      const Neuron& n = forest.neurons()[forest.instances()[i].morphology];
      for (std::uint32_t k = n.first_segment; k < n.first_segment + n.original_count; ++k) {
        const RoundCone c = in_world(forest, i, k);
        expected += CrossSection::of({c.a.cast<double>(), c.b.cast<double>(), c.radius_a, c.radius_b}, plane)
                        .has_value();
      }
    }
    EXPECT_GT(expected, 20u);
    EXPECT_NEAR(double(found.profiles.size()), double(expected), 2.);  // those that are only touched
    for (std::size_t i = 1; i < found.profiles.size(); ++i)
      EXPECT_LT(std::pair(found.profiles[i - 1].instance, found.profiles[i - 1].segment),
                std::pair(found.profiles[i].instance, found.profiles[i].segment));
  }
}

TEST(Slice, IsTheSameAtAnyNumberOfThreadsAndWithinASheet) {
  const Forest forest = sample();
  const Plane plane = planes(forest)[2];
  const Slice all = slice(forest, plane);
  {
    const ThreadLimit one(1);
    const Slice again = slice(forest, plane);
    ASSERT_EQ(again.profiles.size(), all.profiles.size());
    for (std::size_t i = 0; i < all.profiles.size(); ++i)
      EXPECT_EQ(again.profiles[i].segment, all.profiles[i].segment);
  }
  const Sheet sheet{{-30, -30}, {30, 30}};
  const Slice some = slice(forest, plane, sheet);
  std::size_t within = 0, kept = 0;
  const auto meets = [&](const Profile& p) {
    for (const Place& at : p.shape.outline())
      if ((at.array() > sheet.low.array()).all() && (at.array() < sheet.high.array()).all()) return true;
    return false;
  };
  for (const Profile& p : all.profiles) within += meets(p);
  for (const Profile& p : some.profiles) kept += meets(p);
  EXPECT_EQ(kept, within);
  EXPECT_LT(some.profiles.size(), all.profiles.size());
}

// The union's area by throwing points: an independent way.
TEST(Slice, AreasAreThoseOfTheUnionOfANeuronsProfiles) {
  const Forest forest = sample();
  const Plane plane = planes(forest)[0];
  const Slice found = slice(forest, plane);
  std::map<std::uint32_t, double> known;
  for (const ProfileArea& a : areas(found)) {
    EXPECT_GT(a.profiles, 0u);
    EXPECT_GE(a.area, 0.);
    known[a.instance] += a.area;
  }
  Random random(3);
  std::size_t looked_at = 0;
  for (const auto& [instance, area] : known) {
    if (area < 40. || ++looked_at > 5) continue;
    Slice one{plane, {}};
    Place low = Place::Constant(INFINITY), high = -low;
    for (const Profile& p : found.profiles)
      if (p.instance == instance) {
        one.profiles.push_back(p);
        for (const Place& at : p.shape.outline()) low = low.cwiseMin(at), high = high.cwiseMax(at);
      }
    const int count = 200000;
    int hits = 0;
    for (int i = 0; i < count; ++i)
      hits += in_profiles(
          one, forest,
          plane.point({float(random.uniform(low.x(), high.x())), float(random.uniform(low.y(), high.y()))}));
    const double box = (high - low).prod(), share = double(hits) / count;
    EXPECT_NEAR(share * box, area, 4. * box * std::sqrt(share * (1. - share) / count) + 1e-3 * area);
  }
  EXPECT_GT(looked_at, 1u);
}

// Stems that begin within the soma add nothing where it is cut, however many there are.
TEST(Slice, WhatIsHiddenByOthersAddsNothing) {
  const Plane plane = Plane::through({0, 3, 0}, {0, 1, 0});
  Slice found{plane, {}};
  const auto add = [&](std::uint32_t kind, const Vec3& a, const Vec3& b, double radius) {
    found.profiles.push_back(
        {0, 0, kind, CrossSection::of({a.cast<double>(), b.cast<double>(), radius, radius}, plane).value()});
  };
  add(1, Vec3::Zero(), Vec3::Zero(), 10.);
  for (int i = 0; i < 12; ++i) {
    const float turn = .5f * float(i);
    add(3, {3 * std::cos(turn), -1, 3 * std::sin(turn)}, {5 * std::cos(turn), 8, 5 * std::sin(turn)}, 2.5);
  }
  double sum = 0.;
  for (const ProfileArea& area : areas(found)) sum += area.area;
  const double analytic = std::numbers::pi * (100. - 9.);
  EXPECT_NEAR(sum, analytic, 2e-4 * analytic);
}

TEST(Slice, ThePictureFillsAsMuchAsTheAreasSay) {
  const Forest forest = sample();
  const Plane plane = planes(forest)[0];
  const Sheet all = sheet_of(forest, plane);
  SlicePicture picture{.centre = .5 * (all.low + all.high),
                       .height = all.high.y() - all.low.y(),
                       .width_pixels = 800,
                       .height_pixels = 900,
                       .background = Background::light,
                       .words = false};
  const Slice found = slice(forest, plane, picture.sheet());
  Colouring colouring = colour(forest, ColourBy::type, Background::light);
  colouring.palette.fill(Vec3::Zero());
  const frame::Image image = paint(found, colouring, picture);
  const frame::Image paper = paint({plane, {}}, colouring, picture);
  std::vector<std::vector<Place>> outlines;
  for (const Profile& p : found.profiles) outlines.push_back(p.shape.outline());
  const double known = area_of_union(outlines);
  double dark = 0.;  // pixels, counted whole where more than half is covered
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) dark += image.pixels[i] < paper.pixels[i] * 4 / 5;
  EXPECT_NEAR(dark * picture.pixel() * picture.pixel() / known, 1., .1);

  picture.words = true;
  EXPECT_NE(paint(found, colouring, picture).pixels, image.pixels);
  // It stands on a plate: over profiles that fill the picture one still sees paper around it.
  SlicePicture inside = picture;
  const auto around = found.profiles[0].shape.outline();
  Place middle = Place::Zero();
  for (const Place& p : around) middle += p / double(around.size());
  inside.centre = middle, inside.height = .1;
  const frame::Image full = paint(slice(forest, plane, inside.sheet()), colouring, inside);
  const auto red = [&](std::size_t x, std::size_t y) { return int(full.pixels[4 * (y * 800 + x)]); };
  const int profile = red(700, 100), ground = paper.pixels[0];
  EXPECT_LT(profile, ground * 2 / 3);
  EXPECT_GT(red(22, 862), profile + (ground - profile) / 2);  // left of the label
  const std::string svg = to_svg(found, colouring, picture);
  EXPECT_NE(svg.find("<text"), std::string::npos);
  EXPECT_NE(svg.find("id=\"neuron-" + std::to_string(found.profiles[0].instance)), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace forest::scene
