// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/round_cone.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest {
namespace {

Vec3 in_cube(Random& random, double half) {
  return {float(random.uniform(-half, half)), float(random.uniform(-half, half)),
          float(random.uniform(-half, half))};
}

TEST(RoundCone, TheEntryPointIsOnTheSurfaceAndNothingLiesBefore) {
  Random random(3);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const RoundCone cone{in_cube(random, 2), in_cube(random, 2), float(random.uniform(.05, 1)),
                         float(random.uniform(.05, 1))};
    const Ray ray{in_cube(random, 1) + Vec3(0, 0, 10), (in_cube(random, 3) - Vec3(0, 0, 10)).normalized()};
    const auto t = intersect(ray, cone);
    float nearest = 1e9f;  // along the ray by sphere tracing, an independent way
    for (float at = 0.f; at < 30.f;) {
      const float d = signed_distance(ray.origin + at * ray.direction, cone);
      nearest = std::min(nearest, d);
      if (d < 1e-4f) break;
      at += d;
    }
    if (t) {
      ++hits;
      EXPECT_NEAR(signed_distance(ray.origin + *t * ray.direction, cone), 0.f, 2e-3f);
      EXPECT_LT(nearest, 2e-3f);
    } else {
      EXPECT_GT(nearest, 0.f);
    }
  }
  EXPECT_GT(hits, 1500);
}

TEST(RoundCone, BehindOrBesideIsNoHit) {
  const RoundCone cone{{0, 0, 0}, {0, 4, 0}, 1.f, .5f};
  EXPECT_FALSE(intersect({{0, 2, 5}, {0, 0, 1}}, cone));
  EXPECT_FALSE(intersect({{3, 2, 5}, {0, 0, -1}}, cone));
  EXPECT_NEAR(*intersect({{0, 0, 5}, {0, 0, -1}}, cone), 4.f, 1e-2f);
}

TEST(RoundCone, WhatBeginsWithinEntersNothing) {
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const RoundCone cone{in_cube(random, 2), in_cube(random, 2), float(random.uniform(.2, 1)),
                         float(random.uniform(.2, 1))};
    const float t = float(random.uniform());
    const Vec3 within = cone.a + t * (cone.b - cone.a);
    EXPECT_FALSE(intersect({within, in_cube(random, 1).normalized()}, cone));
  }
}

}  // namespace
}  // namespace forest
