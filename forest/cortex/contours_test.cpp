// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/contours.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/progress.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

constexpr double pi = std::numbers::pi;

const Mesh& ball() {
  static const Mesh mesh = icosphere({100.f, 200.f, -300.f}, 10000.f, 5, 0);
  return mesh;
}

Mesh turned_inside_out(Mesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

TEST(Cut, OfABallIsACircleInEveryPlaneOfEveryAxis) {
  for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
    const Eigen::Vector3d centre(100., 200., -300.);
    const auto planes = planes_between(-9000., 9000., 1000.);
    ASSERT_EQ(planes.size(), 19u);
    const ContourStack stack = cut(ball(), "outer", axis, planes);
    EXPECT_EQ(stack.objects, std::vector<std::string>{"outer"});
    for (const Section& section : stack.sections) {
      ASSERT_EQ(section.contours.size(), 1u);
      const double height = section.at - centre[int(axis)];
      const double radius = std::sqrt(1e8 - height * height);
      // The ball is a polyhedron, 0.2 % smaller at most. Its inside is to the left.
      EXPECT_NEAR(area(section.contours[0].curve) / (pi * radius * radius), 1., 5e-3);
      for (const Place& p : section.contours[0].curve.points)
        EXPECT_NEAR((p - flat(centre, axis)).norm(), radius, 40.);
    }
  }
}

TEST(Cut, TimesTheirDistanceSumsToTheVolume) {
  Mesh two = ball();
  append(two, icosphere({25000.f, 0.f, 0.f}, 4000.f, 4, 0));
  append(two, turned_inside_out(icosphere({0.f, 0.f, 0.f}, 3000.f, 4, 0)));  // a cavity
  const ContourStack stack = cut(two, "outer", Axis::y, planes_between(-11000., 11000., 100.));
  double sum = 0.;
  for (const Section& section : stack.sections)
    for (const Contour& contour : section.contours) sum += 100. * area(contour.curve);
  EXPECT_NEAR(sum / volume(two), 1., 1e-4);
}

TEST(Cut, HasALoopForEachPieceAndHoleOfASection) {
  Mesh two = ball();
  append(two, icosphere({25000.f, 0.f, 0.f}, 4000.f, 4, 0));
  append(two, turned_inside_out(icosphere({0.f, 0.f, 0.f}, 3000.f, 4, 0)));
  const auto loops = [&](double at) {
    const double plane[] = {at};
    return cut(two, "outer", Axis::z, plane).sections[0].contours.size();
  };
  EXPECT_EQ(loops(0.), 3u);
  EXPECT_EQ(loops(3500.), 2u);
  EXPECT_EQ(loops(5000.), 1u);
  EXPECT_EQ(loops(11000.), 0u);
}

TEST(Cut, ClosesItsLoopsThroughVerticesAndEdgesToo) {
  // An octahedron: planes through vertices, along edges, through its four-cornered middle.
  Mesh mesh;
  mesh.positions = {{1000.f, 0.f, 0.f},  {-1000.f, 0.f, 0.f}, {0.f, 1000.f, 0.f},
                    {0.f, -1000.f, 0.f}, {0.f, 0.f, 1000.f},  {0.f, 0.f, -1000.f}};
  mesh.labels.assign(6, 0);
  for (const std::uint32_t x : {0u, 1u})
    for (const std::uint32_t y : {2u, 3u})
      for (const std::uint32_t z : {4u, 5u})
        mesh.triangles.push_back((x + y + z) % 2 == 0 ? Triangle{x, y, z} : Triangle{y, x, z});
  ASSERT_TRUE(is_closed(mesh));
  ASSERT_GT(volume(mesh), 0.);
  for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
    const double planes[] = {-1000., 0., 500., 1000.};
    const ContourStack stack = cut(mesh, "outer", axis, planes);
    EXPECT_EQ(stack.sections[0].contours.size(), 0u);
    ASSERT_EQ(stack.sections[1].contours.size(), 1u);
    EXPECT_NEAR(area(stack.sections[1].contours[0].curve), 2e6, 1e-6);
    ASSERT_EQ(stack.sections[2].contours.size(), 1u);
    EXPECT_NEAR(area(stack.sections[2].contours[0].curve), .5e6, 1e-6);
  }
}

