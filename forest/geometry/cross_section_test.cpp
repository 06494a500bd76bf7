// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/cross_section.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest {
namespace {

constexpr double pi64 = std::numbers::pi;
using Vector = Eigen::Vector3d;

double area_of(const std::vector<Place>& polygon) { return area_of_union({&polygon, 1}); }

// Area and polygon are within .1 % of what is known.
void expect_area(const RoundConed& cone, const Plane& plane, double known) {
  const auto section = CrossSection::of(cone, plane);
  ASSERT_TRUE(section);
  EXPECT_NEAR(section->area() / known, 1., 1e-6);
  EXPECT_NEAR(area_of(section->outline()) / known, 1., 1e-3);
}

// Through a point of the y axis, turned about z by so many degrees: 0 lies across the axis.
Plane across_y(float y, float turn) {
  return Plane::through({0, y, 0}, {std::sin(radians(turn)), std::cos(radians(turn)), 0});
}

TEST(Plane, HasAxesOfItsOwnWhateverItsNormal) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3 normal = i < 3 ? Vec3(Vec3::Unit(i)) : Vec3(Vec3::Random());
    const Plane p = Plane::through({1, 2, 3}, 7.f * normal);
    EXPECT_NEAR(p.right.cross(p.up).dot(p.normal), 1.f, 1e-5f);
    EXPECT_GE(p.up.y(), -1e-6f);
    const Vec3 point(float(random.uniform(-9, 9)), 4, -5);
    EXPECT_TRUE(p.point(p.place(point)).isApprox(point - p.height(point) * p.normal, 1e-4f));
  }
}

TEST(CrossSection, OfACylinderIsACircleOrAnEllipse) {
  const RoundConed cylinder{{0, -500, 0}, {0, 500, 0}, .3, .3};
  for (const float turn : {0.f, 20.f, 45.f, 70.f})
    expect_area(cylinder, across_y(3, turn), pi64 * .09 / std::cos(double(radians(turn))));
  // Lengthwise: a rectangle with two round ends.
  const double d = .1, half = std::sqrt(.09 - d * d);
  expect_area(cylinder, Plane::through({0, 0, float(d)}, {0, 0, 1}), 2. * half * 1000. + pi64 * half * half);
}

TEST(CrossSection, OfASphereIsADisc) {
  const RoundConed sphere{{900, 2, 3}, {900, 2, 3}, 7., 7.};
  for (const float height : {0.f, 3.f, 6.9f}) {
    const Plane plane = Plane::through(Vec3(900, 2, 3), {1, 2, -1}).moved(-height);
    const double h = plane.normal.cast<double>().normalized().dot(sphere.a - plane.origin.cast<double>());
    EXPECT_NEAR(h, double(height), 1e-3);
    expect_area(sphere, plane, pi64 * (49. - h * h));
  }
  EXPECT_FALSE(CrossSection::of(sphere, Plane::through({900, 2, 3}, {1, 0, 0}).moved(7.01f)));
  // One sphere within the other: only the larger one shows.
  expect_area({{0, 0, 0}, {0, 1, 0}, 5., 1.}, across_y(0, 30), pi64 * 25.);
}

TEST(CrossSection, OfAConeIsAConic) {
  // Spheres of radius r at y = 0 and r - s·l at l: their tangent cone has half angle α with sin α = s.
  const double length = 40., ra = 6., rb = 1., s = (ra - rb) / length, tan = s / std::sqrt(1. - s * s);
  const RoundConed cone{{0, 0, 0}, {0, length, 0}, ra, rb};
  const double apex = ra / s;
  for (const float turn : {0.f, 25.f, 50.f}) {
    // A plane through (0, y, 0) at an angle cuts the cone in an ellipse: its long half axis from where the plane's line
    // meets the two sides, its short one from the cone's radius at its middle.
    const double y = 20., m = std::tan(double(radians(turn))), h = apex - y;
    const double x1 = tan * h / (1. - tan * m), x2 = tan * h / (1. + tan * m);  // to the two sides
    const double long_half = .5 * (x1 + x2) / std::cos(double(radians(turn)));
    const double x0 = .5 * (x1 - x2), r0 = tan * (h + m * x0);
    const double short_half = std::sqrt(r0 * r0 - x0 * x0);
    expect_area(cone, across_y(float(y), turn), pi64 * long_half * short_half);
  }
  // Lengthwise beside the axis: a hyperbola between two discs; by Simpson's rule along the axis.
  const double beside = .5;
  const int steps = 200000;
  double sum = 0.;
  const double low = -std::sqrt(ra * ra - beside * beside),
               high = length + std::sqrt(rb * rb - beside * beside);
  for (int i = 0; i <= steps; ++i) {
    const double y = low + (high - low) * i / steps;
    double r2 = 0.;  // of the solid at y
    if (y < s * ra)
      r2 = ra * ra - y * y;
    else if (y > length + s * rb)
      r2 = rb * rb - (y - length) * (y - length);
    else
      r2 = std::pow(tan * (apex - y), 2);
    sum += (i == 0 || i == steps ? 1. : i % 2 ? 4. : 2.) * 2. * std::sqrt(std::max(0., r2 - beside * beside));
  }
  expect_area(cone, Plane::through({0, 0, float(beside)}, {0, 0, 1}), sum * (high - low) / steps / 3.);
}

