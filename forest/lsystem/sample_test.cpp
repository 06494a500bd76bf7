// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grammar.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

const std::string rows = R"(
sample twigs(kind =, cell !=, path ~ 2 -> part, cell) =
  3 0 0 -> 0.5 0 | 0 1 0 2: 0 3 0 1, 0 6 4 1.5;
  3 1 2 -> 0.25 1 | 0 1 0 1: 1 0 0 1 | 0 1 0 1: -1 0 0 1;
  3 2 100 -> 0.125 2;
  4 0 0 -> 0.75 0
)";

Grammar grammar(const std::string& rest) { return parse("steps: 1\n" + rows + rest, "twigs"); }

const Sample& twigs(const Grammar& g) { return g.lookups.samples.at(0); }

TEST(Sample, IsReadWithItsRowsAndBranches) {
  const Grammar g = grammar("axiom: A\ngrow: A -> B\n");
  const Sample& s = twigs(g);
  EXPECT_EQ(s.name, "twigs");
  ASSERT_EQ(s.rows(), 4u);
  EXPECT_EQ(s.outcome(1, 0), .25);
  EXPECT_EQ(s.outcome(2, 1), 2.);
  ASSERT_EQ(s.branches(0).size(), 1u);
  ASSERT_EQ(s.branches(1).size(), 2u);
  EXPECT_TRUE(s.branches(3).empty());
  const Trace& t = s.branches(0)[0];
  EXPECT_EQ(t.heading, Vec3(0, 1, 0));
  EXPECT_EQ(t.diameter, 2.f);
  EXPECT_EQ(t.end(), Vec3(0, 6, 4));
  EXPECT_FLOAT_EQ(t.length(), 8.f);
}

// Chances are those of the kernel: of two rows 2 apart with a width of 2, asked at the first, 1 to exp(-1/2).
TEST(Sample, DrawsByItsKernels) {
  const Grammar g = grammar("axiom: A\ngrow: A -> B\n");
  Random random(1);
  int counts[4] = {};
  constexpr int draws = 20000;
  for (int i = 0; i < draws; ++i) ++counts[twigs(g).draw(std::array{3., -1., 0.}, random)];
  EXPECT_EQ(counts[2], 0);  // fifty widths away
  EXPECT_EQ(counts[3], 0);  // of another kind
  const double share = 1. / (1. + std::exp(-.5)), expected = draws * share;
  const double chi = (counts[0] - expected) * (counts[0] - expected) / (expected * (1. - share));
  EXPECT_LT(chi, 10.8);  // of one degree of freedom, one time in a thousand more
}

// Of many rows and conditions most are out of the question by the first of these: chances are those of all nevertheless.
TEST(Sample, OfManyRowsEachHasItsChance) {
  constexpr std::size_t many = 300, wide = 10;
  Random random(3);
  Sample sample;
  for (std::size_t c = 0; c < wide; ++c)
    sample.conditions.push_back({fmt::format("c{}", c), Sample::Match::like, .5 + double(c % 4)});
  std::vector<std::array<double, wide>> values(many);
  for (auto& row : values) {
    for (double& x : row) x = random.uniform();
    sample.add(row, {}, {});
  }
  sample.finish();
  const auto logarithm = [&](std::size_t row, const std::array<double, wide>& wanted) {
    double sum = 0.;
    for (std::size_t c = 0; c < wide; ++c)
      sum -= .5 * std::pow((values[row][c] - wanted[c]) / sample.conditions[c].width, 2);
    return sum;
  };
  std::array<double, wide> near, far;
  near.fill(.8), far.fill(3.);
  for (const auto& wanted : {near, far}) {
    std::vector<double> chances(many);
    for (std::size_t row = 0; row < many; ++row) chances[row] = std::exp(logarithm(row, wanted));
    const double all = std::accumulate(chances.begin(), chances.end(), 0.);
    constexpr int draws = 30000;
    std::vector<int> counts(many);
    for (int i = 0; i < draws; ++i) ++counts[sample.draw(wanted, random)];
    double chi = 0., degrees = -1., rest = draws, rest_drawn = draws;
    for (std::size_t row = 0; row < many; ++row) {
      const double expected = draws * chances[row] / all;
      if (expected < 5.) continue;
      chi += std::pow(counts[row] - expected, 2) / expected, ++degrees;
      rest -= expected, rest_drawn -= counts[row];
    }
    if (rest > 1.) chi += std::pow(rest_drawn - rest, 2) / rest, ++degrees;
    EXPECT_GT(degrees, 20.);
    EXPECT_LT(chi, degrees + 4. * std::sqrt(2. * degrees));  // one time in some ten thousand more
  }
  far.back() = NAN;
  EXPECT_THROW((void)sample.draw(far, random), Error);
  far.back() = INFINITY;
  EXPECT_LT(sample.draw(far, random), many);
  // So far that nothing can be told by the last digits: one of the nearest by the first conditions, never a failure.
  near.fill(1e9);
  EXPECT_LT(sample.draw(near, random), many);
}

