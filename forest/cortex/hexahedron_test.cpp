// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/hexahedron.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;
using Verdict = Certificate::Verdict;

Hexahedron of_map(const std::function<Place(double, double, double)>& map) {
  std::array<Place, 64> places;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) places[Hexahedron::index(i, j, k)] = map(i / 3., j / 3., k / 3.);
  return through_lattice(places);
}

Eigen::Matrix3d some_matrix() {
  Eigen::Matrix3d m;
  m << 900, 120, -40, 30, 1100, 210, -150, 60, 800;
  return m;
}
Hexahedron affine() {
  return of_map([](double u, double v, double w) {
    return Place(some_matrix() * Place(u, v, w) + Place(5e4, -3e4, 2e4));
  });
}
Hexahedron wobbly(double noise, std::uint64_t seed) {
  Random random(seed);
  Hexahedron h = affine();
  for (auto& p : h.points)
    p += noise * Place(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  return h;
}
// A ninth of a thick tube: bent as cortex over a crown.
Hexahedron bent() {
  return of_map([](double u, double v, double w) {
    const double angle = .7 * (u - .5), radius = 3000. - 2400. * w;
    return Place(radius * std::sin(angle), 1000. * v, radius * std::cos(angle));
  });
}

struct Named {
  std::string name;
  Hexahedron h;
};
std::vector<Named> zoo() {
  std::vector<Named> all{{"affine", affine()}, {"bent", bent()}};
  for (std::uint64_t seed = 1; seed < 5; ++seed) {
    all.push_back({"wobbly " + std::to_string(seed), wobbly(60., seed)});
    all.push_back({"folded " + std::to_string(seed), wobbly(600., seed)});
  }
  return all;
}

double bernstein_sum(const Coefficients& c, const Place& at) {
  const auto basis = [](double t) {
    std::array<double, 9> b{};
    for (int i = 0; i < 9; ++i)
      b[std::size_t(i)] = std::tgamma(9.) / (std::tgamma(i + 1.) * std::tgamma(9. - i)) * std::pow(t, i) *
                          std::pow(1. - t, 8 - i);
    return b;
  };
  const auto u = basis(at[0]), v = basis(at[1]), w = basis(at[2]);
  double sum = 0.;
  for (std::size_t n = 0; n < 729; ++n) sum += c[n] * u[n % 9] * v[n / 9 % 9] * w[n / 81];
  return sum;
}

void for_many_places(int steps, const std::function<void(const Place&)>& act) {
  for (int k = 0; k <= steps; ++k)
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) act(Place(double(i) / steps, double(j) / steps, double(k) / steps));
}

TEST(Hexahedron, AnAffineMapIsReproducedWithItsJacobianAndVolume) {
  const Hexahedron h = affine();
  for_many_places(4, [&](const Place& t) {
    EXPECT_LT((h.at(t) - (some_matrix() * t + Place(5e4, -3e4, 2e4))).norm(), 1e-9);
    EXPECT_LT((h.jacobian(t) - some_matrix()).norm(), 1e-8);
  });
  EXPECT_NEAR(h.volume(), some_matrix().determinant(), 1e-12 * h.volume() * 10.);
  EXPECT_NEAR(h.volume(.25, .5), .25 * h.volume(), 1e-12 * h.volume() * 10.);
  const Certificate certificate = certify(h);
  EXPECT_EQ(certificate.verdict, Verdict::positive);
  EXPECT_NEAR(certificate.least, some_matrix().determinant(), 1e-5 * h.volume());
}

TEST(Hexahedron, GoesThroughItsLattice) {
  Random random(7);
  std::array<Place, 64> places;
  for (auto& p : places) p = 1000. * Place(random.uniform(), random.uniform(), random.uniform());
  const Hexahedron h = through_lattice(places);
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        EXPECT_LT((h.at(i / 3., j / 3., k / 3.) - places[Hexahedron::index(i, j, k)]).norm(), 1e-9);
}