TEST(Cut, NamesThePlaceWhereASurfaceIsOpenOrNoNumber) {
  Mesh open = ball();
  // Not the triangle that comes last: none that any plane misses.
  open.triangles.erase(open.triangles.begin() + 100);
  const auto planes = planes_between(-10000., 10000., 20.);
  EXPECT_NE(refused([&] { (void)cut(open, "outer", Axis::y, planes); }).find("is open at ("),
            std::string::npos);
  Mesh broken = ball();
  broken.positions[7].x() = NAN;
  EXPECT_NE(refused([&] { (void)cut(broken, "outer", Axis::y, planes); }).find("vertex 7"),
            std::string::npos);
}

TEST(Cut, IsTheSameAtAnyNumberOfThreads) {
  const auto planes = planes_between(-9000., 9000., 6000.);
  const auto made = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    FitSummary summary;
    return fitted(cut(ball(), "outer", Axis::x, planes), {}, summary, Progress::none());
  };
  EXPECT_EQ(made(1), made(2));
}

TEST(Fitted, TellsHowManyCurvesAndHowFarOffTheyAre) {
  FitSummary summary;
  const ContourStack cuts = cut(ball(), "outer", Axis::y, planes_between(-9000., 9000., 3000.));
  const ContourStack curves = fitted(cuts, {.tolerance = 20.}, summary, Progress::none());
  EXPECT_EQ(summary.contours, 7u);
  EXPECT_LE(summary.rms, 20.);
  EXPECT_GT(summary.length / double(summary.pieces), 5000.);
  double along = 0.;
  for (const Section& section : cuts.sections) along += length(section.contours[0].curve);
  EXPECT_NEAR(summary.length, along, 1.);
  EXPECT_EQ(fault_of(curves), "");
}

TEST(Fitted, WhatIsCurvesStaysAsItIs) {
  const double planes[] = {-3000., 0., 4000.};
  FitSummary once, again;
  const ContourStack curves = fitted(cut(ball(), "outer", Axis::z, planes), {}, once, Progress::none()),
                     same = fitted(curves, {.tolerance = 500.}, again, Progress::none());
  ASSERT_EQ(curves.sections.size(), same.sections.size());
  for (std::size_t s = 0; s < curves.sections.size(); ++s) {
    ASSERT_EQ(curves.sections[s].contours.size(), same.sections[s].contours.size());
    for (std::size_t c = 0; c < curves.sections[s].contours.size(); ++c)
      EXPECT_EQ(curves.sections[s].contours[c].curve, same.sections[s].contours[c].curve);
  }
  EXPECT_EQ(once.pieces, again.pieces);
  EXPECT_EQ(again.greatest, 0.);
}

TEST(Fitted, BanksOfANarrowSulcusDoNotCross) {
  // A disc with a bent slit, 6 µm wide, which curves of 20 µm are free to cross.
  std::vector<Place> disc;
  const auto middle = [](double depth) { return Place(5000. - depth, 90. * std::sin(depth / 250.)); };
  for (int i = 1; i < 400; ++i)
    disc.push_back(5000. * Place(std::cos(2. * pi * i / 400.), std::sin(2. * pi * i / 400.)));
  for (int i = 0; i <= 60; ++i) disc.push_back(middle(70. * i) - Place(0., 3.));
  for (int i = 60; i >= 0; --i) disc.push_back(middle(70. * i) + Place(0., 3.));
  ContourStack stack{.axis = Axis::y, .objects = {"outer"}, .sections = {Section{.at = 0., .contours = {}}}};
  stack.sections[0].contours.push_back({.object = 0, .curve = straight_loop(disc)});
  ASSERT_EQ(fault_of(stack), "");
  ContourStack freely = stack;
  freely.sections[0].contours[0].curve = fit_loop(disc).curve;
  EXPECT_NE(fault_of(freely), "");
  FitSummary summary;
  EXPECT_EQ(fault_of(fitted(stack, {}, summary, Progress::none())), "");
  EXPECT_LE(summary.rms, 20.);
  EXPECT_LT(double(summary.pieces), 2. * double(freely.sections[0].contours[0].curve.pieces()));
}

