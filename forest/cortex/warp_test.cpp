// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/warp.h"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/cortex/curved_elements.h"
#include "forest/cortex/locate.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

using testing::HasSubstr;
using Place = Eigen::Vector3d;

// A box between two places; w runs against y, as in tissue whose pia is above, and u along x.
Hexahedron box(const Place& low, const Place& high) {
  std::array<Place, 8> corners;
  for (int c = 0; c < 8; ++c)
    corners[std::size_t(c)] = {c & 1 ? high.x() : low.x(), c & 4 ? low.y() : high.y(),
                               c & 2 ? high.z() : low.z()};
  return from_corners(corners);
}

// The same element with other names for its sides: u, v → v, −u.
Hexahedron turned(const Hexahedron& h) {
  Hexahedron result;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) result.point(i, j, k) = h.point(3 - j, i, k);
  return result;
}

struct Tree {
  std::vector<Place> points;
  std::vector<std::int32_t> parents;
};
// A bush of branches in all directions, each of many short steps.
Tree bush(double reach, double step, std::uint64_t seed = 1) {
  Random random(seed);
  Tree tree;
  for (int branch = 0; branch < 24; ++branch) {
    Place heading = Place(random.normal(), random.normal(), random.normal()).normalized(), at = Place::Zero();
    for (double way = 0.; way < reach; way += step) {
      heading = (heading + .1 * Place(random.normal(), random.normal(), random.normal())).normalized();
      at += step * heading;
      tree.parents.push_back(way == 0. ? -1 : std::int32_t(tree.points.size()) - 1);
      tree.points.push_back(at);
    }
  }
  return tree;
}

TEST(Junctions, JoinFacesThatShareTheirCornersBothWays) {
  const auto elements = folded_sheet(4, 3);
  const auto joined = junctions(elements);
  ASSERT_EQ(joined.size(), 12u);
  for (std::uint32_t n = 0; n < 12; ++n) {
    const std::uint32_t across = n / 3, along = n % 3;
    const auto expected = [](bool there, std::uint32_t element, Face face) {
      return there ? Junction{element, face, false} : Junction{};
    };
    EXPECT_EQ(joined[n][0], expected(across > 0, n - 3, Face::u1)) << n;
    EXPECT_EQ(joined[n][1], expected(across < 3, n + 3, Face::u0)) << n;
    EXPECT_EQ(joined[n][2], expected(along > 0, n - 1, Face::v1)) << n;
    EXPECT_EQ(joined[n][3], expected(along < 2, n + 1, Face::v0)) << n;
  }
}

TEST(Junctions, KnowNeighboursThatAreTurned) {
  const Hexahedron a = box({0, 0, 0}, {600, 2400, 600}), b = turned(box({600, 0, 0}, {1500, 2400, 600}));
  const auto joined = junctions(std::vector{a, b});
  EXPECT_EQ(joined[0][1], (Junction{1, Face::v1, false}));
  EXPECT_EQ(joined[1][3], (Junction{0, Face::u1, false}));
  const auto twice = junctions(std::vector{a, turned(turned(box({600, 0, 0}, {1500, 2400, 600})))});
  EXPECT_EQ(twice[0][1], (Junction{1, Face::u1, true}));
  EXPECT_THAT(refused([&] { junctions(std::vector{a, b, b}); }), HasSubstr("more than two"));
}

