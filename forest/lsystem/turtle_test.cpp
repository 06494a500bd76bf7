// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/turtle.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"
#include "forest/lsystem/derive.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

#include "tests/refused.h"

namespace forest::lsystem {
namespace {

Morphology drawn(const std::string& word, const std::string& declarations = "angle: 90\n") {
  const Grammar g = parse(declarations + "axiom: " + word + "\nnothing: z -> z\n", "turtle");
  return interpret(derive(g, 0, 0, 0), g);
}

Vec3 end_of(const std::string& word) { return drawn(word).points().back().position(); }

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_NEAR((a - b).norm(), 0.f, 1e-5f) << a.transpose() << " and " << b.transpose();
}

TEST(Turtle, HeadsToThePiaWithItsLeftAtMinusX) {
  expect_near(end_of("F(3)"), {0, 3, 0});
  expect_near(end_of("+F"), {-1, 0, 0});
  expect_near(end_of("-F"), {1, 0, 0});
  expect_near(end_of("&F"), {0, 0, -1});
  expect_near(end_of("^F"), {0, 0, 1});
  expect_near(end_of("|F"), {0, -1, 0});
  expect_near(end_of("/+F"), {0, 0, 1});    // the left wing is up
  expect_near(end_of("\\+F"), {0, 0, -1});  // the left wing is down
  expect_near(end_of("/(30)\\(30)+F"), {-1, 0, 0});
  expect_near(end_of("f(2)F(1)"), {0, 3, 0});
}

TEST(Turtle, AFibreKeepsTogetherWhatLeavesIt) {
  const Morphology insect =
      drawn("Axon Fibre(3) [ At(0, 0, 0) F(5, 1) ] [ At(0, 0, 0) +F(4, 1) ] [ At(0, 0, 7) -F(4, 1) ]");
  EXPECT_EQ(insect.soma().kind, SomaKind::none);
  ASSERT_EQ(insect.sections().size(), 4u);
  ASSERT_EQ(insect.roots().size(), 2u);  // the last one stands elsewhere
  const SectionId root = insect.roots()[0];
  EXPECT_EQ(insect.points(root).size(), 1u);
  EXPECT_EQ(insect.points(root)[0].radius, 1.5f);
  EXPECT_EQ(insect.children(root).size(), 2u);
  // A single one goes on from it.
  const Morphology one = drawn("Axon Fibre(3) [ At(0, 0, 0) F(5, 1) ]");
  ASSERT_EQ(one.sections().size(), 1u);
  EXPECT_EQ(one.points().size(), 2u);
}

TEST(Turtle, LevelsItsLeft) {
  // After $ a turn to the left stays horizontal, whatever was rolled before.
  for (const char* before : {"+(40)/(77)", "&(30)\\(10)+(20)", "^(100)/(5)-(60)"})
    EXPECT_NEAR(end_of(std::string(before) + "$+F").y(), 0.f, 1e-6f) << before;
}

RC_GTEST_PROP(Turtle, TurningMovesNothingAndPathsAreAsLongAsTheirSteps, ()) {
  std::string word;
  double length = 0.;
  const int count = *rc::gen::inRange(1, 60);
  for (int i = 0; i < count; ++i) {
    word += *rc::gen::elementOf(std::string("+-&^\\/|$"));
    if (word.back() != '|' && word.back() != '$')
      word += "(" + std::to_string(*rc::gen::inRange(0, 360)) + ")";
    if (i % 2 == 0) word += "F(2)", length += 2.;
  }
  const Morphology m = drawn(word);
  RC_ASSERT(std::abs(total_length(m) - length) < 1e-3);
  RC_ASSERT(m.sections().size() == 1u);
}

TEST(Turtle, BranchPointsEndSections) {
  const Morphology m = drawn("!(2)F(10,1.5)F(5,1)[+(30)!(0.8)F(4,0.5)]-(30)!(0.6)F(3)");
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.points(SectionId(0)).size(), 3u);
  EXPECT_EQ(m.points(SectionId(0))[0].radius, 1.f);
  EXPECT_EQ(m.points(SectionId(0))[1].radius, .75f);
  EXPECT_EQ(m.points(SectionId(1))[0].radius, .4f);  // a daughter begins with its own diameter
  EXPECT_EQ(m.points(SectionId(1))[1].radius, .25f);
  EXPECT_EQ(m.points(SectionId(2))[1].radius, .3f);
  EXPECT_EQ(m.section(SectionId(2)).parent, SectionId(0));
  expect_near(m.points(SectionId(1))[0].position(), {0, 15, 0});
}