TEST(Contours, OfTwoSurfacesAreOneStackWhenTheirSectionsAreAlike) {
  const auto planes = planes_between(-9000., 9000., 1000.);
  const ContourStack outer = cut(ball(), "outer", Axis::y, planes);
  const ContourStack inner = cut(icosphere({100.f, 200.f, -300.f}, 7000.f, 4, 0), "inner", Axis::y, planes);
  const ContourStack stacks[] = {outer, inner};
  const ContourStack both = together(stacks);
  EXPECT_EQ(both.objects, (std::vector<std::string>{"outer", "inner"}));
  ASSERT_EQ(both.sections[9].contours.size(), 2u);
  EXPECT_EQ(both.sections[9].contours[1].object, 1u);
  const ContourStack other = cut(ball(), "inner", Axis::y, planes_between(-9000., 9000., 1000., 10.));
  const ContourStack unlike[] = {outer, other};
  EXPECT_NE(refused([&] { (void)together(unlike); }).find("section"), std::string::npos);
}

ContourStack drawn(std::vector<std::vector<Place>> polygons) {
  ContourStack stack{
      .axis = Axis::y, .objects = {"outer"}, .sections = {Section{.at = 3000., .contours = {}}}};
  for (const auto& polygon : polygons)
    stack.sections[0].contours.push_back({.object = 0, .curve = straight_loop(polygon)});
  return stack;
}

TEST(FaultOf, NamesThePlaceWhereContoursCross) {
  const std::vector<Place> square{{0., 0.}, {4000., 0.}, {4000., 4000.}, {0., 4000.}};
  auto shifted = square;
  for (Place& p : shifted) p += Place(2000., 1000.);
  auto within = square;
  for (Place& p : within) p = Place(1000., 1000.) + .25 * p;
  EXPECT_EQ(fault_of(drawn({square, within})), "");
  const std::string crossing = fault_of(drawn({square, shifted}));
  EXPECT_NE(crossing.find("'outer'"), std::string::npos) << crossing;
  EXPECT_NE(crossing.find("(3 mm)"), std::string::npos) << crossing;     // the section
  EXPECT_NE(crossing.find("(2, 4) mm"), std::string::npos) << crossing;  // and where
  const std::string eight = fault_of(drawn({{{0., 0.}, {4000., 4000.}, {4000., 0.}, {0., 4000.}}}));
  EXPECT_NE(eight.find("(2, 2) mm"), std::string::npos) << eight;
  ContourStack twice = drawn({square});
  twice.sections.push_back(twice.sections[0]);
  EXPECT_NE(fault_of(twice), "");
  ContourStack broken = drawn({square});
  broken.sections[0].contours[0].curve.points[4].x() = NAN;
  EXPECT_NE(fault_of(broken), "");
}

TEST(FaultOf, KnowsAContourThatIsThereTwiceAmongMany) {
  std::vector<std::vector<Place>> rows;
  for (int i = 0; i < 400; ++i) {
    const Place at(10. * (i % 20), 10. * (i / 20));
    rows.push_back({at, at + Place(5., 0.), at + Place(5., 5.), at + Place(0., 5. + .01 * i)});
  }
  EXPECT_EQ(fault_of(drawn(rows)), "");
  rows.push_back({rows[217].rbegin(), rows[217].rend()});
  EXPECT_NE(fault_of(drawn(rows)).find("one contour twice"), std::string::npos) << fault_of(drawn(rows));
}

