// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/evening.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

constexpr int side = 24;          // faces
constexpr double step = 1000.;    // µm, of a face
constexpr double height = 1000.;  // µm
constexpr double whole = side * step;
constexpr std::uint32_t at(int i, int j) { return std::uint32_t(i + (side + 1) * j); }

// A flat sheet, and faces on it whose vertices are pushed aside by as many µm, most of all half way up, and on the border not at all.
struct Sheet {
  Ribbon ribbon;
  std::vector<Curvature> curvatures;
  std::vector<Place> arms;
  std::vector<std::optional<Pass>> by;
  std::vector<double> heights;
  std::vector<Line> lines;
  Quads quads;

  explicit Sheet(double aside) {
    for (int j = 0; j <= side; ++j)
      for (int i = 0; i <= side; ++i) {
        const Place p(step * i, step * j, 0.);
        ribbon.middle.push_back(p);
        ribbon.outer.push_back(p + height / 2. * Place::UnitZ());
        ribbon.inner.push_back(p - height / 2. * Place::UnitZ());
        const double across = std::sin(2. * std::numbers::pi * p.x() / whole),
                     up = std::sin(std::numbers::pi * p.y() / whole);
        quads.middle.push_back(p + aside * across * up * Place::UnitX());
      }
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        ribbon.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        ribbon.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        quads.quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    const std::size_t n = ribbon.size();
    ribbon.thickness.assign(n, float(height)), ribbon.wall.assign(n, 0), quads.on_valley.assign(n, 0);
    Curvature flat;
    flat.normal = Place::UnitZ();
    curvatures.assign(n, flat), arms.assign(n, Place::UnitX()), by.resize(n), heights.assign(n, height);
    Line border{.kind = Line::Kind::border, .points = {}, .triangles = {}, .closed = true};
    for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}})
      border.points.emplace_back(x * whole, y * whole, 0.);
    border.triangles.assign(4, 0);
    lines.push_back(border);
  }

  void even(int rounds) {
    even_volumes(quads, ribbon, {curvatures, arms, by, heights, lines}, whole * whole * height, rounds,
                 Progress::none());
  }
  double volume(int i, int j) const {  // of what is wanted
    const Quad& q = quads.quads[std::size_t(i + side * j)];
    return .5 * (quads.middle[q[2]] - quads.middle[q[0]]).cross(quads.middle[q[3]] - quads.middle[q[1]]).z() /
           (step * step);
  }
  double farthest_from_even() const {
    double most = 0.;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) most = std::max(most, std::abs(volume(i, j) - 1.));
    return most;
  }
};

TEST(EvenVolumes, AWholeRegionThatHasTooMuchGivesItToWhatIsFar) {
  Sheet sheet(1500.);
  ASSERT_GT(sheet.farthest_from_even(), .3);
  sheet.even(30);
  EXPECT_LT(sheet.farthest_from_even(), .05);
}

TEST(EvenVolumes, WhatIsEvenStays) {
  Sheet sheet(0.);
  const auto before = sheet.quads.middle;
  sheet.even(20);
  double farthest = 0.;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i)
      if (std::min(i, side - i) + std::min(j, side - j) > side / 2)  // borders become smooth, corners round
        farthest = std::max(farthest, (sheet.quads.middle[at(i, j)] - before[at(i, j)]).norm());
  EXPECT_LT(farthest, .02 * step);
}

TEST(EvenVolumes, VerticesOfAValleyGoAlongIt) {
  Sheet sheet(1500.);
  Line valley{.kind = Line::Kind::valley, .points = {}, .triangles = {}};
  for (int j = 0; j <= side; ++j) {
    valley.points.push_back(sheet.ribbon.middle[at(side / 3, j)]);
    sheet.quads.on_valley[at(side / 3, j)] = j > 0 && j < side;
  }
  valley.triangles.assign(side, 0);
  sheet.lines.push_back(valley);
  sheet.even(30);
  for (int j = 1; j < side; ++j)
    EXPECT_NEAR(sheet.quads.middle[at(side / 3, j)].x(), step * side / 3, 1.) << j;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) EXPECT_NEAR(sheet.volume(i, j), 1., .15) << i << ' ' << j;
}

// A crest that runs across the rows 8° askew: rows turn by it until they cross it at a right angle, and volumes stay even.
TEST(EvenVolumes, RowsTurnAcrossACrest) {
  Sheet sheet(0.);
  const double askew = std::tan(8. * std::numbers::pi / 180.);
  Line crest{.kind = Line::Kind::crest, .points = {}, .triangles = {}};
  for (int j = 0; j <= side; ++j)
    crest.points.emplace_back(.5 * whole + askew * (step * j - .5 * whole), step * j, 0.);
  crest.triangles.assign(side, 0);
  sheet.lines.push_back(crest);
  sheet.even(30);
  const Place along = Place(askew, 1., 0.).normalized();
  std::vector<double> angles;
  for (int j = 4; j < side - 4; ++j)
    for (int i = 0; i < side; ++i) {
      const Quad& q = sheet.quads.quads[std::size_t(i + side * j)];
      const auto& at = sheet.quads.middle;
      const Place middle = .25 * (at[q[0]] + at[q[1]] + at[q[2]] + at[q[3]]);
      if (std::abs(middle.x() - .5 * whole - askew * (middle.y() - .5 * whole)) > .5 * step) continue;
      const Place across = at[q[1]] - at[q[0]] + at[q[2]] - at[q[3]];
      angles.push_back(std::asin(std::abs(along.dot(across.normalized()))) * 180. / std::numbers::pi);
    }
  ASSERT_GT(angles.size(), 10u);
  std::ranges::nth_element(angles, angles.begin() + std::ptrdiff_t(angles.size() / 2));
  EXPECT_LT(angles[angles.size() / 2], 2.);
  for (int j = 4; j < side - 4; ++j)
    for (int i = 4; i < side - 4; ++i) EXPECT_NEAR(sheet.volume(i, j), 1., .1) << i << ' ' << j;
}

TEST(EvenVolumes, AreTheSameAtAnyNumberOfThreads) {
  Sheet one(1500.), two(1500.);
  {
    const ThreadLimit alone(1);
    one.even(10);
  }
  two.even(10);
  EXPECT_EQ(one.quads.middle, two.quads.middle);
}

}  // namespace
}  // namespace forest::cortex
