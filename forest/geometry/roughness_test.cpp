// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/roughness.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest {
namespace {

Mesh noisy(Mesh mesh, double sd) {
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    Random random(7, v);
    for (int k = 0; k < 3; ++k) mesh.positions[v][k] += float(random.normal(0., sd));
  }
  return mesh;
}

TEST(Roughness, IsTheNoiseThatWasAddedAndLittleOfWhatIsSmooth) {
  Mesh folded = icosphere(Vec3::Zero(), 40e3f, 5, 0);  // by 4 mm, every 25 mm or so
  for (Vec3& p : folded.positions) p *= 1.f + .1f * std::sin(p.x() / 4e3f) * std::cos(p.z() / 4e3f);
  EXPECT_LT(roughness(folded), 40.);
  for (const double sd : {100., 200., 400.}) {
    EXPECT_NEAR(roughness(noisy(folded, sd)), sd, 20.) << sd;
    EXPECT_NEAR(roughness(noisy(icosphere(Vec3::Zero(), 40e3f, 6, 0), sd)), sd, .05 * sd) << sd;
  }
}

TEST(Roughness, DoesNotSeeVerticesOfNoTriangle) {
  Mesh ball = icosphere(Vec3::Zero(), 100.f, 2, 0);
  const double before = roughness(ball);
  ball.positions.push_back(Vec3(1e6f, 0.f, 0.f));
  EXPECT_EQ(roughness(ball), before);
  EXPECT_EQ(roughness({}), 0.);
}

}  // namespace
}  // namespace forest