TEST(Sample, TakesAnotherAndTheNearest) {
  const Grammar g = grammar("axiom: A\ngrow: A -> B\n");
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(twigs(g).draw(std::array{3., 0., 0.}, random), 1u);    // not of neuron 0
    EXPECT_EQ(twigs(g).draw(std::array{3., 9., 300.}, random), 2u);  // far from all of them
    EXPECT_EQ(twigs(g).draw(std::array{4., 0., 0.}, random), 3u);    // there is no other
  }
  EXPECT_THROW((void)twigs(g).draw(std::array{5., 0., 0.}, random), Error);
}

TEST(Sample, IsAskedInExpressions) {
  const Grammar g =
      grammar("cell r = twigs(4, 1, 0)\naxiom: A(r)\ngrow: A(x) -> B(x, twigs.part(x), twigs)\n");
  const Word word = derive(g);
  EXPECT_EQ(word.parameters, (std::vector<double>{3., .75, 0.}));
  // The same seed, the same rows.
  const Grammar many =
      grammar("axiom: A(twigs(3, -1, 1)) A(twigs(3, -1, 1)) A(twigs(3, -1, 1))\ngrow: A(x) -> B(x)\n");
  EXPECT_EQ(derive(many, 5, 7).parameters, derive(many, 5, 7).parameters);
}

TEST(Sample, AParameterOfItsNameIsThatParameter) {
  const Grammar g = parse(
      "sample s(-> b) = 8; 9\nfunction f(s) = 2 * s\naxiom: A(5)\n"
      "p: A(s) -> B(s, f(s), s.b(1))\nq: B(a, b, c) -> C(s)\n",
      "test");
  EXPECT_EQ(to_string(derive(g, 0, 0, 1), g), "B(5,10,9)");
  EXPECT_EQ(to_string(derive(g, 0, 0, 2), g), "C(0)");  // elsewhere the sample's number
}

TEST(Sample, WidthsMayDependOnWhatIsTheSame) {
  const Grammar g = parse(
      "table wide = 3: 0.1, 4: 100\nsample s(kind =, x ~ wide(kind)) = 3 0; 3 1; 4 0; 4 1\naxiom: A\ngrow: A "
      "-> B\n",
      "widths");
  Random random(3);
  int others = 0;
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(g.lookups.samples[0].draw(std::array{3., 0.}, random), 0u);
    others += g.lookups.samples[0].draw(std::array{4., 0.}, random) == 3u;
  }
  EXPECT_NEAR(others, 100, 40);
}

TEST(Sample, MistakesAreNamed) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      (void)parse(text + "\naxiom: A\ngrow: A -> B\n", "wrong");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::pair<const char*, const char*> cases[] = {
      {"sample s(x) = 1", "width of its kernel"},
      {"sample s(x ~ 0) = 1", "above 0"},
      {"sample s(x ~ 1 -> y) = 1", "'->' is missing"},
      {"sample s(x ~ 1 -> y) = 1 -> 2 3", "should end here"},
      {"sample s(x ~ 1) = ", "has no row"},
      {"sample s(x =) = 1 | 0 1 0: 1 1 1 1", "a number is missing"},
      {"sample s(x =) = 1 | 0 1 0 1: 1 1 1", "a number is missing"},
      {"sample s(x =) = 1 | 0 1 0 1 1 1 1 1", "':' is missing"},
      {"table t = 1: 1\nsample s(x ~ t(kind)) = 1", "no condition before this one"},
      {"sample s(x =) = 1; 2\ncell c = s.y(1)", "no outcome 'y'"},
      {"sample s(x =) = 1; 2\ncell c = s(1, 2)", "takes 1 argument"},
      {"sample s(x =) = 1; 2\nfunction f(x) = s(x)", "may not draw"},
  };
  for (const auto& [text, words] : cases) {
    const std::string said = refusal(text);
    EXPECT_NE(said.find(words), std::string::npos) << text << ": " << said;
    EXPECT_NE(said.find("wrong:"), std::string::npos) << said;
  }
}

TEST(Sample, TellsWhereABranchHeads) {
  const std::vector<Trace::Stop> straight{{{0, 10, 0}, 1}, {{0, 40, 0}, 1}, {{0, 40, 15}, 1}};
  const Vec3 heading = heading_at_end(Vec3::Zero(), straight);  // over 20 µm: 15 along z, 5 along y
  EXPECT_NEAR((heading - Vec3(0, 5, 15).normalized()).norm(), 0.f, 1e-6f);
  EXPECT_EQ(heading_at_end(Vec3::Zero(), {}), Vec3(Vec3::Zero()));
}

// ── Drawn ──

Morphology drawn(const std::string& word) {
  const Grammar g = grammar("axiom: Soma(10) " + word + "\nnothing: z -> z\n");
  return interpret(derive(g, 0, 0, 0), g);
}
Vec3 end_of(const std::string& word) { return drawn(word).points().back().position(); }
void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_NEAR((a - b).norm(), 0.f, 1e-5f) << a.transpose() << " and " << b.transpose();
}

