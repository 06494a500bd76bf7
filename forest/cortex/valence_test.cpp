// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/valence.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

namespace forest::cortex {
namespace {

constexpr int side = 8;
std::uint32_t at(int i, int j) { return std::uint32_t(i + (side + 1) * j); }

Quads sheet() {
  Quads quads;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i)
      quads.middle.emplace_back(600. * i, 600. * j, 0.), quads.on_valley.push_back(0);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      quads.quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  return quads;
}

// How many vertices have 1, 2, 3, … quadrilaterals.
std::map<int, int> valences(const Quads& quads) {
  std::vector<int> around(quads.middle.size());
  for (const Quad& q : quads.quads)
    for (const std::uint32_t v : q) ++around[v];
  std::map<int, int> result;
  for (const int n : around) ++result[n];
  return result;
}

// Vertices − sides + faces: 1 for a sheet without holes; −1000 where a side has three faces.
long euler(const Quads& quads) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Quad& q : quads.quads)
    for (std::size_t k = 0; k < 4; ++k) ++sides[std::minmax(q[k], q[(k + 1) % 4])];
  if (std::ranges::any_of(sides, [](const auto& s) { return s.second > 2; })) return -1000;
  return long(quads.middle.size()) - long(sides.size()) + long(quads.quads.size());
}

double area(const Quads& quads) {
  double sum = 0.;
  for (const Quad& q : quads.quads)
    sum += .5 * (quads.middle[q[2]] - quads.middle[q[0]]).cross(quads.middle[q[3]] - quads.middle[q[1]]).z();
  return sum;
}

const std::map<int, int> regular{{1, 4}, {2, 4 * (side - 1)}, {4, (side - 1) * (side - 1)}};

TEST(Valences, OfARegularSheetStay) {
  Quads quads = sheet();
  EXPECT_EQ(even_valences(quads), 0u);
  EXPECT_EQ(valences(quads), regular);
}

TEST(Valences, ATurnedSideIsTurnedBack) {
  Quads quads = sheet();
  // The side from (4, 4) to (4, 5) between two faces becomes one from (3, 4) to (5, 5).
  std::erase_if(quads.quads, [](const Quad& q) { return q[0] == at(3, 4) || q[0] == at(4, 4); });
  quads.quads.push_back({at(3, 4), at(4, 4), at(5, 4), at(5, 5)});
  quads.quads.push_back({at(5, 5), at(4, 5), at(3, 5), at(3, 4)});
  ASSERT_EQ(valences(quads)[5], 2);
  EXPECT_EQ(even_valences(quads), 1u);
  EXPECT_EQ(valences(quads), regular);
  EXPECT_EQ(euler(quads), 1);
  EXPECT_NEAR(area(quads), area(sheet()), 1.);
}

TEST(Valences, AFaceBetweenTwoOfThreeIsClosed) {
  Quads quads = sheet();
  // A vertex split in two, with a face between: two of three, and two of five.
  const std::uint32_t old = at(4, 4), fresh = std::uint32_t(quads.middle.size());
  quads.middle.emplace_back(2400. + 100., 2400. + 100., 0.), quads.on_valley.push_back(0);
  quads.middle[old] -= Place(100., 100., 0.);
  for (Quad& q : quads.quads)
    if (q[0] == old) q[0] = fresh;  // the face above and to the right
  quads.quads.push_back({old, at(5, 4), fresh, at(4, 5)});
  ASSERT_EQ(valences(quads)[2], regular.at(2) + 1);
  even_valences(quads);
  EXPECT_EQ(valences(quads), regular);
  EXPECT_EQ(euler(quads), 1);
}

TEST(Valences, ValleysAreKept) {
  Quads quads = sheet();
  std::erase_if(quads.quads, [](const Quad& q) { return q[0] == at(3, 4) || q[0] == at(4, 4); });
  quads.quads.push_back({at(3, 4), at(4, 4), at(5, 4), at(5, 5)});
  quads.quads.push_back({at(5, 5), at(4, 5), at(3, 5), at(3, 4)});
  quads.on_valley[at(3, 4)] = quads.on_valley[at(5, 5)] = 1;
  EXPECT_EQ(even_valences(quads), 0u);
}

}  // namespace
}  // namespace forest::cortex
