// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/exclusion.h"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/random.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"

#include "tests/effort.h"

namespace forest::lsystem {
namespace {

using Eigen::Vector3d;

double distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0. ? std::clamp((p - a).dot(b - a) / length2, 0., 1.) : 0.;
  return (p - a - t * (b - a)).norm();
}

Vector3d random_direction(Random& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

TEST(Exclusion, AFreeStepIsLeftAlone) {
  const Vector3d step(1, 2, 3);
  EXPECT_EQ(clear_step({0, 0, 0}, step, {0, 0, 1}, {}), step);
  EXPECT_EQ(clear_step({0, 0, 0}, step, {0, 0, 1}, {.balls = {{{-3, 0, 0}, 2.}}, .ceiling = 5.}), step);
}

TEST(Exclusion, TurnsByTheLeastAngle) {
  // Past a ball of radius 3 that is 5 away one goes at asin(3/5) to its centre, on the side where one was.
  const Vector3d around = clear_step({0, 0, 0}, {20, 1, 0}, {0, 0, 1}, {.balls = {{{5, 0, 0}, 3.}}});
  EXPECT_NEAR(around.norm(), std::hypot(20., 1.), 1e-9);
  EXPECT_NEAR(std::atan2(around.y(), around.x()), std::asin(.6), 1e-5);
  EXPECT_NEAR(around.z(), 0., 1e-9);
  // Head on, to the side that was given.
  const Vector3d head_on = clear_step({0, 0, 0}, {20, 0, 0}, {0, 0, 1}, {.balls = {{{5, 0, 0}, 3.}}});
  EXPECT_NEAR(std::atan2(head_on.z(), head_on.x()), std::asin(.6), 1e-5);
  // A step that ends before it has passed touches with its end.
  const Vector3d end = clear_step({0, 0, 0}, {3, 0, 0}, {0, 1, 0}, {.balls = {{{5, 0, 0}, 3.}}});
  EXPECT_NEAR((end - Vector3d(5, 0, 0)).norm(), 3., 1e-5);
  EXPECT_NEAR(end.norm(), 3., 1e-9);
}

TEST(Exclusion, NothingGrowsAboveTheCeiling) {
  const Vector3d along = clear_step({0, 8, 0}, {0, 5, 0}, {1, 0, 0}, {.balls = {}, .ceiling = 10.});
  EXPECT_NEAR(along.y(), 2., 1e-5);
  EXPECT_NEAR(along.norm(), 5., 1e-9);
  EXPECT_GT(along.x(), 4.);
  // Who stands above it comes no higher.
  EXPECT_LE(clear_step({0, 12, 0}, {0, 5, 0}, {1, 0, 0}, {.balls = {}, .ceiling = 10.}).y(), 1e-5);
}

TEST(Exclusion, WhoIsWithinComesOutAndNotDeeper) {
  const Obstacles ball{.balls = {{{0, 0, 0}, 10.}}};
  EXPECT_EQ(clear_step({0, 4, 0}, {0, 3, 0}, {1, 0, 0}, ball), Vector3d(0, 3, 0));
  const Vector3d in = clear_step({0, 4, 0}, {0, -3, 0}, {1, 0, 0}, ball);
  EXPECT_GE(distance_to_segment({0, 0, 0}, {0, 4, 0}, Vector3d(0, 4, 0) + in), 4. - 1e-5);
}

TEST(Exclusion, WhereNothingIsFreeNothingGrows) {
  Obstacles cage;  // six balls whose surfaces all but touch the place, and each other beyond it
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1., 1.}) cage.balls.push_back({side * 10.001 * Vector3d::Unit(axis), 10.});
  for (int axis = 0; axis < 8; ++axis)
    cage.balls.push_back({Vector3d(axis & 1 ? 1 : -1, axis & 2 ? 1 : -1, axis & 4 ? 1 : -1) * 5.8, 10.});
  EXPECT_EQ(clear_step({0, 0, 0}, {8, 0, 0}, {0, 1, 0}, cage), Vector3d::Zero());
}

RC_GTEST_PROP(Exclusion, NoStepEntersWhateverStandsThere, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  Random random(seed);
  Obstacles obstacles;
  const auto count = random.below(12);
  for (std::uint32_t i = 0; i < count; ++i)
    obstacles.balls.push_back({random.uniform(2., 25.) * random_direction(random), random.uniform(0., 12.)});
  if (random.below(2)) obstacles.ceiling = random.uniform(-1., 10.);
  const Vector3d step = random.uniform(0.1, 40.) * random_direction(random), side = random_direction(random);
  const Vector3d got = clear_step({0, 0, 0}, step, side, obstacles);
  RC_ASSERT(got.norm() < step.norm() * (1. + 1e-9));
  RC_ASSERT(got.y() <= std::max(0., obstacles.ceiling) + 1e-5);
  for (const auto& ball : obstacles.balls)
    RC_ASSERT(distance_to_segment(ball.centre, {0, 0, 0}, got) >=
              std::min(ball.radius, ball.centre.norm()) - 1e-5);
}

// Cells that wander and fork at random, among somata that fill up to a quarter of the space.
constexpr const char* wild = R"(
module Tip(d), Bare
steps: 40
axiom: Soma(14) Basal Avoid(0.2) [ /(uniform(0, 360)) &(uniform(0, 180)) f(7) !(3) Tip(3) ]
  [ /(uniform(0, 360)) &(uniform(0, 180)) f(7) !(2) Tip(2) ] Apical f(7) !(3) T(0.2) Tip(3)
