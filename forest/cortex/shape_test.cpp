// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/shape.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/depth.h"
#include "forest/cortex/slab_test.h"

namespace forest::cortex {
namespace {

double least(const Elements& elements) {
  double result = 1.;
  for (std::size_t e = 0; e < elements.size(); ++e)
    result = std::min(result, scaled_jacobian(elements.hexahedron(e)));
  return result;
}

struct Shapes : ::testing::Test {
  Elements slab = make_slab(6, [](const Place& p) { return p; });
  TriangleTree outer{plane(0.)}, inner{plane(-2000.)};
  // The corner in the middle somewhere else, sides to it as straight as before.
  void push_middle(const Place& way) {
    const Place middle = slab.curves[slab_corner(6, 3, 3)][0];
    for (Depths& curve : slab.curves) {
      const Place off = (curve[0] - middle).cwiseAbs() / 500.;
      const double share = std::max(0., 1. - off.x()) * std::max(0., 1. - off.y());
      for (Place& p : curve) p += share * way;
    }
  }
};

TEST_F(Shapes, ABadCornerIsMendedAndItsFacesStayOnTheSurfaces) {
  push_middle(Place(400., 330., 0.));
  ASSERT_LT(least(slab), .1);
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_GT(least(slab), .5);
  EXPECT_TRUE(uncertified(slab).empty());
  for (const Depths& curve : slab.curves) {
    EXPECT_NEAR(curve[0].z(), 0., 10.);
    EXPECT_NEAR(curve[3].z(), -2000., 10.);
  }
}

TEST_F(Shapes, WhatIsFoldedUnfolds) {
  push_middle(Place(560., 30., 0.));
  ASSERT_FALSE(uncertified(slab).empty());
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_TRUE(uncertified(slab).empty());
}

TEST_F(Shapes, WhatFoldsBetweenFivePlacesUnfoldsWhereNineAreLookedAt) {
  // The inside of an element is crumpled until it folds where 5×5×5 places do not see it.
  constexpr std::uint32_t element = 2 + 6 * 3;
  const std::vector<Depths> before = slab.curves;
  bool unseen = false;
  for (std::uint64_t seed = 1; seed < 500 && !unseen; ++seed) {
    Random random(seed);
    slab.curves = before;
    for (const std::size_t c : {5u, 6u, 9u, 10u})
      for (Place& p : slab.curves[slab.elements[element][c]])
        p += 40. * Place(random.normal(), random.normal(), random.normal());
    const Hexahedron h = slab.hexahedron(element);
    unseen = scaled_jacobian(h, 4) > 0. && !certify(h).positive();
  }
  ASSERT_TRUE(unseen);
  improve_shapes(slab, {outer, inner}, {.volume = 5e8, .finely = true}, Progress::none());
  EXPECT_TRUE(uncertified(slab).empty());
  double finest = 1.;
  for (std::size_t e = 0; e < slab.size(); ++e)
    finest = std::min(finest, scaled_jacobian(slab.hexahedron(e), 16));
  EXPECT_GT(finest, .4);
}

TEST_F(Shapes, WhatIsWellShapedStaysBitForBit) {
  const auto before = slab.curves;
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_EQ(slab.curves, before);
  // And far from a bad corner, too.
  push_middle(Place(400., 330., 0.));
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_EQ(slab.curves[slab_corner(6, 0, 0)], before[slab_corner(6, 0, 0)]);
  EXPECT_NE(slab.curves[slab_corner(6, 3, 3)], before[slab_corner(6, 3, 3)]);
}

TEST_F(Shapes, TheSameAtAnyNumberOfThreads) {
  push_middle(Place(400., 330., 0.));
  Elements again = slab;
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  const ThreadLimit one(1);
  improve_shapes(again, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_EQ(slab.curves, again.curves);
}

TEST_F(Shapes, AnElementTooLargeGivesToItsNeighbours) {
  push_middle(Place(-160., -160., 0.));
  const double before = slab.hexahedron(2 + 6 * 3).volume();
  ASSERT_GT(before, 1.3 * 5e8);
  improve_shapes(slab, {outer, inner}, {.volume = 5e8}, Progress::none());
  EXPECT_LT(slab.hexahedron(2 + 6 * 3).volume(), 1.25 * 5e8);
}

// Only the outer face is bad: what is mended there alone leaves elements that taper otherwise than those beside them.
TEST_F(Shapes, LayersBulgeLessWhereElementsTaperAlike) {
  push_middle(Place(400., 330., 0.));
  const Elements straight = make_slab(6, [](const Place& p) { return p; });
  for (std::size_t c = 0; c < slab.curves.size(); ++c)
    for (const std::size_t d : {1u, 2u, 3u})
      slab.curves[c][d] += (double(d) / 3.) * (straight.curves[c][d] - slab.curves[c][d]);
  const auto bulge = [&](double level) {
    Elements shaped = slab;
    improve_shapes(shaped, {outer, inner}, {.volume = 5e8, .level = level}, Progress::none());
    shaped.depth = even_depth(shaped, Progress::none());
    double most = 0.;
    for (std::size_t e = 0; e < shaped.size(); ++e) most = std::max(most, layer_bulge(shaped, e));
    return most;
  };
  const double without = bulge(0.), with = bulge(30.);
  EXPECT_GT(without, 50.);
  EXPECT_LT(with, .5 * without);
}

// Bent around an axis far below or near: the more so, the faster the tissue narrows.
Elements bent(double radius) {
  return make_slab(4, [radius](const Place& p) {
    const double angle = (p.x() - 1000.) / (radius + 2000.);
    return Place((radius + 2000. + p.z()) * std::sin(angle), p.y(),
                 (radius + 2000. + p.z()) * std::cos(angle));
  });
}

TEST(EvenDepth, SharesTheVolumeWhereWDoesNot) {
  for (const double radius : {100., 500., 4000.}) {
    Elements elements = bent(radius);
    const double without = depth_error(elements, 5);
    elements.depth = even_depth(elements, Progress::none());
    for (std::size_t e = 0; e < elements.size(); ++e) EXPECT_LT(depth_error(elements, e), .003) << radius;
    EXPECT_GT(without, radius < 1000. ? .1 : .02);
  }
}

TEST(EvenDepth, IsThatOfACylinder) {
  Elements elements = bent(500.);
  elements.depth = even_depth(elements, Progress::none());
  const Layers layers(elements, 5);
  for (const double depth : {.1, .25, .5, .8}) {
    const Place p = elements.hexahedron(5).at(.4, .6, layers.w(.4, .6, depth));
    const double known = std::sqrt(2500. * 2500. * (1. - depth) + 500. * 500. * depth);
    EXPECT_NEAR(std::hypot(p.x(), p.z()), known, 12.);
  }
}

// Its corners have the mean table of elements that widen, by which w would have to leave it in its middle.
TEST(EvenDepth, SharesTheVolumeOfAnElementThatNarrowsWhereThoseAroundWiden) {
  for (const double narrowed : {.6, .8, .95}) {
    Elements elements = bent(3e4);
    const Place middle = elements.hexahedron(5).at(.5, .5, .5);
    for (Depths& curve : elements.curves)
      for (std::size_t d = 0; d < 4; ++d) {
        Eigen::Vector2d way(curve[d].x() - middle.x(), curve[d].y() - middle.y());
        way *= 1. - narrowed * double(d) / 3. * std::exp(-way.squaredNorm() / (2. * 400. * 400.));
        curve[d].x() = middle.x() + way.x(), curve[d].y() = middle.y() + way.y();
      }
    ASSERT_TRUE(certify(elements.hexahedron(5)).positive());
    elements.depth = even_depth(elements, Progress::none());
    for (std::size_t e = 0; e < elements.size(); ++e) EXPECT_LT(depth_error(elements, e), .001) << e;
    for (const float own : elements.depth.elements[5]) EXPECT_LT(std::abs(own), .2f);
  }
}

TEST(EvenDepth, GoesOnFromElementToElementAndBack) {
  Elements elements = bent(300.);
  for (Depths& curve : elements.curves)  // not the same everywhere
    for (Place& p : curve) p.x() += .1 * std::abs(p.y() - 700.);
  elements.depth = even_depth(elements, Progress::none());
  const Layers one(elements, 5), next(elements, 6);  // next along u
  for (const double depth : {.07, .3, .5, .93})
    for (const double v : {0., .3, 1.}) {
      EXPECT_NEAR(one.w(1., v, depth), next.w(0., v, depth), 1e-6);
      EXPECT_NEAR(one.depth(.4, v, one.w(.4, v, depth)), depth, 1e-9);
    }
  EXPECT_EQ(one.w(.5, .5, 0.), 0.);
  EXPECT_EQ(one.w(.5, .5, 1.), 1.);
}

}  // namespace
}  // namespace forest::cortex