TEST(Hexahedron, ItsCornersAreThoseItWasMadeOf) {
  std::array<Place, 8> corners;
  Random random(3);
  for (auto& c : corners) c = Place(random.uniform(), random.uniform(), random.uniform());
  const Hexahedron h = from_corners(corners);
  for (int c = 0; c < 8; ++c) {
    EXPECT_EQ(h.corner(c), corners[std::size_t(c)]);
    EXPECT_LT((h.at(c & 1, c >> 1 & 1, c >> 2) - corners[std::size_t(c)]).norm(), 1e-15);
  }
  EXPECT_LT((h.at(.5, 0, 0) - .5 * (corners[0] + corners[1])).norm(), 1e-15);
}

TEST(Hexahedron, ItsJacobianIsTheSlopeOfItsPlaces) {
  for (const auto& [name, h] : zoo())
    for_many_places(3, [&](const Place& at) {
      const Place t = .1 * Place::Ones() + .8 * at;
      const Linear both = linear(h, t);
      EXPECT_LT((both.at - h.at(t)).norm(), 1e-9) << name;
      for (int axis = 0; axis < 3; ++axis) {
        const Place step = 1e-4 * Place::Unit(axis);
        EXPECT_LT((both.jacobian.col(axis) - (h.at(t + step) - h.at(t - step)) / 2e-4).norm(), 1e-2) << name;
      }
    });
}

TEST(Hexahedron, ItsFacesLieWhereAParameterIsZeroOrOne) {
  const Hexahedron h = wobbly(300., 11);
  for (const Face face : all_faces) {
    const Patch patch = h.face(face);
    for (const double s : {0., .3, 1.})
      for (const double t : {0., .8, 1.}) {
        Place at;
        at[axis(face)] = is_far(face) ? 1. : 0.;
        at[axis(face) == 0 ? 1 : 0] = s, at[axis(face) == 2 ? 1 : 2] = t;
        EXPECT_LT((patch.at(s, t) - h.at(at)).norm(), 1e-9);
      }
  }
}

TEST(Hexahedron, NeighboursThatHaveTheSamePlacesOnAFaceShareItBitForBit) {
  Random random(5);
  std::array<Place, 64> left, right;
  for (auto* places : {&left, &right})
    for (auto& p : *places) p = 1e5 * Place(random.uniform(), random.uniform(), random.uniform());
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j) right[Hexahedron::index(0, j, k)] = left[Hexahedron::index(3, j, k)];
  const Patch a = through_lattice(left).face(Face::u1), b = through_lattice(right).face(Face::u0);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(a.points[n], b.points[n]);
  std::array<Place, 16> face;
  for (std::size_t n = 0; n < 16; ++n) face[n] = left[Hexahedron::index(3, int(n % 4), int(n / 4))];
  const Patch alone = through_lattice(face);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(a.points[n], alone.points[n]);
}

// The divergence theorem: the volume is a third of the flux of x through the six faces, each of degree (8, 8).
TEST(Hexahedron, ItsVolumeIsTheFluxThroughItsFaces) {
  for (const auto& [name, h] : zoo()) {
    const Place centre = h.at(.5, .5, .5);
    double flux = 0.;
    constexpr int n = 64;  // Simpson
    for (const Face face : all_faces)
      for (int t = 0; t <= n; ++t)
        for (int s = 0; s <= n; ++s) {
          Place at;
          const int across = axis(face), a = across == 0 ? 1 : 0, b = across == 2 ? 1 : 2;
          at[across] = is_far(face) ? 1. : 0., at[a] = double(s) / n, at[b] = double(t) / n;
          const auto weight = [](int i) { return i == 0 || i == n ? 1. : i % 2 ? 4. : 2.; };
          const Linear x = linear(h, at);
          const double turn = (across == 1 ? -1. : 1.) * (is_far(face) ? 1. : -1.);
          flux += turn * weight(s) * weight(t) / (9. * n * n) *
                  (x.at - centre).dot(x.jacobian.col(a).cross(x.jacobian.col(b)));
        }
    EXPECT_NEAR(h.volume(), flux / 3., 1e-5 * std::abs(h.volume())) << name;
  }
}

