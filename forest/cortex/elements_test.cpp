// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/elements.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/cortex/slab_test.h"

namespace forest::cortex {
namespace {

// A surface above the slab that rises and falls by 25 µm over 1.5 mm, in triangles of 50 µm; what a cubic can follow.
double height(double x, double y) {
  constexpr double wave = 2. * double(pi) / 1500.;
  return 30. + 25. * std::sin(wave * x) * std::cos(wave * y);
}
Mesh waves() {
  Mesh mesh;
  constexpr int n = 50;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = 50. * i - 500., y = 50. * j - 500.;
      mesh.positions.emplace_back(float(x), float(y), float(height(x, y)));
    }
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = (n + 1) * j + i, b = a + n + 1;
      mesh.triangles.push_back({a, a + 1, b + 1}), mesh.triangles.push_back({a, b + 1, b});
    }
  return mesh;
}
double farthest(const Elements& elements, const TriangleTree& surface) {
  double most = 0.;
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const double u : {.1, .3, .5, .7, .9})
      for (const double v : {.1, .3, .5, .7, .9})
        most = std::max(most, surface.nearest(elements.hexahedron(e).at(u, v, 0.))->distance);
  return most;
}
const auto as_it_is = [](const Place& p) { return p; };

TEST(FitFaces, FollowsAWaveWithinAFace) {
  Elements elements = make_slab(3, as_it_is);
  const TriangleTree outer(waves()), inner(plane(-2000.));
  ASSERT_GT(farthest(elements, outer), 50.);
  fit_faces(elements, outer, inner);
  EXPECT_LT(farthest(elements, outer), 6.);
  for (const Depths& curve : elements.curves)
    EXPECT_NEAR(curve[3].z(), -2000., 1e-6);  // it lay there already
  EXPECT_TRUE(uncertified(elements).empty());
}

TEST(FitFaces, DoesNotGoToAnotherBank) {
  Elements elements = make_slab(2, as_it_is);
  const std::vector<Depths> before = elements.curves;
  Mesh turned = waves();
  for (Triangle& t : turned.triangles) std::swap(t[0], t[1]);
  fit_faces(elements, TriangleTree(turned), TriangleTree(plane(-2000.)));
  for (std::size_t c = 0; c < before.size(); ++c)
    for (std::size_t d = 0; d < 4; ++d) EXPECT_LT((elements.curves[c][d] - before[c][d]).norm(), 1e-6);
}

}  // namespace
}  // namespace forest::cortex