TEST(Trace, IsDrawnAsItWasTraced) {
  const Morphology m = drawn("At(1, 2, 3) Trace(twigs, 0, 0)");
  ASSERT_EQ(m.sections().size(), 1u);
  const auto points = m.points();
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0], (Point{1, 2, 3, 1}));
  EXPECT_EQ(points[1], (Point{1, 5, 3, .5f}));
  EXPECT_EQ(points[2], (Point{1, 8, 7, .75f}));
}

TEST(Trace, IsScaledMirroredTurnedAndBent) {
  expect_near(end_of("Trace(twigs, 0, 0, scale = 2)"), {0, 12, 8});
  expect_near(end_of("Trace(twigs, 0, 0, mirror = 2)"), {0, 6, -4});
  expect_near(end_of("Trace(twigs, 1, 1, mirror = 1)"), {1, 0, 0});
  expect_near(end_of("Trace(twigs, 0, 0, steep = 2)"), {0, 6, 8});
  expect_near(end_of("Trace(twigs, 0, 0, scale = 2, mirror = 2, steep = 0.5)"), {0, 12, -4});
  expect_near(end_of("Head(1, 0, 0) Trace(twigs, 0, 0)"), {6, 0, 4});  // about z, as the slice lies
  expect_near(end_of("Head(1, 0, 0) Trace(twigs, 0, 0, turn = 0)"), {0, 6, 4});
  expect_near(end_of("Head(1, 0, 0) Trace(twigs, 0, 0, turn = 0.5, about = 45)"), {0, 6, 4});
  // Twice as far from its chord, with the same end; three times as thick as a branch of another row, which is 1 everywhere, but in
  // the end no thinner than 3.5.
  const Morphology m = drawn(
      "Trace(twigs, 0, 0, bent = 2, like = 1, thickness = 3) Trace(twigs, 0, 0, like = 1, thickness = 3, "
      "thinnest = 3.5)");
  const Vec3 on_chord = Vec3(0, 6, 4) * (3.f / 8.f);
  expect_near(m.points()[1].position(), on_chord + 2.f * (Vec3(0, 3, 0) - on_chord));
  expect_near(m.points()[2].position(), {0, 6, 4});
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_FLOAT_EQ(m.points()[i].radius, 1.5f);
  EXPECT_FLOAT_EQ(m.points().back().radius, 1.75f);
}

TEST(Trace, IsDrawnAsideInProportionToTheWayAndToItsClimbs) {
  const std::string along = "Trace(twigs, 0, 0, x = 8, z = ", climbing = ", climbing = 1)";
  const Morphology even = drawn(along + "-16)");
  expect_near(even.points()[1].position(), {3, 3, -6});  // after 3 of 8 µm
  expect_near(even.points()[2].position(), {8, 6, -12});
  const Morphology m = drawn(along + "-1.6" + climbing);
  expect_near(m.points()[1].position(), {3, 3, 0});  // no climb yet
  expect_near(m.points()[2].position(), {8, 6, 2.4f});
  // However far: the first step stays level.
  const Morphology far = drawn(along + "-16" + climbing);
  expect_near(far.points()[1].position(), {3, 3, 0});
  expect_near(far.points()[2].position(), {8, 6, -12});
  // It heads where it has been drawn.
  const Vec3 straight = end_of("Trace(twigs, 0, 0) F(1)") - end_of("Trace(twigs, 0, 0)"),
             aside = end_of(along + "-16) F(1)") - end_of(along + "-16)");
  expect_near(aside, (straight + Vec3(1, 0, -2)).normalized());
}

Trace traced(std::vector<Trace::Stop> stops) {
  Sample sample;
  sample.add({}, {}, {{.heading = Vec3::UnitX(), .diameter = 1.f, .stops = std::move(stops)}});
  return sample.branches(0)[0];
}

std::vector<float> diameters_for(const Trace& t, std::vector<float> along) {
  const std::vector<Calibre> told = calibres(t, along);
  EXPECT_EQ(told.front().change, along.size() > 1 ? 0.f : 1.f);
  EXPECT_EQ(told.back().change, 1.f);
  std::vector<float> diameters;
  for (const Calibre& c : told) diameters.push_back(c.diameter);
  return diameters;
}

TEST(Calibres, AreThoseThatWereTracedWhereStepsAreThoseThatWere) {
  const Trace t = traced({{{1, 0, 0}, 4}, {{2, 0, 0}, 3}, {{4, 0, 0}, 3}, {{5, 0, 0}, 1}, {{9, 0, 0}, 2}});
  EXPECT_EQ(diameters_for(t, t.lengths), (std::vector<float>{4, 3, 3, 1, 2}));
  EXPECT_EQ(diameters_for(t, {7}), std::vector<float>{2});
  EXPECT_EQ(diameters_for(t, {7, 8}), (std::vector<float>{4, 2}));
  EXPECT_EQ(diameters_for(traced({{{1, 0, 0}, 4}}), {1, 2, 3}), (std::vector<float>{4, 4, 4}));
}

