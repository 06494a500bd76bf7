// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/gauge.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {
namespace {

using Places = Batch::Places;

// A block of a millimetre far from the origin, all of whose places lie off by up to so many µm.
Places crumpled(int seed, double by) {
  std::mt19937 random{std::uint32_t(seed)};
  const auto off = [&] { return by * (double(random()) / double(std::mt19937::max()) - .5); };
  Places places;
  for (int p = 0; p < 64; ++p)
    places.col(p) = Eigen::Vector3d(61e3 + 333. * (p % 4) + off(), -70e3 + 333. * (p / 4 % 4) + off(),
                                    12e3 + 333. * (p / 16) + off());
  return places;
}

Hexahedron element(const Places& places) {
  std::array<Eigen::Vector3d, 64> at;
  for (int p = 0; p < 64; ++p) at[std::size_t(p)] = places.col(p);
  return through_lattice(at);
}

Batch batch(double by) {
  Batch result;
  for (int lane = 0; lane < lanes; ++lane) result.set(lane, crumpled(lane, by));
  return result;
}

// How much more of it lies above than below, by slices.
double tilt(const Hexahedron& h) {
  constexpr int slices = 32;
  double sum = 0.;
  for (int i = 0; i < slices; ++i)
    sum += (1. - (2. * i + 1.) / slices) * h.volume(double(i) / slices, (i + 1.) / slices);
  return sum;
}

TEST(Gauge, ShapesAreThoseOfTheElements) {
  const Batch eight = batch(150.);
  const Shape few = look(eight, Samples::few), many = look(eight, Samples::many);
  for (int lane = 0; lane < lanes; ++lane) {
    const Hexahedron h = element(crumpled(lane, 150.));
    EXPECT_NEAR(few.least[lane], scaled_jacobian(h, 4), 5e-4);
    EXPECT_NEAR(many.least[lane], scaled_jacobian(h, 8), 5e-4);  // nor are lengths quite those
    EXPECT_NEAR(many.volume[lane] / h.volume(), 1., 1e-3);       // Boole's rule is not exact
    EXPECT_NEAR((many.tilt[lane] - tilt(h)) / h.volume(), 0., 1e-3);
    EXPECT_LE(many.least[lane], few.least[lane]);
  }
}

TEST(Gauge, AnElementIsTheSameInEveryLane) {
  const Batch mixed = batch(300.);
  Batch alike;
  for (int lane = 0; lane < lanes; ++lane) alike.set(lane, crumpled(3, 300.));
  const Counts counts{Lanes{} + 1e-9f, Lanes{} + 2e-9f};
  for (const Samples samples : {Samples::few, Samples::many}) {
    Lack a, b;
    weigh(mixed, samples, {.65f, .02f}, counts, a);
    weigh(alike, samples, {.65f, .02f}, counts, b);
    for (int lane = 0; lane < lanes; ++lane) {
      EXPECT_EQ(a.value[3], b.value[lane]);
      for (int p = 0; p < 64; ++p) EXPECT_EQ(a.gradient[1][p][3], b.gradient[1][p][lane]);
    }
  }
}

// What is lacking, and a volume that counts, as sums over places: once more, in doubles, by the element's own Jacobian.
double lack(const Hexahedron& h, int steps, double wanted, double fold) {
  double sum = 0.;
  for (int n = 0; n < (steps + 1) * (steps + 1) * (steps + 1); ++n) {
    const Eigen::Vector3d at =
        Eigen::Vector3d(n % (steps + 1), n / (steps + 1) % (steps + 1), n / (steps + 1) / (steps + 1)) /
        steps;
    const Eigen::Matrix3d j = h.jacobian(at);
    const double s = j.determinant() / j.colwise().norm().prod();
    const double chi = .5 * (s + std::sqrt(s * s + fold * fold));
    if (s < wanted) sum += (wanted - s) * (wanted - s) / chi;
  }
  return sum;
}

TEST(Gauge, WhatIsLackingAndHowItFalls) {
  for (const double by : {200., 700.})  // valid, and folded
    for (const Samples samples : {Samples::few, Samples::many}) {
      const int steps = samples == Samples::few ? 4 : 8;
      constexpr double wanted = .65, fold = .1, by_volume = 3e-8, by_tilt = -2e-8;
      Lack lacking;
      weigh(batch(by), samples, {float(wanted), float(fold)},
            {Lanes{} + float(by_volume), Lanes{} + float(by_tilt)}, lacking);
      for (int lane = 0; lane < lanes; lane += 3) {
        Places places = crumpled(lane, by);
        const auto value = [&] { return lack(element(places), steps, wanted, fold); };
        const auto all = [&] {
          const Hexahedron h = element(places);
          return value() + by_volume * h.volume() + by_tilt * tilt(h);
        };
        const double now = value();
        ASSERT_GT(now, 0.);
        EXPECT_NEAR(lacking.value[lane] / now, 1., 1e-3);
        double largest = 0.;
        for (int p = 0; p < 64; ++p)
          for (int one = 0; one < 3; ++one)
            largest = std::max(largest, std::abs(double(lacking.gradient[one][p][lane])));
        for (int p = 0; p < 64; p += 7)
          for (int one = 0; one < 3; ++one) {
            constexpr double step = .01;
            const double before = places(one, p);
            places(one, p) = before + step;
            const double up = all();
            places(one, p) = before - step;
            const double down = all();
            places(one, p) = before;
            EXPECT_NEAR(lacking.gradient[one][p][lane], (up - down) / (2. * step), .01 * largest);
          }
      }
    }
}

}  // namespace
}  // namespace forest::cortex