TEST(Turtle, BranchesThatDrawNothingEndNoSection) {
  EXPECT_EQ(drawn("F[+]F[!(3)f(2)]F").sections().size(), 1u);
  EXPECT_EQ(drawn("F[F]").sections().size(), 1u);
  EXPECT_EQ(drawn("F[F(0)]F").sections().size(), 1u);
}

TEST(Turtle, DrawsSomaKindsAndRoots) {
  const Morphology m =
      drawn("f(5) Soma(20) [Axon | f(10) F(5)] [Apical f(10) F(5) Kind(12) F(2)] [Glia f(10) F]");
  EXPECT_EQ(m.soma().sphere(), (Point{0, 5, 0, 10}));
  ASSERT_EQ(m.sections().size(), 4u);
  EXPECT_EQ(m.roots().size(), 3u);
  const SectionKind kinds[] = {SectionKind::axon, SectionKind::apical, SectionKind::custom,
                               SectionKind::glia};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(m.sections()[i].kind, kinds[i]);
  EXPECT_EQ(m.sections()[2].tag, 12);
  EXPECT_EQ(m.sections()[2].parent, SectionId(1));
  EXPECT_EQ(m.sections()[0].soma_point, 0);
  EXPECT_EQ(m.sections()[2].soma_point, -1);
  expect_near(m.points(SectionId(0))[0].position(), {0, -5, 0});
}

TEST(Turtle, TropismBendsTowardsItsDirection) {
  std::string many;
  for (int i = 0; i < 200; ++i) many += "F";
  const auto heading = [&](const std::string& word) {
    const Morphology m = drawn(word + many);
    const auto points = m.points();
    return Vec3(points.back().position() - points[points.size() - 2].position());
  };
  expect_near(heading("+(80)T(0.2)"), {0, 1, 0});
  expect_near(heading("T(0.2,1,0,0)"), {1, 0, 0});
  EXPECT_NEAR(heading("+(80)[T(0.2)F]").x(), -std::sin(radians(80)),
              1e-5f);  // forgotten at the end of a branch
  EXPECT_NEAR(heading("&(50)Flat(0.2)").z(), 0.f, 1e-5f);
  expect_near(heading("+(30)Flat(0.2,1,0,0)"), {0, 1, 0});
  const Morphology m = drawn("Soma(2) f(100) -(100) Outward(0.2)" + many);
  const Vec3 end = m.points().back().position(), before = m.points()[m.points().size() - 2].position();
  EXPECT_GT((end - before).dot(end.normalized()), .99f);
}

TEST(Turtle, ADirectionThatIsNotGivenIsTheUsualOne) {
  EXPECT_EQ(drawn("T(0.3, 1, 0, 0) T(0.2) -(40) F F F"), drawn("T(0.2) -(40) F F F"));
  EXPECT_EQ(drawn("Flat(0.3, 1, 0, 0) Flat(0.2) &(40) F F F"), drawn("Flat(0.2) &(40) F F F"));
}