TEST(Calibres, WaverAsOftenAsTheyDidHoweverManyPlacesThereAre) {
  std::vector<Trace::Stop> stops;
  for (int i = 0; i < 10; ++i) stops.push_back({Vec3(float(i + 1), 0, 0), i % 2 ? 2.f : 1.f});
  const Trace t = traced(stops);
  for (const std::size_t places : {4u, 8u, 10u, 12u, 18u, 40u, 200u}) {
    std::vector<float> along;
    for (std::size_t i = 0; i < places; ++i) along.push_back(float(i + 1));
    const std::vector<float> told = diameters_for(t, along);
    ASSERT_EQ(told.size(), places);
    for (std::size_t i = 0; i < places; ++i) EXPECT_EQ(told[i], i % 2 ? 2.f : 1.f) << places;
  }
}

TEST(Calibres, ChangeInStepsAboutAsLongAsThoseThatTheyChangedIn) {
  const Trace t =
      traced({{{1, 0, 0}, 1}, {{5, 0, 0}, 2}, {{6, 0, 0}, 2}, {{10, 0, 0}, 1.5f}, {{11, 0, 0}, 1.5f}});
  EXPECT_EQ(diameters_for(t, {1, 2, 6, 7, 11}), (std::vector<float>{1, 1, 2, 2, 1.5f}));
}

// A branch whose diameter changed by 2 µm a µm at most, told along shorter steps.
TEST(Trace, DiametersChangeNoFasterThanTheyDid) {
  const Grammar g = parse(R"(sample twigs() = | 1 0 0 1: 1 0 0 1, 1.1 0 0 1, 1.2 0 0 1, 5 0 0 1;
  | 1 0 0 1: 1 0 0 1, 2 0 0 3, 3 0 0 1, 4 0 0 1
axiom: Soma(10) Trace(twigs, 0, 0, like = 1)
nothing: z -> z
)",
                          "g");
  const Morphology m = interpret(derive(g, 0, 0, 0), g);
  ASSERT_EQ(m.points().size(), 5u);
  const std::array<float, 5> radii{.5f, .5f, .6f, .5f, .5f};
  for (std::size_t i = 0; i < radii.size(); ++i) EXPECT_NEAR(m.points()[i].radius, radii[i], 1e-5f) << i;
}

// Twice as thick where it begins, as thick where it ends, and in between as the diameter itself changes: here at once, but by no
// more than 2 µm a µm, so that it has to begin a step earlier.
TEST(Trace, WhatIsAsThickAsWhatWasBeforeItRemainsSo) {
  const Grammar g = parse(R"(sample twigs() = | 1 0 0 4: 1 0 0 4, 2 0 0 4, 3 0 0 2, 4 0 0 2;
  | 1 0 0 4: 1 0 0 4, 2 0 0 4, 3 0 0 4
axiom: Trace(twigs, 0, 0, thickness = 2, last = 1) Trace(twigs, 1, 0, last = 0.25)
none: A ->
)",
                          "t");
  std::vector<float> radii;
  const Morphology m = interpret(derive(g, 0, 0, 0), g);
  for (const Point& p : m.points()) radii.push_back(p.radius);
  EXPECT_EQ(radii, (std::vector<float>{4, 4, 3, 2, 1, 2, 1, .5f}));  // one that never changes does so evenly
}

// What multiplying a diameter and dividing it again leaves of it is not another diameter.
TEST(Trace, DaughtersBeginWithThePointOfTheForkInAFileOfPoints) {
  const Grammar g = parse(R"(sample twigs() = | 1 0 0 0.7: 1 0 0 0.7
axiom: Soma(1) Trace(twigs, 0, 0, thickness = 0.37 / 0.7) [ Trace(twigs, 0, 0, thickness = 0.37000001 / 0.7) ] [ Head(0, 1, 0) Trace(twigs, 0, 0) ]
none: A ->
)",
                          "t");
  const Morphology m = interpret(derive(g, 0, 0, 0), g);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.points(SectionId(1)).front(), m.points(SectionId(0)).back());
  EXPECT_NE(m.points(SectionId(2)).front(), m.points(SectionId(0)).back());  // this one is thicker
}

TEST(Course, IsLongerOrShorterByWholeStepsAndEndsWhereItShould) {
  std::vector<Trace::Stop> stops;
  Vec3 at = Vec3::Zero();
  for (int i = 0; i < 40; ++i) {
    at += Vec3(1.f + .5f * std::sin(float(7 * i)), std::cos(float(3 * i)), i % 5 ? 0.f : .8f);
    stops.push_back({at, 1.f});
  }
  const Trace t = traced(stops);
  const auto steps_of = [](const Course& course) {
    std::vector<float> steps;
    float before = 0.f;
    for (const float length : course.lengths) steps.push_back(length - std::exchange(before, length));
    return steps;
  };
  const std::vector<float> traced_steps = steps_of(Course(t, 1.f));
  for (const float scale : {.6f, .9f, 1.f, 1.1f, 1.6f, 2.f}) {
    SCOPED_TRACE(scale);
    const Course course(t, scale);
    EXPECT_EQ(course.places.size(), std::size_t(std::lround(40.f * scale)));
    EXPECT_LT((course.places.back() - t.end()).norm(), 1e-3f);
    for (const float step : steps_of(course)) {  // each was traced
      const auto nearest =
          std::ranges::min_element(traced_steps, {}, [&](float s) { return std::abs(s - step); });
      EXPECT_LT(std::abs(*nearest - step), 1e-4f);
    }
  }
  const Course few(traced({{{3, 0, 0}, 1}, {{8, 6, 0}, 1}}), 1.5f);
  EXPECT_EQ(few.places.size(), 2u);
  const Course still(traced(std::vector<Trace::Stop>(6, {{0, 0, 0}, 1})), .5f);
  EXPECT_EQ(still.places.size(), 6u);
}