TEST(CrossSection, ContoursLieOnTheSurfaceAndAreConvexInAnyPosition) {
  Random random(7);
  int cut = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto any = [&](double half) {
      return Vec3(float(random.uniform(-half, half)), float(random.uniform(-half, half)),
                  float(random.uniform(-half, half)));
    };
    const RoundCone cone{any(4), any(4), float(random.uniform(0, 2)), float(random.uniform(0, 2))};
    const Plane plane = Plane::through(any(3), any(1));
    const auto section =
        CrossSection::of({cone.a.cast<double>(), cone.b.cast<double>(), cone.radius_a, cone.radius_b}, plane);
    if (!section) {  // then no point of the axis is nearer to the plane than its sphere is wide
      for (int k = 0; k <= 50; ++k) {
        const float t = float(k) / 50.f;
        EXPECT_GE(std::abs(plane.height(cone.a + t * (cone.b - cone.a))) + 1e-4f,
                  cone.radius_a + t * (cone.radius_b - cone.radius_a));
      }
      continue;
    }
    ++cut;
    const auto outline = section->outline();
    ASSERT_GE(outline.size(), 3u);
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Place &p = outline[k], &q = outline[(k + 1) % outline.size()],
                  &r = outline[(k + 2) % outline.size()];
      EXPECT_NEAR(signed_distance(plane.point(p.cast<float>()), cone), 0.f, 1e-4f);
      EXPECT_NEAR(signed_distance(plane.point((.5 * (p + q)).cast<float>()), cone), 0.f, 4e-3f);
      const Place e = q - p, f = r - q;
      EXPECT_GE(e.x() * f.y() - e.y() * f.x(), -1e-9);
    }
    EXPECT_NEAR(area_of(outline) / section->area(), 1., 1e-3);
  }
  EXPECT_GT(cut, 1000);
}

TEST(Union, CountsWhatOverlapsOnce) {
  const auto square = [](double x, double y, double size) {
    return std::vector<Place>{{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}};
  };
  using Polygons = std::vector<std::vector<Place>>;
  EXPECT_DOUBLE_EQ(area_of_union(Polygons{square(0, 0, 2), square(1, 1, 2)}), 7.);
  EXPECT_DOUBLE_EQ(area_of_union(Polygons{square(0, 0, 2), square(0, 0, 2), square(0, 0, 2)}), 4.);
  EXPECT_DOUBLE_EQ(area_of_union(Polygons{square(0, 0, 2), square(2, 0, 2)}), 8.);
  EXPECT_DOUBLE_EQ(area_of_union(Polygons{square(0, 0, 2), square(.5, .5, 1)}), 4.);
  EXPECT_DOUBLE_EQ(area_of_union(Polygons{square(0, 0, 2), square(9, 9, 1)}), 5.);
  EXPECT_DOUBLE_EQ(area_of_union({}), 0.);
  // Two joined segments of a straight branch, cut lengthwise through their joint: as one of twice the length.
  const Plane plane = Plane::through({1000, 0, 0}, {0, 0, 1});
  const auto outline_of = [&](double from, double to) {
    return CrossSection::of({{from, 5, .1}, {to, 5, .1}, .4, .4}, plane)->outline(1e-4);
  };
  EXPECT_NEAR(area_of_union(Polygons{outline_of(1000, 1010), outline_of(1010, 1020)}),
              area_of(outline_of(1000, 1020)), 1e-3);
}

}  // namespace
}  // namespace forest