TEST(Hexahedron, VolumesOfItsPartsSumToItsOwn) {
  for (const auto& [name, h] : zoo()) {
    EXPECT_NEAR(h.volume(0., .3) + h.volume(.3, 1.), h.volume(), 1e-10 * std::abs(h.volume())) << name;
    for (int axis = 0; axis < 3; ++axis) {
      const auto halves = split(h, axis, .3);
      EXPECT_NEAR(halves[0].volume() + halves[1].volume(), h.volume(), 1e-10 * std::abs(h.volume())) << name;
      Place t(.2, .6, .9), inner = t;
      inner[axis] *= .3;
      EXPECT_LT((halves[0].at(t) - h.at(inner)).norm(), 1e-9) << name;
      inner[axis] = .3 + .7 * t[axis];
      EXPECT_LT((halves[1].at(t) - h.at(inner)).norm(), 1e-9) << name;
    }
    EXPECT_NEAR(h.volume(0., .3), split(h, 2, .3)[0].volume(), 1e-10 * std::abs(h.volume())) << name;
  }
}

TEST(Hexahedron, ItsScaledJacobianIsThatOfItsAnglesAlone) {
  Eigen::Matrix3d sheared = Eigen::Vector3d(300., 700., 2400.).asDiagonal();
  EXPECT_NEAR(
      scaled_jacobian(of_map([&](double u, double v, double w) { return Place(sheared * Place(u, v, w)); })),
      1., 1e-9);
  sheared.col(1) = 700. * Place(.5, std::sqrt(.75), 0.);  // 60°
  EXPECT_NEAR(
      scaled_jacobian(of_map([&](double u, double v, double w) { return Place(sheared * Place(u, v, w)); })),
      std::sqrt(.75), 1e-9);
  EXPECT_LT(scaled_jacobian(wobbly(600., 1)), 0.);
}

TEST(Determinant, IsThePolynomialOfItsCoefficientsWithinTheMargin) {
  for (const auto& [name, h] : zoo()) {
    double margin = 0.;
    const Coefficients c = determinant(h, &margin);
    EXPECT_LT(margin, 1e-5 * std::abs(*std::ranges::max_element(c))) << name;
    for_many_places(7, [&](const Place& t) {
      EXPECT_NEAR(bernstein_sum(c, t), h.jacobian(t).determinant(), margin) << name;
    });
  }
}

// The same coefficients from another way: the products of the control points of the partial derivatives, in exact binomials.
TEST(Determinant, CoefficientsAreTheProductsOfThoseOfTheDerivatives) {
  const auto choose = [](int n, int k) {
    return std::round(std::tgamma(n + 1.) / (std::tgamma(k + 1.) * std::tgamma(n - k + 1.)));
  };
  const Hexahedron h = wobbly(200., 2);
  double margin = 0.;
  const Coefficients c = determinant(h, &margin);
  struct Term {
    int i, j, k;
    Place scaled;  // the control point times its binomials
  };
  std::array<std::vector<Term>, 3> partial;
  for (int axis = 0; axis < 3; ++axis) {
    std::array<int, 3> degree{3, 3, 3};
    degree[std::size_t(axis)] = 2;
    for (int k = 0; k <= degree[2]; ++k)
      for (int j = 0; j <= degree[1]; ++j)
        for (int i = 0; i <= degree[0]; ++i)
          partial[std::size_t(axis)].push_back(
              {i, j, k,
               3. * choose(degree[0], i) * choose(degree[1], j) * choose(degree[2], k) *
                   (h.point(i + (axis == 0), j + (axis == 1), k + (axis == 2)) - h.point(i, j, k))});
  }
  Coefficients expected{};
  for (const Term& a : partial[0])
    for (const Term& b : partial[1])
      for (const Term& d : partial[2]) {
        const int i = a.i + b.i + d.i, j = a.j + b.j + d.j, k = a.k + b.k + d.k;
        expected[std::size_t(i + 9 * j + 81 * k)] +=
            a.scaled.dot(b.scaled.cross(d.scaled)) / (choose(8, i) * choose(8, j) * choose(8, k));
      }
  for (std::size_t n = 0; n < 729; ++n) EXPECT_NEAR(c[n], expected[n], margin);
}