// A branch that wanders, climbs in leaps both up and down, and is flat between them.
Trace wandering() {
  std::vector<Trace::Stop> stops;
  Vec3 at = Vec3::Zero();
  for (int i = 0; i < 60; ++i) {
    const float climb = i % 3 ? 0.f : (i % 2 ? -.4f : .9f) * (1.f + .5f * std::sin(float(i)));
    at += Vec3(1.f, .4f * std::cos(float(5 * i)), climb);
    stops.push_back({at, 1.f});
  }
  return traced(stops);
}
struct Turned {
  double mean, sd;
};
Turned turns_of(const Course& course) {
  std::vector<double> turns;
  Vec3 before = Vec3::Zero(), step = Vec3::Zero();
  for (const Vec3& place : course.places) {
    const Vec3 next = place - std::exchange(before, place);
    if (!step.isZero(0.f))
      turns.push_back(std::atan2(double(step.cross(next).norm()), double(step.dot(next))));
    step = next;
  }
  double sum = 0., squares = 0.;
  for (const double t : turns) sum += t, squares += t * t;
  const double mean = sum / double(turns.size());
  return {mean, std::sqrt(squares / double(turns.size()) - mean * mean)};
}

TEST(Course, ClimbsAsFarInStepsThatDifferMoreOrLess) {
  const Course was(wandering(), 1.f);
  const auto climbs_of = [](const Course& course) {
    std::vector<float> climbs;
    float z = 0.f;
    for (const Vec3& p : course.places) climbs.push_back(p.z() - std::exchange(z, p.z()));
    return climbs;
  };
  const std::vector<float> before = climbs_of(was);
  const auto squares = [](const std::vector<float>& climbs) {
    double sum = 0.;
    for (const float c : climbs) sum += double(c) * double(c);
    return sum;
  };
  for (const float power : {.5f, 1.f, 2.f}) {
    SCOPED_TRACE(power);
    Course is = was;
    is.stairs(power);
    const std::vector<float> after = climbs_of(is);
    double up = 0., down = 0.;
    for (std::size_t i = 0; i < after.size(); ++i) {
      EXPECT_EQ(is.places[i].head<2>(), was.places[i].head<2>());
      EXPECT_GE(after[i] * before[i], -1e-6f);
      if (std::abs(before[i]) < 1e-6f) {
        EXPECT_LT(std::abs(after[i]), 1e-5f);
      }
      (before[i] > 0.f ? up : down) += double(after[i] - before[i]);
    }
    EXPECT_NEAR(up, 0., 1e-4);
    EXPECT_NEAR(down, 0., 1e-4);
    if (power != 1.f) {
      EXPECT_EQ(squares(after) > squares(before), power > 1.f);
    }
  }
}

bool level(const Course& course, std::size_t i) {
  return std::abs(course.places[i].z() - (i ? course.places[i - 1].z() : 0.f)) < 1e-5f;
}
int levels_of(const Course& course) {
  int count = 0;
  for (std::size_t i = 0; i < course.places.size(); ++i) count += level(course, i);
  return count;
}

TEST(Course, HasAsManyLevelStepsAsItIsAskedAndEndsAsHighAsItDid) {
  const Course was(wandering(), 1.f);  // 40 steps of 60 are level
  ASSERT_EQ(levels_of(was), 40);
  for (const auto& [share, levels] : {std::pair{-1.f, 0}, {-.5f, 20}, {0.f, 40}, {.5f, 50}, {1.f, 59}}) {
    SCOPED_TRACE(share);
    Course is = was;
    is.levels(share);
    EXPECT_EQ(levels_of(is), levels);
    EXPECT_NEAR(is.places.back().z(), was.places.back().z(), 1e-4f);
    for (std::size_t i = 0; i < is.places.size(); ++i) {
      EXPECT_EQ(is.places[i].head<2>(), was.places[i].head<2>());
      if (share > 0.f && level(was, i)) {
        EXPECT_TRUE(level(is, i)) << i;
      }
      if (share < 0.f && !level(was, i)) {
        EXPECT_FALSE(level(is, i)) << i;
      }
    }
  }
  const Trace flat = traced({{{3, 0, 0}, 1}, {{4, 0, 0}, 1}});
  EXPECT_TRUE(flat.level);
  EXPECT_FALSE(wandering().level);
  for (const float share : {-1.f, 1.f}) {  // nothing climbs
    Course all(flat, 1.f);
    all.levels(share);
    EXPECT_EQ(levels_of(all), 2);
    Course one(traced({{{3, 0, 1}, 1}}), 1.f);  // and what has to
    one.levels(share);
    EXPECT_EQ(one.places[0].z(), 1.f);
  }
}

