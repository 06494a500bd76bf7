// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/transform.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"

namespace forest {
namespace {

Morphology tree(bool soma) {
  MorphologyBuilder builder;
  if (soma)
    builder.set_soma(
        {.kind = SomaKind::sphere, .points = {{10, 20, 30, 5}}, .parents = {}, .contour_starts = {}});
  const SectionId stem = builder.add_section({}, SectionKind::apical,
                                             std::vector<Point>{{12, 25, 30, 2}, {12, 60, 30, 1}}, 17, 0);
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{12, 60, 30, 1}, {30, 90, 28, .5f}});
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{12, 60, 30, .8f}, {-3, 80, 31, .25f}});
  builder.add_spine({.section = stem, .position = 3.f, .head = {1, 0, 0}, .head_diameter = .5f});
  builder.annotate("species", "rat");
  return builder.build();
}

TEST(Annotations, AreReplacedAndNothingElse) {
  const Morphology before = tree(true), after = before.with_annotations({{"doi", "10.1/a"}});
  EXPECT_EQ(after, before);
  EXPECT_EQ(after.annotations(), (Annotations{{"doi", "10.1/a"}}));
  EXPECT_EQ(before.annotations(), (Annotations{{"species", "rat"}}));
}

TEST(Translated, MovesEveryPointAndChangesNothingElse) {
  const Morphology before = tree(true), after = translated(before, {1, 2, 3});
  ASSERT_EQ(after.points().size(), before.points().size());
  for (std::size_t i = 0; i < before.points().size(); ++i) {
    EXPECT_EQ(after.points()[i].position(), before.points()[i].position() + Vec3(1, 2, 3));
    EXPECT_EQ(after.points()[i].radius, before.points()[i].radius);
  }
  EXPECT_EQ(std::vector(after.sections().begin(), after.sections().end()),
            std::vector(before.sections().begin(), before.sections().end()));
  EXPECT_EQ(after.soma().points[0].position(), Vec3(11, 22, 33));
  EXPECT_EQ(after.spines()[0], before.spines()[0]);
  EXPECT_EQ(after.annotations(), before.annotations());
  EXPECT_NEAR(total_length(after), total_length(before), 1e-4);
  EXPECT_EQ(translated(after, {-1, -2, -3}), before);  // whole numbers: exact
}

TEST(Centred, PutsTheSomaAtTheOriginOnceAndForAll) {
  const Morphology once = centred(tree(true));
  EXPECT_EQ(centre(once), Vec3(0, 0, 0));
  EXPECT_EQ(centred(once), once);
}

TEST(Centred, ANeuronWithoutSomaIsHeldByItsFirstRoot) {
  EXPECT_EQ(centre(tree(false)), Vec3(12, 25, 30));
  EXPECT_EQ(centred(tree(false)).points()[0].position(), Vec3(0, 0, 0));
  EXPECT_EQ(centred(Morphology()), Morphology());
}

TEST(Stretched, ScalesOneAxisFromTheSoma) {
  const Morphology before = tree(true), after = stretched(before, {1, 1, 1.2f});
  ASSERT_EQ(after.points().size(), before.points().size());
  for (std::size_t i = 0; i < before.points().size(); ++i) {
    EXPECT_EQ(after.points()[i].x, before.points()[i].x);
    EXPECT_NEAR(after.points()[i].z - 30.f, 1.2f * (before.points()[i].z - 30.f), 1e-4);
    EXPECT_EQ(after.points()[i].radius, before.points()[i].radius);
  }
  EXPECT_EQ(after.soma(), before.soma());
  EXPECT_EQ(after.annotations(), before.annotations());
}

TEST(Reshaped, PutsEveryPointWhereItIsToldAndKeepsTheTree) {
  const Morphology before = centred(tree(true));
  std::vector<Vec3> places;
  for (const Point& p : before.points()) places.push_back(2.f * p.position() + Vec3(0.f, 1.f, 0.f));
  const Morphology after = reshaped(before, places, Quat::Identity());
  ASSERT_EQ(after.points().size(), places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(after.points()[i].position(), places[i]);
    EXPECT_EQ(after.points()[i].radius, before.points()[i].radius);
  }
  EXPECT_EQ(after.sections().size(), before.sections().size());
  EXPECT_EQ(after.soma(), before.soma());
  places.pop_back();
  EXPECT_THROW(reshaped(before, places, Quat::Identity()), Error);
}

TEST(Jittered, TurnsDaughtersAndKeepsLengths) {
  const Morphology before = tree(true), after = jittered(before, 10.f, 1, 5);
  ASSERT_EQ(after.points().size(), before.points().size());
  EXPECT_NE(after, before);
  EXPECT_EQ(after, jittered(before, 10.f, 1, 5));
  EXPECT_NE(after, jittered(before, 10.f, 2, 5));
  EXPECT_EQ(jittered(before, 0.f, 1, 5).points().size(), before.points().size());
  for (std::size_t i = 0; i < before.sections().size(); ++i) {
    EXPECT_NEAR(section_length(after, SectionId(i)), section_length(before, SectionId(i)), 1e-3);
    EXPECT_EQ(after.sections()[i], before.sections()[i]);
  }
  EXPECT_EQ(after.points(SectionId(0))[1].position(),
            before.points(SectionId(0))[1].position());  // stems stay
}

TEST(Jittered, TurnsByAnglesOfItsDeviation) {
  double squares = 0.;
  constexpr int trials = 2000;
  const Morphology before = tree(true);
  const auto way = [](const Morphology& m, std::size_t s) {
    return Vec3(m.points(SectionId(s)).back().position() - m.points(SectionId(s)).front().position())
        .normalized();
  };
  for (int k = 0; k < trials; ++k) {
    const Morphology after = jittered(before, 10.f, 1, std::uint64_t(k));
    for (const std::size_t s : {1u, 2u}) {
      const double turned = degrees(std::acos(std::clamp(way(before, s).dot(way(after, s)), -1.f, 1.f)));
      squares += turned * turned / (2. * trials);
    }
  }
  EXPECT_NEAR(std::sqrt(squares), 10., .5);
}

}  // namespace
}  // namespace forest