TEST(FaultOf, KnowsWhatReachesFartherThanABrain) {
  const std::vector<Place> square{{0., 0.}, {4000., 0.}, {4000., 4000.}, {0., 4000.}};
  auto large = square;
  for (Place& p : large) p *= 1000.;
  EXPECT_NE(fault_of(drawn({large})).find("spread over 4 m"), std::string::npos);
  ContourStack apart = drawn({square});
  apart.sections.push_back(apart.sections[0]);
  apart.sections[1].at += 2e6;
  EXPECT_NE(fault_of_numbers(apart).find("spread over 2 m"), std::string::npos) << fault_of_numbers(apart);
}

TEST(TooSmallForABrain, IsWhatReachesLessFarThanAFlysBrain) {
  const std::vector<Place> square{{0., 0.}, {27., 0.}, {27., 20.}, {0., 20.}};
  ContourStack stack = drawn({square});
  EXPECT_EQ(fault_of(stack), "");
  EXPECT_EQ(too_small_for_a_brain(stack),
            "the contours reach over 27 µm, as no brain does; look at their unit: in mm it would be 27 mm");
  stack.sections.push_back(stack.sections[0]);
  stack.sections[1].at += 600.;
  EXPECT_EQ(extent(stack), 600.);
  EXPECT_EQ(too_small_for_a_brain(stack), "");
  stack.sections.clear();
  EXPECT_EQ(too_small_for_a_brain(stack), "");
}

TEST(Only, KeepsObjectsThatAreNamedAndEverySection) {
  const std::vector<Place> square{{0., 0.}, {4000., 0.}, {4000., 4000.}, {0., 4000.}};
  ContourStack stack = drawn({square, square, square});
  stack.objects = {"outer", "dendrite", "inner"};
  stack.sections[0].contours[1].object = 1, stack.sections[0].contours[2].object = 2;
  stack.sections.push_back({.at = 9e3, .contours = {stack.sections[0].contours[1]}});
  const ContourStack two = only(stack, std::array<std::string, 2>{"inner", "outer"});
  EXPECT_EQ(two.objects, (std::vector<std::string>{"outer", "inner"}));
  ASSERT_EQ(two.sections.size(), 2u);
  ASSERT_EQ(two.sections[0].contours.size(), 2u);
  EXPECT_EQ(two.sections[0].contours[1].object, 1u);
  EXPECT_TRUE(two.sections[1].contours.empty());
  EXPECT_NE(refused([&] { (void)only(stack, std::array<std::string, 1>{"axon"}); }).find("'axon'"),
            std::string::npos);
}

TEST(Crossings, AreCountedAlsoBetweenObjects) {
  const std::vector<Place> square{{0., 0.}, {4000., 0.}, {4000., 4000.}, {0., 4000.}};
  auto shifted = square;
  for (Place& p : shifted) p += Place(2000., 1000.);
  ContourStack stack = drawn({square, shifted});
  stack.objects.push_back("inner");
  stack.sections.insert(stack.sections.begin(),
                        Section{.at = 0., .contours = {stack.sections[0].contours[0]}});
  auto found = crossings(stack);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].section, 1u);
  EXPECT_EQ(found[0].object, 0u);
  EXPECT_EQ(found[0].other, 0u);
  EXPECT_EQ(found[0].places, 2u);
  EXPECT_EQ(found[0].place, Place(2000., 4000.));
  // An inner contour that leaves the outer one is no fault of either, and told.
  stack.sections[1].contours[1].object = 1;
  stack.sections.push_back(stack.sections[1]);
  stack.sections[2].at += 1000.;
  EXPECT_EQ(fault_of(stack), "");
  found = crossings(stack);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].object, 0u);
  EXPECT_EQ(found[0].other, 1u);
  EXPECT_EQ(found[0].places, 4u);
  EXPECT_EQ(found[0].sections, 2u);
  stack.sections.pop_back();
  for (Place& p : shifted) p = Place(1000., 1000.) + .25 * p;
  stack.sections[1].contours[1].curve = straight_loop(shifted);
  EXPECT_TRUE(crossings(stack).empty());
}

}  // namespace
}  // namespace forest::cortex