TEST(Course, EndsHigherOrLowerAndLevelStepsStayLevel) {
  const Course was(wandering(), 1.f);
  for (const float by : {-40.f, -2.f, .5f, 30.f}) {
    SCOPED_TRACE(by);
    Course is = was;
    is.climb(by);
    EXPECT_NEAR(is.places.back().z(), was.places.back().z() + by, 1e-3f);
    for (std::size_t i = 0; i < is.places.size(); ++i) {
      EXPECT_EQ(is.places[i].head<2>(), was.places[i].head<2>());
      if (level(was, i)) {
        EXPECT_TRUE(level(is, i)) << i;
      }
    }
  }
  for (const float scale : {.6f, 1.4f})  // by steps that are left out or come twice, too
    EXPECT_GT(levels_of(Course(wandering(), scale)), std::lround(.6f * 60.f * scale));
  Course all(traced({{{3, 0, 0}, 1}, {{4, 0, 0}, 1}}), 1.f);
  all.climb(2.f);
  EXPECT_NEAR(all.places[0].z(), 1.5f, 1e-6f);
  EXPECT_NEAR(all.places[1].z(), 2.f, 1e-6f);
}

TEST(Course, IsAsManyTimesAsKinkedAndAsUnevenlyAsItIsAsked) {
  const Course was(wandering(), 1.f);
  const Turned before = turns_of(was);
  for (const float times : {.7f, 1.f, 1.4f}) {
    Course is = was;
    is.kinks(times, 1.f);
    EXPECT_NEAR(turns_of(is).mean / before.mean, double(times), .2) << times;  // what z does to them stays
    EXPECT_EQ(is.places.back(), was.places.back());
    for (std::size_t i = 0; i < is.places.size(); ++i) EXPECT_EQ(is.places[i].z(), was.places[i].z());
  }
  Course even = was, uneven = was;
  even.kinks(1.f, .6f), uneven.kinks(1.f, 1.6f);
  EXPECT_LT(turns_of(even).sd, .95 * before.sd);
  EXPECT_GT(turns_of(uneven).sd, 1.05 * before.sd);
  Course still(traced(std::vector<Trace::Stop>(6, {{0, 0, 0}, 1})), 1.f);
  still.stairs(2.f), still.kinks(1.5f, 2.f);  // nothing to change
  for (const Vec3& place : still.places) EXPECT_EQ(place, Vec3(Vec3::Zero()));
}

TEST(Trace, TurnsTheEndOfTheBranchBeforeAsItsForkWas) {
  const std::string text = R"(steps: 1
sample stems(-> x) = 0 | 0 1 0 1: 0 5 0 1, 0 8 0 1, 0 25 0 1, 0 28 0 1, 0 30 0 1
sample forks(-> x) = 0 | 0 1 0 1, 0.6 0.8 0: 5 0 0 1, 10 0 0 1 | 0 1 0 1, 0.6 0.8 0: -5 0 0 1, -10 0 0 1
axiom: Soma(1) Trace(stems, 0, 0) [ Trace(forks, 0, 0) ] [ Trace(forks, 0, 1) ]
nothing: z -> z
)";
  const Grammar g = parse(text, "fork");
  const Morphology m = interpret(derive(g, 0, 0, 0), g);
  const auto stem = m.points(SectionId(0));
  const Vec3 end = stem.back().position(), last = end - stem[stem.size() - 2].position();
  EXPECT_LT((end - Vec3(0, 30, 0)).norm(), 1e-4f);
  EXPECT_LT((last.normalized() - Vec3(.6f, .8f, 0)).norm(), 1e-4f);
  EXPECT_NEAR(last.norm(), 2.f, 1e-4f);
  EXPECT_EQ(stem[1].position(), Vec3(0, 5, 0));  // how it leaves the soma is its own
  EXPECT_EQ(stem[2].position(), Vec3(0, 8, 0));  // farther than the turn reaches
  EXPECT_EQ(m.points(SectionId(1))[1].position(), end + Vec3(5, 0, 0));
}

