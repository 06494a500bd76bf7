// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/mixing.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::fitting {
namespace {

// Neurons of random styles, each with an apical stem and two basal ones, as they are asked for.
Traced traced(std::size_t count, bool apical, bool basal) {
  Traced t;
  Random random(7, count);
  for (std::size_t i = 0; i < count; ++i) {
    Cell cell;
    for (const auto& [kind, there, stems] :
         {std::tuple{SectionKind::apical, apical, 1}, {SectionKind::basal, basal, 2}}) {
      if (!there) continue;
      for (double& s : cell.kinds[int(kind)].style) s = random.normal();
      for (int k = 0; k < stems; ++k)
        cell.stems.push_back({.cell = i,
                              .kind = int(kind),
                              .tips = 1,
                              .ahead = 9,
                              .length = 9,
                              .end_diameter = 1,
                              .place = Vec3::UnitY(),
                              .heading = Vec3::UnitY(),
                              .aim = Vec3::UnitY(),
                              .points = {}});
    }
    t.cells.push_back(std::move(cell));
  }
  return t;
}

std::vector<std::size_t> each_once(std::vector<std::size_t> of) {
  std::ranges::sort(of);
  return of;
}

std::vector<std::size_t> all(std::size_t count) {
  std::vector<std::size_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

TEST(Mixing, EachIsAnothersMateOnceAndAnothersThirdOnce) {
  for (const std::size_t count : {2u, 3u, 17u, 1001u}) {
    const Traced t = traced(count, true, true);
    std::vector<std::size_t> mates, thirds;
    for (const Mixed& m : mix(t, 0)) {
      const std::size_t i = mates.size();
      EXPECT_EQ(m.others_as, i);
      ASSERT_EQ(m.stems.size(), 3u);
      EXPECT_EQ(m.stems[0], &t.cells[i].stems[0]);
      EXPECT_EQ(m.stems[1], &t.cells[m.basal_as].stems[1]);
      EXPECT_EQ(m.stems[2], &t.cells[m.basal_as].stems[2]);
      EXPECT_NE(m.basal_as, i);
      EXPECT_NE(m.thin_as, i);
      EXPECT_TRUE(count < 4 || m.thin_as != m.basal_as);
      mates.push_back(m.basal_as), thirds.push_back(m.thin_as);
    }
    EXPECT_EQ(each_once(mates), all(count));
    EXPECT_EQ(each_once(thirds), all(count));
  }
}

TEST(Mixing, OneKindComesFromTheMateAllOfIt) {
  for (const bool basal : {false, true}) {
    const Traced t = traced(9, !basal, basal);
    for (const Mixed& m : mix(t, 0)) {
      EXPECT_EQ(m.stems.size(), basal ? 2u : 1u);
      for (const Stem* s : m.stems) EXPECT_EQ(s->cell, basal ? m.basal_as : m.others_as);
    }
  }
}

// Interneurons of which some have an apical dendrite: as many have one when grown, each the one of a traced neuron.
TEST(Mixing, NoKindOfStemComesMoreOftenThanItWasTraced) {
  for (const std::size_t both : {1u, 2u, 5u, 20u})
    for (const auto& [apical, basal] : {std::pair{false, true}, {true, false}}) {
      Traced t = traced(20, true, true);
      const Traced others = traced(20, apical, basal);
      for (std::size_t i = both; i < 20; ++i) t.cells[i] = others.cells[i];
      std::multiset<const Stem*> stems;
      for (const Mixed& m : mix(t, 4)) stems.insert(m.stems.begin(), m.stems.end());
      for (const Cell& c : t.cells)
        for (const Stem& s : c.stems) EXPECT_EQ(stems.count(&s), 1u) << both;
      for (std::size_t i = 0; const Mixed& m : mix(t, 4)) {
        std::set<int> kinds, own;
        for (const Stem* s : m.stems) kinds.insert(s->kind);
        for (const Stem& s : t.cells[i++].stems) own.insert(s.kind);
        EXPECT_EQ(kinds, own) << both;
      }
    }
}

// Of all permutations of six.
TEST(Mixing, MatesAreTogetherAsAlikeAsCanBe) {
  for (std::size_t salt = 6; salt < 9; ++salt) {
    Traced t = traced(salt, true, false);
    t.cells.resize(6);
    std::array<std::size_t, 6> order{0, 1, 2, 3, 4, 5};
    double least = 1e300;
    do {
      double sum = 0.;
      for (std::size_t i = 0; i < 6; ++i) sum += order[i] == i ? 1e9 : apart(t.cells[i], t.cells[order[i]]);
      least = std::min(least, sum);
    } while (std::ranges::next_permutation(order).found);
    double sum = 0.;
    for (std::size_t i = 0; const Mixed& m : mix(t, 0)) sum += apart(t.cells[i++], t.cells[m.others_as]);
    EXPECT_NEAR(sum, least, 1e-9 * least);
  }
}

TEST(Mixing, NoMateIsOfTheKin) {
  const Traced t = traced(40, false, true);
  for (std::size_t i = 0; const Mixed& m : mix(t, 3)) {
    ASSERT_EQ(m.kin.size(), 3u);
    std::size_t nearer = 0;
    for (const Cell& c : t.cells) nearer += apart(t.cells[i], c) < apart(t.cells[i], t.cells[m.basal_as]);
    EXPECT_GE(nearer, 4u);  // the kin, and itself
    EXPECT_EQ(std::ranges::count(m.kin, m.thin_as), 0);
    ++i;
  }
}

// Two in three have other numbers of basal stems: each stem has the pose of one of its kind, of another neuron than the mate, and
// no pose comes twice.
TEST(Mixing, StemsLieAsThoseOfAFourthThatHasAsMany) {
  Traced t = traced(40, true, true);
  for (std::size_t i = 0; i < t.cells.size(); ++i)
    for (std::size_t more = 0; more < i % 3; ++more) t.cells[i].stems.push_back(t.cells[i].stems.back());
  std::set<const Stem*> poses;
  for (const Mixed& m : mix(t, 4)) {
    ASSERT_EQ(m.poses.size(), m.stems.size());
    for (std::size_t k = 0; k < m.stems.size(); ++k) {
      EXPECT_EQ(m.poses[k]->kind, m.stems[k]->kind);
      EXPECT_TRUE(poses.insert(m.poses[k]).second);
      if (m.stems[k]->kind == int(SectionKind::basal))
        EXPECT_NE(m.poses[k]->cell, m.stems[k]->cell);
      else
        EXPECT_EQ(m.poses[k], m.stems[k]);
    }
  }
}

}  // namespace
}  // namespace forest::fitting