fork: Tip(d) -> /(uniform(0, 360)) [ +(uniform(5, 70)) Tip(0.9 * d) ] -(uniform(5, 70)) Tip(0.9 * d) : 0.05
stop: Tip(d) -> : 0.02
grow: Tip(d) -> /(uniform(0, 360)) &(normal(0, 30)) F(uniform(1, 25), d) Tip(max(0.3, 0.98 * d))
)";

double deepest(const Morphology& m, const cortex::Site& site) {
  double worst = -1e9;
  const auto check = [&](const Vector3d& centre, double radius) {
    for (std::size_t s = 0; s < m.sections().size(); ++s) {
      const auto points = m.points(SectionId(s));
      for (std::size_t i = 1; i < points.size(); ++i)
        worst = std::max(worst, radius - distance_to_segment(centre, points[i - 1].position().cast<double>(),
                                                             points[i].position().cast<double>()));
    }
  };
  for (const Sphere& soma : site.environment->somata())
    if (!cortex::Environment::encloses(soma, site.at.cast<double>()))
      check((soma.centre - site.at).cast<double>(), double(soma.radius));
  check(Vector3d::Zero(), double(m.soma().sphere().radius));
  return worst;
}

std::vector<Sphere> packed(Random& random, double size, int count, const Vec3& keep_free) {
  std::vector<Sphere> somata;
  for (int i = 0; i < count; ++i) {
    const Vec3 at(float(random.uniform(0., size)), float(random.uniform(0., size)),
                  float(random.uniform(0., size)));
    const float radius = float(random.uniform(4., 11.));
    if ((at - keep_free).norm() > radius + 9.f) somata.push_back({at, radius});
  }
  return somata;
}

TEST(Exclusion, NoSegmentOfAThousandCellsPassesThroughAnyOfThousandsOfSomata) {
  LONG_TEST();
  const Grammar g = parse(wild, "wild");
  std::size_t segments = 0, bent = 0, somata = 0;
  for (std::uint64_t tissue = 0; tissue < 20; ++tissue) {
    Random random(77, tissue);
    const Vec3 at(100.f, 120.f, 100.f);
    const cortex::Environment environment({{"L1", 0.f, 200.f}},
                                          packed(random, 200., 40 + 30 * int(tissue), at));
    somata += environment.somata().size();
    const cortex::Site site{&environment, at};
    for (std::uint64_t index = 0; index < 50; ++index) {
      const Word word = derive(g, tissue, index, {}, site);
      const Morphology m = interpret(word, g, {}, site);
      ASSERT_LT(deepest(m, site), 2e-4) << "tissue " << tissue << ", cell " << index;
      ASSERT_LE(m.bounds().high.y(), 80.f + 1e-3f);
      segments += m.segment_count();
      bent += m != interpret(word, g);
    }
  }
  EXPECT_GT(somata, 5000u);
  EXPECT_GT(segments, 50'000u);
  EXPECT_GT(bent, 900u);  // nearly all met something
}

// From every side, at somata that are long, three-cornered, or both.
TEST(Exclusion, NoneEntersTheOutlineOfItsOwnSoma) {
  const std::array<double, 4> outlines[] = {
      {.6, 0, 0, 0}, {0, -.7, 0, 0}, {-.2, 0, 0, .15}, {.3, .2, -.3, .1}};
  for (const auto& [a2, b2, a3, b3] : outlines)
    for (int side = 0; side < 24; ++side) {
      const double from = 2. * std::numbers::pi * side / 24.;
      const Grammar g = parse(fmt::format("steps: 60\naxiom: Soma(20, {}, {}, {}, {}) Avoid(1) [ Basal "
                                          "At({}, {}, 0) !(1) Head({}, {}, 0) A ]\n"
                                          "g: A -> F(1, 1) A\n",
                                          a2, b2, a3, b3, 40. * std::cos(from), 40. * std::sin(from),
                                          -std::cos(from + .07), -std::sin(from + .07)),
                              "outlined");
      const Morphology m = interpret(derive(g, 0, 0), g);
      ASSERT_EQ(m.points().size(), 61u);
      for (const Point& p : m.points()) {
        const double phi = std::atan2(double(p.y), double(p.x));
        const double outline = 10. * (1. + a2 * std::cos(2. * phi) + b2 * std::sin(2. * phi) +
                                      a3 * std::cos(3. * phi) + b3 * std::sin(3. * phi));
        EXPECT_GE(double(p.position().norm()), outline + 1.5 - 1e-3) << g.text;
      }
    }
}

TEST(Exclusion, WithoutBeingAskedTheTurtleGoesThroughEverything) {
  std::string text(wild);
  text.replace(text.find("Avoid(0.2)"), 10, "");
  const Grammar g = parse(text, "wild");
  Random random(78);
  const cortex::Environment environment({{"L1", 0.f, 200.f}}, packed(random, 200., 600, {100, 120, 100}));
  const cortex::Site site{&environment, {100, 120, 100}};
  double worst = 0.;
  for (std::uint64_t index = 0; index < 20; ++index) {
    const Word word = derive(g, 1, index, {}, site);
    worst = std::max(worst, deepest(interpret(word, g, {}, site), site));
    EXPECT_EQ(interpret(word, g, {}, site), interpret(word, g));
  }
  EXPECT_GT(worst, 3.);
}

}  // namespace
}  // namespace forest::lsystem
