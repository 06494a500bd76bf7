// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/symmetry.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

#include "tests/folded_lattice.h"

namespace forest::cortex {
namespace {

constexpr int across = 6, along = 9;
constexpr SymmetryOptions quick{.across = 4, .along = 8, .stretches = 1, .pixel = 120.};
constexpr double spacing = 700., deep = 2500., wide = 3500.;  // µm

// A crown with one flank steeper than the other; its axis is straight, or a circle.
Elements crown(double circle) {
  return folded_lattice(across, along, [&](double s, double t, double w) {
    const double angle = 2.6 * (s / across - .5), r = wide * (1. + .2 * std::sin(angle)) - w * deep;
    const double x = r * std::sin(angle), y = r * std::cos(angle), z = spacing * t;
    return circle == 0. ? Place(x, y, z)
                        : Place((circle + x) * std::cos(z / circle), y, (circle + x) * std::sin(z / circle));
  });
}

std::vector<Line> crest(const Elements& elements) {
  Line line{.kind = Line::Kind::crest, .points = {}, .triangles = {}, .strength = 9., .closed = false};
  for (int j = 0; j < along; ++j) {
    const Hexahedron h = elements.hexahedron(std::size_t(j * across + across / 2));
    line.points.push_back(h.at(.5, .5, .5)), line.triangles.push_back(0);
  }
  line.triangles.pop_back();
  return {line};
}

Symmetry of(const Elements& elements) { return symmetry(elements, crest(elements), quick); }

TEST(Symmetry, SectionsOfAStraightFoldAreAllTheSameByElementsAndByAKnife) {
  const Symmetry s = of(crown(0.));
  EXPECT_GE(s.stretches, 1u);
  EXPECT_LT(s.elements, .02);
  EXPECT_LT(s.best_planar, .02);
}

TEST(Symmetry, RowsFollowAFoldThatTurnsWhereAKnifeDoesNot) {
  const Symmetry s = of(crown(7000.));
  EXPECT_LT(s.elements, .03);
  EXPECT_GT(s.best_planar, 2. * s.elements);
}

TEST(Symmetry, NoiseIsReported) {
  Elements noisy = crown(0.);
  Random random(5);
  for (Depths& curve : noisy.curves)
    for (Place& p : curve) p += 300. * Place(random.normal(), random.normal(), random.normal());
  EXPECT_GT(symmetry(noisy, crest(crown(0.)), quick).elements, .1);
}

TEST(Symmetry, IsTheSameWhicheverWayElementsAreTurnedAndAtAnyNumberOfThreads) {
  const Elements plain = crown(7000.);
  Elements turned = plain;
  for (std::size_t e = 0; e < turned.size(); e += 3)  // by a half
    std::reverse(turned.elements[e].begin(), turned.elements[e].end());
  const ThreadLimit one(1);
  const Symmetry a = of(plain), b = symmetry(turned, crest(plain), quick);
  EXPECT_NEAR(a.elements, b.elements, 1e-3);
  EXPECT_NEAR(a.best_planar, b.best_planar, 1e-3);
  const ThreadLimit two(2);
  EXPECT_EQ(of(plain).elements, a.elements);
  EXPECT_EQ(of(plain).best_planar, a.best_planar);
}

TEST(Symmetry, SaysSoWhereThereIsNoStretch) {
  const Elements elements = crown(0.);
  EXPECT_EQ(symmetry(elements, {}).stretches, 0u);
  EXPECT_EQ(symmetry(elements, crest(elements), {.along = along + 1}).stretches, 0u);
}

}  // namespace
}  // namespace forest::cortex