// The fork stood on a step that climbed; the branch ends as high as it did, and what was level of it stays so.
TEST(Trace, TurnsAnEndUpwardsByStepsThatAreNotLevel) {
  const auto stem_before = [](const std::string& last_step) {
    const Grammar g = parse(
        "steps: 1\nsample stems(-> x) = 0 | 0 1 0 1: 0 5 0 1, 0 22 0 1, 0 25 0 1, 0 27 2 1, 0 28 2 1, 0 30 2 "
        "1\n"
        "sample forks(-> x) = 0 | 0 1 0 1, " +
            last_step + ": 5 0 0 1 | 0 1 0 1, " + last_step +
            ": -5 0 0 1\naxiom: Soma(1) Trace(stems, 0, 0) [ Trace(forks, 0, 0) ] [ Trace(forks, 0, 1) ]\n"
            "nothing: z -> z\n",
        "fork");
    const Morphology m = interpret(derive(g, 0, 0, 0), g);
    const auto points = m.points(SectionId(0));
    std::vector<Vec3> places;
    for (const Point& p : points) places.push_back(p.position());
    return places;
  };
  const std::vector<Vec3> up = stem_before("0 0.8 0.6"), level = stem_before("0.6 0.8 0");
  expect_near(up.back(), {0, 30, 2});
  expect_near((up[6] - up[5]).normalized(), Vec3(0, .8f, .6f));
  EXPECT_NEAR(up[5].z(), up[4].z(), 1e-5f);  // levels, and what bears it
  EXPECT_NEAR(up[4].z(), .8f, 1e-5f);
  EXPECT_NEAR(up[3].z(), 0.f, 1e-5f);
  expect_near((level[6] - level[5]).normalized(), Vec3(.6f, .8f, 0));
  for (const std::size_t i : {1u, 2u, 3u}) EXPECT_NEAR(level[i].z(), 0.f, 1e-6f);
  for (const std::size_t i : {4u, 5u, 6u}) EXPECT_NEAR(level[i].z(), 2.f, 1e-6f);
}

TEST(Trace, TurnsNoEndBeyondWhereATurtleBeganAnew) {
  const Grammar g = parse(R"(steps: 1
sample stems(-> x) = 0 | 0 1 0 1: 0 5 0 1, 0 8 0 1
sample forks(-> x) = 0 | 0 1 0 1, 0.6 0.8 0: 5 0 0 1
axiom: Soma(1) Trace(stems, 0, 0) f(50) F(2) F(2) Trace(forks, 0, 0)
nothing: z -> z
)",
                          "anew");
  const Morphology m = interpret(derive(g, 0, 0, 0), g);
  expect_near(m.points(SectionId(1)).front().position(), {0, 58, 0});
  expect_near(m.points(SectionId(1)).back().position(), {5, 62, 0});
}

TEST(Trace, WhatIsLevelAllAlongIsNotDrawnAsideAlongZ) {
  const std::string aside = "Trace(twigs, 1, 0, x = 4, z = 6";
  EXPECT_NEAR(end_of(aside + ")").z(), 6.f, 1e-5f);
  EXPECT_NEAR(end_of(aside + ", climbing = 1)").z(), 0.f, 1e-5f);
  expect_near(end_of(aside + ", climbing = 0.5)"), end_of(aside + ")") - Vec3(0, 0, 3));
  // Unless its tracer kept no level.
  expect_near(end_of(aside + ", climbing = 1, levelled = -1)"), end_of(aside + ")"));
}

// Of 2, 1.5 and 1 µm, scaled: those that a gauge of .5, 1.2 and 3 µm has.
TEST(Gauge, DiametersAreTheNearestOfThoseThatItHas) {
  const auto diameters = [](const std::string& before, const std::string& thickness) {
    const Grammar g = grammar(
        "sample gauges(-> cell) = 0 | 0 1 0 0.5: 0 0 0 0.5, 0 0 0 1.2, 0 0 0 3; 1 | 0 1 0 3: 0 0 0 3, 0 0 0 "
        "2\naxiom: Soma(1) Basal " +
        before + " Trace(twigs, 0, 0, thickness = " + thickness + ")\nnothing: z -> z\n");
    const Morphology m = interpret(derive(g, 0, 0, 0), g);
    std::vector<float> found;
    for (const Point& p : m.points(SectionId(0))) found.push_back(2.f * p.radius);
    return found;
  };
  EXPECT_EQ(diameters("", "1"), (std::vector<float>{2, 1, 1.5f}));
  EXPECT_EQ(diameters("Gauge(gauges, 0)", "1"), (std::vector<float>{1.2f, 1.2f, 1.2f}));
  EXPECT_EQ(diameters("Gauge(gauges, 0)", "1.5"), (std::vector<float>{3, 1.2f, 3}));
  EXPECT_EQ(diameters("Gauge(gauges, 0)", "0.5"), (std::vector<float>{1.2f, .5f, .5f}));
  // Beyond the thickest as far apart as two of them are at least: .7 µm.
  const std::vector<float> thick = diameters("Gauge(gauges, 0)", "9"), expected{17.7f, 9.3f, 13.5f};
  ASSERT_EQ(thick.size(), expected.size());
  for (std::size_t i = 0; i < thick.size(); ++i) EXPECT_NEAR(thick[i], expected[i], 1e-5f);
  EXPECT_EQ(diameters("[ Gauge(gauges, 0) ]", "1"), diameters("", "1"));
  EXPECT_EQ(diameters("Gauge(gauges, 0, 1)", "1"), diameters("Gauge(gauges, 0)", "1"));  // it has no points
  EXPECT_THROW((void)diameters("Gauge(gauges, 1)", "1"), Error);                         // which fall
  EXPECT_THROW((void)diameters("Gauge(gauges, 2)", "1"), Error);                         // there is none
}

