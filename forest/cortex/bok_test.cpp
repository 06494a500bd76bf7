// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/bok.h"

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/cortex/human_layers.h"

#include "tests/folded_lattice.h"

namespace forest::cortex {
namespace {

TEST(WayOfVolume, PassesTheShareThatItIsAskedFor) {
  for (const double fold : {-3., -.4, 0., 1e-9, .7, 3.})
    for (const double share : {0., .118, .5, .9, 1.}) {
      const double a = std::exp(fold), x = way_of_volume(fold, share);
      EXPECT_NEAR((a * x + (1. - a) * x * x / 2.) / ((1. + a) / 2.), share, 1e-9);
    }
  EXPECT_DOUBLE_EQ(way_of_volume(0., .3), .3);
  EXPECT_LT(way_of_volume(1., .3), .3);  // a crown: wide outside
  EXPECT_GT(way_of_volume(-1., .3), .3);
}

TEST(CrownOverFundus, IsTheRatioOfTheOutermostTenths) {
  std::vector<double> folds, values;
  for (int i = 0; i < 50; ++i) folds.push_back((i * 7) % 50), values.push_back(1. + (i * 7) % 50);
  EXPECT_DOUBLE_EQ(crown_over_fundus(folds, values), (46. + 47 + 48 + 49 + 50) / (1. + 2 + 3 + 4 + 5));
  EXPECT_EQ(crown_over_fundus(std::vector<double>(9, 1.), std::vector<double>(9, 1.)), 0.);
}

TEST(HumanLayers, AreAWhole) {
  EXPECT_NEAR(layer_top(5) + human_layers[5], 1., .001);
  EXPECT_EQ(layer_top(0), 0.);
  EXPECT_EQ(layer_top(6), 1.);
}

// Sheets of a sine, with a quarter turn of crown beside one of fundus; every depth by volume, or by length.
Elements wave(Shares shares) {
  constexpr int across = 48, along = 12;
  constexpr double bend = 5000., thick = 2000.;  // µm: radius of the middle
  return folded_lattice(across, along, [&](double s, double t, double w) {
    const double angle = std::numbers::pi * s / across;  // 0…π/2 a crown, then a fundus
    const bool crown = angle < std::numbers::pi / 2.;
    const double outer = crown ? bend + thick / 2. : bend - thick / 2.,
                 inner = crown ? bend - thick / 2. : bend + thick / 2.;
    const double r = shares == Shares::of_volume
                         ? std::sqrt(outer * outer + w * (inner * inner - outer * outer))
                         : outer + w * (inner - outer);
    const Place crown_centre(0., 0., 0.), fundus_centre(2. * bend, 0., 0.);
    const double z = 800. * t;
    return crown ? Place(crown_centre + Place(-r * std::cos(angle + std::numbers::pi / 2.),
                                              r * std::sin(angle + std::numbers::pi / 2.), z))
                 : Place(fundus_centre + Place(-r * std::cos(angle - std::numbers::pi / 2.),
                                               -r * std::sin(angle - std::numbers::pi / 2.), z));
  });
}

TEST(Bok, OverCrownsUpperLayersAreThinAndDeepOnesThick) {
  const Bok found = bok(wave(Shares::of_volume));
  // A ring of the radii 6 and 4 mm, both ways.
  const auto radius = [](double outer, double inner, double w) {
    return std::sqrt(outer * outer + w * (inner * inner - outer * outer));
  };
  const double l1 = (6. - radius(6., 4., layer_top(1))) / (radius(4., 6., layer_top(1)) - 4.);
  const double l6 = (radius(6., 4., layer_top(5)) - 4.) / (6. - radius(4., 6., layer_top(5)));
  EXPECT_LT(l1, .75);
  EXPECT_GT(l6, 1.35);
  EXPECT_NEAR(found.l1, l1, .01);
  EXPECT_NEAR(found.l6, l6, .02);
}

TEST(Bok, DepthByLengthIsReportedAsFailing) {
  const Bok found = bok(wave(Shares::of_length));
  EXPECT_NEAR(found.l1, 1., .005);
  EXPECT_NEAR(found.l6, 1., .005);
  EXPECT_EQ(bok(wave(Shares::of_volume), Shares::of_length).l1, 1.);
}

TEST(Bok, MeasuredLayersAreHeldAgainstConstantVolumesAtTheSameVertices) {
  // A ball with a thick side, that is like a crown there; nothing is measured at one vertex of nine.
  const Mesh mesh = icosphere(Vec3::Zero(), 1.f, 4, 0);
  std::vector<Place> outer, inner;
  for (const Vec3& p : mesh.positions) {
    const Place at = p.cast<double>();
    outer.push_back(30e3 * at), inner.push_back((27e3 - 8e3 * at.x()) * at);
  }
  const std::vector<double> fold = folds(outer, inner, mesh.triangles);
  std::array<std::vector<float>, 6> by_volume, by_length, half;
  std::size_t measured = 0;
  for (std::size_t v = 0; v < outer.size(); ++v) {
    const double mm = v % 9 ? 2.5 : 0.;
    measured += mm > 0.;
    for (std::size_t k = 0; k < 6; ++k) {
      const double volume = way_of_volume(fold[v], layer_top(k + 1)) - way_of_volume(fold[v], layer_top(k));
      by_volume[k].push_back(float(mm * volume)), by_length[k].push_back(float(mm * human_layers[k]));
      half[k].push_back(float(mm * .5 * (volume + human_layers[k])));
    }
  }
  const MeasuredBok same = bok(outer, inner, mesh.triangles, by_volume);
  EXPECT_EQ(same.vertices, measured);
  EXPECT_LT(same.of_volume.l1, .8);
  EXPECT_NEAR(same.measured.l1, same.of_volume.l1, 1e-5);
  EXPECT_NEAR(same.measured.l6, same.of_volume.l6, 1e-5);
  const MeasuredBok flat = bok(outer, inner, mesh.triangles, by_length);
  EXPECT_NEAR(flat.measured.l1, 1., 1e-5);
  EXPECT_NEAR(flat.measured.l6, 1., 1e-5);
  const MeasuredBok between = bok(outer, inner, mesh.triangles, half);
  EXPECT_GT(between.measured.l1, same.measured.l1 + .05);
  EXPECT_LT(between.measured.l6, same.measured.l6 - .05);
}

TEST(Folds, OfNestedBallsAreTheRatioOfTheirAreas) {
  const Mesh mesh = icosphere(Vec3::Zero(), 1.f, 4, 0);
  std::vector<Place> outer, inner;
  for (const Vec3& p : mesh.positions)
    outer.push_back(9e3 * p.cast<double>()), inner.push_back(6e3 * p.cast<double>());
  for (const double scale : {0., 2000.})
    for (const double fold : folds(outer, inner, mesh.triangles, scale))
      EXPECT_NEAR(fold, 2. * std::log(1.5), 1e-6);
  for (const double fold : folds(inner, outer, mesh.triangles)) EXPECT_NEAR(fold, -2. * std::log(1.5), 1e-6);
}

}  // namespace
}  // namespace forest::cortex
