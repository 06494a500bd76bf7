// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/hidden_sulci.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace forest::cortex {
namespace {

using Eigen::Vector3d;
constexpr double thick = 2000.;  // µm, of the cortex

// µm from a box, negative within.
double from_box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d off = (low - p).cwiseMax(p - high);
  return off.cwiseMax(0.).norm() + std::min(0., off.maxCoeff());
}

// Two blades of white matter on a floor, so far apart that the cortex on them leaves a sulcus .2 mm wide between, at z = 10.5
// mm: sections lie .5 mm before and behind it.
double blades(const Vector3d& p) {
  const double floor = from_box(p, {-1e5, -1e5, -1e5}, {1e5, 2000., 1e5});
  const auto blade = [&](double from, double to) {
    return from_box(p, {-1e5, -1e5, from}, {1e5, 6000., to});
  };
  return std::min({floor, blade(6500., 8400.), blade(12600., 14500.)});
}
double one_block(const Vector3d& p) { return from_box(p, {-1e5, -1e5, 6500.}, {1e5, 6000., 14500.}); }

struct Sections {
  ScalarGrid outer, inner;
};

// What sections 1 mm apart say of a cortex on this white matter, and what is interpolated in the middle between them.
Sections seen(double (*white)(const Vector3d&)) {
  Sections s;
  s.inner = {.size = {16, 60, 43}, .step = {250., 250., 500.}, .values = {}};
  const auto outside = [&](const Vector3d& p) { return white(p) - thick; };
  s.outer = s.inner;
  for (std::size_t z = 0; z < s.inner.size[2]; ++z)
    for (std::size_t y = 0; y < s.inner.size[1]; ++y)
      for (std::size_t x = 0; x < s.inner.size[0]; ++x) {
        const Vector3d p(250. * double(x), 250. * double(y), 500. * double(z)), step(0., 0., 500.);
        s.inner.values.push_back(float(white(p)));
        s.outer.values.push_back(float(z % 2 ? .5 * (outside(p - step) + outside(p + step)) : outside(p)));
      }
  return s;
}

TEST(HiddenSulci, AreOpenedWhereBanksMeetBetweenSections) {
  Sections s = seen(blades);
  const ScalarGrid before = s.outer;
  const std::size_t opened = open_hidden_sulci(s.outer, s.inner, 2, 50.f);
  std::size_t count = 0, wanted = 0, reached = 0;
  for (std::size_t z = 0; z < s.outer.size[2]; ++z)
    for (std::size_t y = 0; y < s.outer.size[1]; ++y)
      for (std::size_t x = 0; x < s.outer.size[0]; ++x) {
        const std::size_t i = s.outer.index(x, y, z);
        const Vector3d p(250. * double(x), 250. * double(y), 500. * double(z));
        const bool now = s.outer.values[i] != before.values[i], hidden = before.values[i] < 0.f;
        count += now;
        if (now) {
          EXPECT_EQ(z, 21u);  // 10.5 mm
          EXPECT_EQ(s.outer.values[i], 50.f);
          EXPECT_GT(blades(p), .7 * thick - 1.);
        }
        if (z % 2 && hidden && blades(p) > thick) ++wanted, reached += now;
      }
  EXPECT_EQ(count, opened);
  EXPECT_GT(wanted, 100u);
  EXPECT_GE(double(reached), .95 * double(wanted));
}

TEST(HiddenSulci, AreNoneWhereNoBanksAre) {
  Sections s = seen(one_block);
  EXPECT_EQ(open_hidden_sulci(s.outer, s.inner, 2, 50.f), 0u);
}

TEST(HiddenSulci, AreNoneThatDoNotReachTheOutside) {
  Sections s = seen(blades);
  // Grey matter over it all.
  for (std::size_t z = 0; z < s.outer.size[2]; ++z)
    for (std::size_t y = 0; y < s.outer.size[1]; ++y)
      for (std::size_t x = 0; x < s.outer.size[0]; ++x) {
        float& value = s.outer.values[s.outer.index(x, y, z)];
        value = std::min(value, y + 3 < s.outer.size[1] ? -300.f : 300.f);
      }
  EXPECT_EQ(open_hidden_sulci(s.outer, s.inner, 2, 50.f), 0u);
}

TEST(HiddenSulci, SectionsStayAsTheyAre) {
  Sections s = seen(blades);
  const ScalarGrid before = s.outer;
  EXPECT_EQ(open_hidden_sulci(s.outer, s.inner, 1, 50.f), 0u);  // every layer is a section
  EXPECT_EQ(s.outer.values, before.values);
}

TEST(HiddenSulci, WithoutWhiteMatterThereAreNone) {
  Sections s = seen(blades);
  std::ranges::fill(s.inner.values, 1.f);
  EXPECT_EQ(open_hidden_sulci(s.outer, s.inner, 2, 50.f), 0u);
}

}  // namespace
}  // namespace forest::cortex