// A quarter of its points has .5 µm, a half 1 and a quarter 3.
TEST(Gauge, DiametersBecomeAsFrequentAsItsOwnAndKeepTheirOrder) {
  for (const std::size_t count : {20u, 44u, 100u}) {
    const auto radii = [&](const std::string& even) {
      std::string axiom = "Soma(1) Basal Gauge(gauges, 0" + even + ") At(0, 1, 0)";
      for (std::size_t i = 0; i < count; ++i)
        axiom += fmt::format(" F(1, {})", .1 + .3 * double(7 * i % count));
      const Grammar g =
          grammar("sample gauges(-> cell) = 0 | 0 1 0 0.5: 10 0 0 0.5, 20 0 0 1, 10 0 0 3\naxiom: " + axiom +
                  "\nnothing: z -> z\n");
      const Morphology m = interpret(derive(g, 0, 0, 0), g);
      std::vector<float> found;
      for (const Point& p : m.points(SectionId(0)).subspan(1)) found.push_back(p.radius);
      return found;
    };
    const std::vector<float> before = radii(""), half = radii(", 0.5"), after = radii(", 1");
    EXPECT_EQ(before, radii(", 0"));
    EXPECT_EQ(after, radii(", 7"));
    std::vector<std::size_t> by_size(count);
    std::iota(by_size.begin(), by_size.end(), 0);
    std::ranges::sort(by_size, {}, [&](std::size_t i) { return before[i]; });
    const auto rises = [&](const std::vector<float>& found) {
      return std::ranges::is_sorted(by_size, {}, [&](std::size_t i) { return found[i]; });
    };
    EXPECT_TRUE(rises(half) && rises(after)) << count;
    // The point where the branch begins is one, too.
    const auto expect = [&](float radius, std::size_t times) {
      EXPECT_NEAR(double(std::ranges::count(after, radius)), double(times), 1.) << count << ": " << radius;
    };
    expect(.25f, count / 4), expect(.5f, count / 2), expect(1.5f, count / 4);
    EXPECT_NE(half, after);
  }
}

TEST(Trace, LeavesTheTurtleHeadingAsItEnds) {
  expect_near(end_of("Trace(twigs, 1, 0) F(2)"), {3, 0, 0});
  expect_near(end_of("Head(0, 0, 1) F(2)"), {0, 0, 2});
}

TEST(Trace, OfWhatIsNotThereIsRefused) {
  for (const char* word :
       {"Trace(twigs, 9, 0)", "Trace(twigs, 3, 0)", "Trace(twigs, 0, 1)", "Trace(7, 0, 0)",
        "Trace(twigs, 0.5, 0)", "Trace(twigs, 0, 0, mirror = 7)", "Trace(twigs, 0, 0, mirror = 0.5)",
        "Trace(twigs, 0, 0, mirror = 1e300)", "Trace(twigs, 0, 0, mirror = -1)"})
    EXPECT_THROW((void)drawn(word), Error) << word;
}

// A module that grows up to a ceiling: where it is comes from ?P, where it heads from ?H.
TEST(Questions, AreAnsweredAfterEveryStep) {
  const Grammar g = parse(
      "steps: 20\nmodule Tip(n)\naxiom: f(5) F(1) Tip(0) ?P(0, 0, 0) ?H(0, 0, 0)\n"
      "up: Tip(n) > ?P(x, y, z) ?H(hx, hy, hz) : y < 30 & hy > 0.9 -> F(10) Tip(n + 1)\n"
      "side: Tip(n) > ?P(x, y, z) ?H(hx, hy, hz) : hy > 0.9 -> -(90) F(y) \n",
      "ceiling");
  const Morphology m = interpret(derive(g), g);
  // 6, 16, 26, 36: then to the right, as far as it is high.
  expect_near(m.points().back().position(), {36, 36, 0});
}

// Whither the last step went is not where the turtle heads: it has turned since, or heads where the last 20 µm led.
TEST(Questions, TellTheLastStep) {
  const auto told = [](const std::string& before) {
    const Grammar g = grammar("axiom: " + before + " Q ?S(9, 9, 9)\nasked: Q > ?S(x, y, z) -> B(x, y, z)\n");
    const Word word = derive(g);
    for (const Module& m : word.modules)
      if (g.symbols[m.symbol] == "B") {
        const auto values = word.of(m);
        return Vec3(float(values[0]), float(values[1]), float(values[2]));
      }
    return Vec3(Vec3::Constant(9.f));
  };
  expect_near(told("Soma(10)"), {0, 0, 0});
  expect_near(told("-(90) F(3) +(90)"), {1, 0, 0});
  expect_near(told("[ -(90) F(3) ] F(3)"), {0, 1, 0});
  expect_near(told("Trace(twigs, 0, 0)"), {0, .6f, .8f});
  expect_near(told("Trace(twigs, 0, 0, mirror = 2)"), {0, .6f, -.8f});
  expect_near(told("Trace(twigs, 0, 0, about = -90)"), {.6f, 0, .8f});
}

}  // namespace
}  // namespace forest::lsystem