TEST(Axes, PointTowardsThePiaAndAreRightHanded) {
  const auto elements = folded_sheet(12, 2);
  Random random(3);
  for (std::uint32_t n = 0; n < elements.size(); ++n) {
    const Seat seat{n, Place(random.uniform(), random.uniform(), random.uniform()), random.uniform(0., 6.)};
    const Eigen::Matrix3d r = axes({elements}, seat);
    EXPECT_LT((r.transpose() * r - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(r.determinant(), 1., 1e-12);
    const Place inwards = elements[n].jacobian(seat.uvw).col(2).normalized();
    EXPECT_LT(std::acos(std::min(1., -inwards.dot(r.col(1)))) * 180. / 3.14159, 1e-5);
  }
}

// Boxes of different widths, two of them turned: what is straight stays straight, in whichever element it ends.
TEST(Warp, ChangesNothingWhereTheTissueIsStraight) {
  std::vector<Hexahedron> elements;
  const std::array<double, 5> x{0., 500., 1400., 1700., 2500.}, z{0., 700., 900., 1500., 2600.};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const Hexahedron h = box({x[i], 0., z[j]}, {x[i + 1], 2000., z[j + 1]});
      elements.push_back((i + j) % 3 == 1 ? turned(h) : (i + j) % 3 == 2 ? turned(turned(turned(h))) : h);
    }
  const auto joined = junctions(elements);
  const Sheet sheet{elements, joined};
  const Tree tree = bush(1500., 30.);
  const Seat seat{5, {.4, .6, .5}, .8};
  const Warped bent = warp(sheet, seat, tree.points, tree.parents),
               rigid = warp(sheet, seat, tree.points, tree.parents, {.rigid = true});
  const Eigen::Matrix3d r = axes(sheet, seat);
  const Place soma = elements[5].at(seat.uvw);
  for (std::size_t n = 0; n < tree.points.size(); ++n) {
    EXPECT_LT((rigid.points[n] - (soma + r * tree.points[n])).norm(), 1e-9);
    EXPECT_LT((bent.points[n] - rigid.points[n]).norm(), 1e-6) << n;
  }
  EXPECT_NEAR(bent.distortion.length_change(), 0., 1e-9);
  EXPECT_LT(bent.distortion.largest_turn, 1e-4);
  EXPECT_GT(bent.distortion.beside, 0.);
}

TEST(Warp, FollowsTheWCurveAlongTheAxis) {
  const auto elements = folded_sheet(24, 1);
  for (std::uint32_t n = 0; n < elements.size(); ++n) {
    const Seat seat{n, {.3, .6, .7}};
    const double thickness = elements[n].jacobian(seat.uvw).col(2).norm();  // µm a unit of w
    Tree line;
    for (int i = 1; i <= 10; ++i) {
      line.points.push_back({0., .07 * i * thickness, 0.});
      line.parents.push_back(i - 2);
    }
    const Warped bent = warp({elements}, seat, line.points, line.parents);
    for (int i = 1; i <= 10; ++i)
      EXPECT_LT((bent.points[std::size_t(i - 1)] - elements[n].at(.3, .6, .7 - .07 * i)).norm(), 1e-6) << n;
  }
}

TEST(Warp, NearTheSomaIsRigid) {
  const auto elements = folded_sheet(24, 1);
  const Seat seat{7, {.5, .5, .4}, .3};
  double before = 0.;
  for (const double reach : {40., 20., 10.}) {
    const Tree tree = bush(reach, 5.);
    const Warped bent = warp({elements}, seat, tree.points, tree.parents),
                 rigid = warp({elements}, seat, tree.points, tree.parents, {.rigid = true});
    double most = 0.;
    for (std::size_t n = 0; n < tree.points.size(); ++n)
      most = std::max(most, (bent.points[n] - rigid.points[n]).norm());
    EXPECT_LT(most, reach * reach / 400.);  // half the curvature, of a radius of some hundred µm at least
    EXPECT_GT(most, 0.);
    if (before > 0.) {
      EXPECT_LT(most, .35 * before);  // of second order
    }
    before = most;
  }
}

TEST(Warp, NeverTearsAcrossFacesAndReportsWhatItDid) {
  const auto elements = folded_sheet(24, 8);
  const auto joined = junctions(elements);
  const Sheet sheet{elements, joined};
  const Tree tree = bush(1200., 2.);
  for (const std::uint32_t element : {59u, 83u, 100u, 131u}) {
    const Warped bent = warp(sheet, {element, {.9, .1, .4}}, tree.points, tree.parents);
    const Distortion& d = bent.distortion;
    EXPECT_GT(d.shortest, .7) << element;  // a tear would be many times a step of 2 µm
    EXPECT_LT(d.longest, 1.5) << element;
    EXPECT_LT(std::abs(d.length_change()), .05) << element;
    EXPECT_GT(d.largest_turn, 0.);
    EXPECT_LT(d.mean_turn, 2.) << element;
    EXPECT_NEAR(d.straight_length, 24. * 1198., 1e-6);
  }
}

Tree line(const Place& step, int count) {
  Tree tree;
  for (int i = 1; i <= count; ++i) tree.points.push_back(i * step), tree.parents.push_back(i - 2);
  return tree;
}

// However far it runs: along a layer of the folds, where the elements are wide at one end and narrow at the other.
TEST(Warp, KeepsLengthsToTheSides) {
  const auto elements = folded_sheet(24, 8);
  const auto joined = junctions(elements);
  for (const double depth : {.1, .5, .9}) {
    const Tree tree = line({10., 0., 3.}, 500);
    const Warped bent = warp({elements, joined}, {4, {.5, .5, depth}}, tree.points, tree.parents);
    EXPECT_EQ(bent.distortion.beside + bent.distortion.beyond_pia + bent.distortion.beyond_white, 0.);
    EXPECT_NEAR(bent.distortion.length_change(), 0., .02) << depth;
    EXPECT_GT(bent.distortion.shortest, .9) << depth;
    EXPECT_LT(bent.distortion.longest, 1.1) << depth;
  }
}

// An axon in white matter: straight and as long as it was, from whichever place of the folds it leaves.
TEST(Warp, IsStraightOutsideOfTissue) {
  const auto elements = folded_sheet(24, 8);
  const auto joined = junctions(elements);
  const Tree tree = line({2., -10., 1.}, 1000);
  for (std::uint32_t element = 3; element < 24 * 8; element += 8) {
    const Warped bent = warp({elements, joined}, {element, {.5, .5, .8}}, tree.points, tree.parents);
    EXPECT_GT(bent.distortion.beyond_white, 8000.) << element;
    EXPECT_NEAR(bent.distortion.length_change(), 0., .01) << element;
    for (std::size_t n = 800; n + 2 < tree.points.size(); ++n)
      EXPECT_LT((bent.points[n] - 2. * bent.points[n + 1] + bent.points[n + 2]).norm(), 1e-9);
  }
}

TEST(Warp, ComesBackIntoTissue) {
  const std::vector elements{box({0, 0, 0}, {900, 2000, 900}), box({-500, -5000, -500}, {1500, -3000, 1500})};
  const Locator locator(elements);
  const Tree tree = line({0., -10., 0.}, 700);
  const Warped once = warp({elements}, {0, {.5, .5, .5}}, tree.points, tree.parents),
               twice = warp({elements, {}, &locator}, {0, {.5, .5, .5}}, tree.points, tree.parents);
  EXPECT_NEAR(once.distortion.beyond_white, 6000., 15.);
  EXPECT_NEAR(twice.distortion.beyond_white, 4000., 25.);
  for (std::size_t n = 0; n < tree.points.size(); ++n)
    EXPECT_LT((twice.points[n] - Place(450., 990. - 10. * double(n), 450.)).norm(), 1e-4);
}

TEST(Warp, HoldsBelowThePiaWhatIsToStayThere) {
  const auto elements = folded_sheet(12, 3);
  const auto joined = junctions(elements);
  const Sheet sheet{elements, joined};
  const Tree tree = bush(900., 10.);
  const Seat seat{16, {.5, .5, .15}};
  const Warped free = warp(sheet, seat, tree.points, tree.parents);
  const Warped held = warp(sheet, seat, tree.points, tree.parents, {.below_pia = true});
  EXPECT_GT(free.distortion.beyond_pia, 100.);
  EXPECT_EQ(held.distortion.beyond_pia, 0.);
  int moved = 0;
  for (std::size_t n = 0; n < tree.points.size(); ++n) moved += free.points[n] != held.points[n];
  EXPECT_GT(moved, 10);
  EXPECT_LT(moved, int(tree.points.size()) / 2);
}

TEST(Warp, RefusesWhatIsNoNeuronOrNoSeat) {
  const auto elements = folded_sheet(2, 2);
  const std::vector<Place> points{{0, 5, 0}, {0, 10, 0}};
  const std::vector<std::int32_t> parents{-1, 0}, later{-1, 1}, few{-1};
  const Sheet sheet{elements};
  EXPECT_THAT(refused([&] { warp(sheet, {4}, points, parents); }), HasSubstr("element 4"));
  EXPECT_THAT(refused([&] { warp(sheet, {0, {.5, 1.5, 0.}}, points, parents); }), HasSubstr("from 0 to 1"));
  EXPECT_THAT(refused([&] { warp(sheet, {0}, points, later); }), HasSubstr("point 1"));
  EXPECT_THAT(refused([&] { warp(sheet, {0}, points, few); }), HasSubstr("1 parents"));
  const std::vector<Place> broken{{0, 5, 0}, {0, std::numeric_limits<double>::infinity(), 0}};
  EXPECT_THAT(refused([&] { warp(sheet, {0}, broken, parents); }), HasSubstr("point 1"));
}

}  // namespace
}  // namespace forest::cortex