TEST(Certify, AgreesWithDenseSampling) {
  int positive = 0, not_positive = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Hexahedron h = wobbly(40. + 12. * double(seed), seed);
    double least = std::numeric_limits<double>::infinity();
    for_many_places(12, [&](const Place& t) { least = std::min(least, h.jacobian(t).determinant()); });
    const Certificate certificate = certify(h);
    if (certificate.verdict == Verdict::positive) {
      ++positive;
      EXPECT_GT(certificate.least, 0.) << seed;
      EXPECT_GE(least, certificate.least) << seed;
    } else {
      ASSERT_EQ(certificate.verdict, Verdict::not_positive) << seed;
      ++not_positive;
      EXPECT_LE(h.jacobian(certificate.where).determinant(), 1e4) << seed;
      EXPECT_NEAR(h.jacobian(certificate.where).determinant(), certificate.least, 1e4) << seed;
    }
    if (least <= -1e4) {
      EXPECT_EQ(certificate.verdict, Verdict::not_positive) << seed;
    }
  }
  EXPECT_GT(positive, 10);
  EXPECT_GT(not_positive, 10);
}

TEST(Certify, FindsAFoldThatNoCornerAndNoCentreShows) {
  Hexahedron h = affine();
  h.point(1, 1, 1) += some_matrix() * Place(6, 0, 0);  // slopes back most at u = 2/3, v = w = 1/3
  for (int corner = 0; corner < 8; ++corner)
    ASSERT_GT(h.jacobian(corner & 1, corner >> 1 & 1, corner >> 2).determinant(), 0.);
  ASSERT_GT(h.jacobian(.5, .5, .5).determinant(), 0.);
  const Certificate certificate = certify(h);
  ASSERT_EQ(certificate.verdict, Verdict::not_positive);
  EXPECT_LT(h.jacobian(certificate.where).determinant(), 0.);
}

TEST(Certify, HalvingIsNeededAndDecides) {
  // One that is positive, with coefficients that are not.
  int needed = 0;
  for (std::uint64_t seed = 0; seed < 200 && needed < 5; ++seed) {
    const Hexahedron h = wobbly(200., 1000 + seed);
    const Certificate without = certify(h, 0), with = certify(h);
    if (without.verdict == Verdict::undecided && with.verdict == Verdict::positive) {
      ++needed;
      EXPECT_LE(without.least, 0.);
      for_many_places(20, [&](const Place& t) { EXPECT_GT(h.jacobian(t).determinant(), 0.); });
    }
  }
  EXPECT_EQ(needed, 5);
}

TEST(Certify, AHalfOfAValidElementIsValidWithABoundNoLower) {
  for (const auto& [name, h] : zoo()) {
    const Certificate whole = certify(h);
    if (!whole.positive()) continue;
    for (int axis = 0; axis < 3; ++axis)
      for (const Hexahedron& half : split(h, axis)) {
        const Certificate part = certify(half);
        EXPECT_TRUE(part.positive()) << name;
        EXPECT_GE(part.least, .5 * whole.least - 100.) << name;
      }
  }
}

TEST(Certify, TurnedFlatAndBrokenElementsAreNotPositive) {
  Hexahedron mirrored = affine(), flat = affine(), pinched = affine(), broken = affine();
  for (auto& p : mirrored.points) p.x() = -p.x();
  for (auto& p : flat.points) p.z() = 17.3;
  for (int k = 0; k < 4; ++k) pinched.point(1, 0, k) = pinched.point(0, 0, k);  // no slope at a corner
  broken.point(2, 1, 3).y() = std::numeric_limits<double>::quiet_NaN();
  for (const Hexahedron& h : {mirrored, flat, pinched, broken})
    EXPECT_EQ(certify(h).verdict, Verdict::not_positive);
}

TEST(Certify, UndecidedIsSaidWhereDetJTouchesZeroWithin) {
  // ∂x/∂u = (u − .3)² + tiny: no halving at powers of two meets the place, few halvings are too few.
  const Hexahedron h = of_map([](double u, double v, double w) {
    const double s = u - .3;
    return Place(1000. * (s * s * s + 1e-9 * u), 1000. * v, 1000. * w);
  });
  const Certificate certificate = certify(h, 6);
  EXPECT_EQ(certificate.verdict, Verdict::undecided);
  EXPECT_NEAR(certificate.where.x(), .3, .1);
}

}  // namespace
}  // namespace forest::cortex
