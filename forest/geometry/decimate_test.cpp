// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/decimate.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/self_intersection.h"
#include "forest/geometry/triangle_tree.h"

#include "tests/effort.h"

namespace forest {
namespace {

// Two folded balls, 300 µm apart, the inner one with label 1.
Mesh shells() {
  Mesh both;
  for (const std::uint8_t label : {std::uint8_t(0), std::uint8_t(1)}) {
    Mesh ball = icosphere(Vec3::Zero(), 1.f, 5, label);
    for (Vec3& p : ball.positions)
      p *= 6000.f - 300.f * float(label) + 700.f * std::sin(5.f * p.x()) * std::sin(4.f * p.y() + p.z());
    append(both, ball);
  }
  return both;
}

double farthest(const Mesh& from, const Mesh& to) {
  const TriangleTree tree(to);
  double most = 0.;
  for (const Vec3& p : from.positions) most = std::max(most, tree.nearest(p.cast<double>())->distance);
  return most;
}

Mesh thin(const Mesh& mesh, double error, double longest = 1500.) {
  return decimated(mesh, {.error = error, .longest = longest}, Progress::none());
}

TEST(Decimated, StaysAsNearAsIsAskedBothWays) {
  LONG_TEST();
  const Mesh mesh = shells();
  std::size_t before = mesh.triangles.size();
  for (const double error : {5., 20., 80.}) {
    const Mesh less = thin(mesh, error);
    EXPECT_LE(farthest(mesh, less), error);
    EXPECT_LE(farthest(less, mesh), error + .01);  // its vertices are floats
    EXPECT_LT(less.triangles.size(), before);
    before = less.triangles.size();
  }
  EXPECT_LT(before, mesh.triangles.size() / 4);
}

TEST(Decimated, KeepsSpheresSpheresThatCutNothingAndLieWithinOneAnother) {
  const Mesh mesh = shells(), less = thin(mesh, 200., 1e5);
  EXPECT_TRUE(is_closed(less));
  EXPECT_EQ(count_pieces(less), 2u);
  EXPECT_EQ(euler_number(less), 4);
  EXPECT_EQ(count_cut_triangles(mesh), 0u);
  EXPECT_EQ(count_cut_triangles(less), 0u);
  Mesh outer;
  outer.positions = less.positions;
  for (const Triangle& t : less.triangles) {
    for (const std::uint32_t v : t) EXPECT_EQ(less.labels[v], less.labels[t[0]]);
    if (less.labels[t[0]] == 0) outer.triangles.push_back(t);
  }
  const TriangleTree tree(outer);
  for (std::size_t v = 0; v < less.positions.size(); ++v)
    if (less.labels[v] == 1) {
      EXPECT_TRUE(tree.encloses(less.positions[v].cast<double>()));
    }
}

TEST(Decimated, HasNoEdgeLongerThanIsAllowed) {
  const Mesh less = thin(shells(), 500., 600.);
  for (const Triangle& t : less.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_LE((less.positions[t[k]] - less.positions[t[(k + 1) % 3]]).norm(), 600.1f);
}

TEST(Decimated, KeepsHandles) {
  ScalarGrid torus{.size = {40, 40, 20},
                   .origin = {-19500., -19500., -9500.},
                   .step = {1000., 1000., 1000.},
                   .values = {}};
  for (std::size_t z = 0; z < 20; ++z)
    for (std::size_t y = 0; y < 40; ++y)
      for (std::size_t x = 0; x < 40; ++x) {
        const double u = 1000. * double(x) - 19500., v = 1000. * double(y) - 19500.,
                     w = 1000. * double(z) - 9500.;
        torus.values.push_back(float(std::hypot(std::hypot(u, v) - 12000., w) - 4000.));
      }
  const Mesh mesh = isosurface(torus), less = thin(mesh, 1500., 1e5);
  EXPECT_EQ(euler_number(mesh), 0);
  EXPECT_EQ(euler_number(less), 0);
  EXPECT_TRUE(is_closed(less));
  EXPECT_LT(less.triangles.size(), mesh.triangles.size() / 10);
}

TEST(Decimated, IsTheSameAtAnyNumberOfThreads) {
  const Mesh mesh = shells();
  const auto with = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return thin(mesh, 20., 150.);  // many boxes
  };
  const Mesh one = with(1), two = with(2);
  EXPECT_EQ(one.positions, two.positions);
  EXPECT_EQ(one.triangles, two.triangles);
}

}  // namespace
}  // namespace forest
