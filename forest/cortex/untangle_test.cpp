// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/untangle.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/cortex/curved_elements.h"
#include "forest/cortex/grid_domains.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

void expect_the_same_faces(const Hexahedron& a, const Hexahedron& b) {
  for (const Face face : all_faces) EXPECT_EQ(a.face(face).points, b.face(face).points);
}

TEST(BlendedInside, IsTheBooleanSumOfTheFaces) {
  for (const Hexahedron& h : folded_sheet(3, 2)) {
    const Hexahedron b = blended_inside(h);
    expect_the_same_faces(h, b);
    Random random(1);
    for (int n = 0; n < 20; ++n) {
      const double t[3] = {random.uniform(), random.uniform(), random.uniform()};
      Place sum = Place::Zero();  // over faces, edges and corners, by inclusion and exclusion
      for (int code = 0; code < 26; ++code) {
        int digits = code < 13 ? code : code + 1, fixed = 0;
        Place at;
        double weight = 1.;
        for (int a = 0; a < 3; ++a, digits /= 3) {
          if (digits % 3 == 1) {
            at[a] = t[a];
            continue;
          }
          at[a] = digits % 3 / 2.;
          weight *= at[a] > 0. ? t[a] : 1. - t[a];
          ++fixed;
        }
        sum += (fixed % 2 ? 1. : -1.) * weight * h.at(at);
      }
      EXPECT_LT((b.at(t[0], t[1], t[2]) - sum).norm(), 1e-8);
    }
  }
}

TEST(Untangle, LeavesWhatIsValidAsItIs) {
  for (const Hexahedron& h : folded_sheet(6, 2)) {
    const Untangled result = untangle(h);
    EXPECT_TRUE(result.certificate.positive());
    EXPECT_EQ(result.hexahedron.points, h.points);
  }
}

TEST(Untangle, MendsAnInsideThatWasShuffled) {
  Random random(2);
  for (Hexahedron h : folded_sheet(12, 2)) {
    for (int k = 1; k < 3; ++k)
      for (int j = 1; j < 3; ++j)
        for (int i = 1; i < 3; ++i)
          h.point(i, j, k) +=
              3000. * Place(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    ASSERT_FALSE(certify(h).positive());
    const Untangled result = untangle(h);
    EXPECT_TRUE(result.certificate.positive());
    EXPECT_TRUE(certify(result.hexahedron).positive());
    expect_the_same_faces(h, result.hexahedron);
  }
}

// Knupp & Steinberg's swan as a block: a face that bulges beside one that sinks in.
TEST(Untangle, FindsAnInsideWhereBlendingTheFacesFolds) {
  const Grid swan = boundary(domain("swan-block"), {3, 3, 3});
  std::array<Place, 64> lattice;
  std::ranges::copy(swan.points, lattice.begin());
  const Hexahedron h = blended_inside(through_lattice(lattice));
  ASSERT_EQ(certify(h).verdict, Certificate::Verdict::not_positive);
  const Untangled result = untangle(h);
  EXPECT_TRUE(result.certificate.positive());
  EXPECT_TRUE(certify(result.hexahedron).positive());
  expect_the_same_faces(h, result.hexahedron);
}

TEST(Untangle, SaysSoWhereTheFacesThemselvesFold) {
  Hexahedron crossed = folded_sheet(1, 1)[0];
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 4; ++i) std::swap(crossed.point(i, 0, k), crossed.point(i, 3, k));
  EXPECT_FALSE(untangle(crossed).certificate.positive());
  Hexahedron broken = folded_sheet(1, 1)[0];
  broken.point(1, 1, 1).x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(untangle(broken).certificate.positive());
}

}  // namespace
}  // namespace forest::cortex