TEST(Turtle, BearsSpinesWhereItIsToldTo) {
  const Morphology m =
      drawn("Soma(10) Basal Spiny(2, 1.5, .6, .1, .2, .7) F(400) [ Spiny(0) +F(100) ] [ -F(300) ]");
  ASSERT_EQ(m.sections().size(), 3u);
  std::array<double, 3> count{};
  double reach = 0.;
  for (const Spine& s : m.spines()) {
    count[s.section.value()] += 1.;
    const auto points = m.points(s.section);
    const Vec3 way = (points.back().position() - points.front().position()).normalized();
    EXPECT_NEAR(way.dot(s.head), 0.f, 1e-4f) << "to the side";
    EXPECT_GE(s.position, 0.f);
    EXPECT_LE(s.position, (points.back().position() - points.front().position()).norm());
    EXPECT_EQ(s.head_diameter, .6f);
    EXPECT_EQ(s.neck_diameter, .1f);
    reach += double(s.head.norm());
  }
  EXPECT_NEAR(count[0], 800., 4. * std::sqrt(800.));  // of a Poisson process
  EXPECT_EQ(count[1], 0.);
  EXPECT_NEAR(count[2], 600., 4. * std::sqrt(600.));
  EXPECT_NEAR(reach / double(m.spines().size()), 1.5, .03);
  EXPECT_EQ(m, drawn("Soma(10) Basal Spiny(2, 1.5, .6, .1, .2, .7) F(400) [ Spiny(0) +F(100) ] [ -F(300) ]"));
  EXPECT_NE(m, drawn("Soma(10) Basal Spiny(2, 1.5, .6, .1, .2, .8) F(400) [ Spiny(0) +F(100) ] [ -F(300) ]"));
  EXPECT_TRUE(validate(m).empty());
}

TEST(Turtle, DrawsSomataThatAreNotRound) {
  EXPECT_EQ(drawn("f(7) Soma(10, 0, 0, 0, 0) F(9)"), drawn("f(7) Soma(10) F(9)"));
  const Morphology m = drawn("f(7) Soma(10, -.2, 0, 0, -.1) F(9)");
  ASSERT_EQ(m.soma().kind, SomaKind::contours);
  const Point ball = m.soma().sphere();
  constexpr float places = 1e-3f;  // µm, to which points of the outline are
  EXPECT_LT((ball.position() - Vec3(0, 7, 0)).norm(), places);
  EXPECT_NEAR(ball.radius, 5.f, places);
  Bounds bounds;
  for (const Point& p : m.soma().points) bounds.add(p.position() - ball.position(), 0.f);
  EXPECT_NEAR(bounds.high.y(), 5. * (1. + .2 + .1), 1e-3);  // -sin 3φ has a tip above
  EXPECT_NEAR(bounds.low.y(), -5. * (1. + .2 - .1), .2);
  EXPECT_NEAR(bounds.high.x(), 5. * (1. - .2), .5);
  EXPECT_EQ(bounds.high.z(), 0.f);
  EXPECT_TRUE(validate(m).empty());
}

TEST(Turtle, RefusesWhatItCannotDraw) {
  EXPECT_THROW(drawn("Soma(1) Soma(2)"), Error);
  EXPECT_THAT(refused([] { drawn("Soma(9, .5, .3, 0, -.2)"); }),
              ::testing::HasSubstr("less than 1, and is 1"));
  EXPECT_THROW(drawn("Soma(-1)"), Error);
  for (const char* too_large : {"F(1e39)", "!(1e39) F(1)", "Soma(1e39)"})
    EXPECT_THAT(refused([&] { drawn(too_large); }), ::testing::StartsWith("turtle: ")) << too_large;
  EXPECT_THAT(refused([] { drawn("Spiny(100) F(1e15)"); }),
              ::testing::HasSubstr("more than 10000000 spines on one neuron"));
  const Grammar g = parse("axiom: A\np: A -> F\n", "x");
  const auto word = [](std::vector<Symbol> symbols) {
    Word w;
    for (const Symbol s : symbols) w.modules.push_back({s, 0, 0});
    return w;
  };
  EXPECT_THROW(interpret(word({Symbol(Action::push)}), g), Error);
  EXPECT_THROW(interpret(word({Symbol(Action::pop)}), g), Error);
}

}  // namespace
}  // namespace forest::lsystem
