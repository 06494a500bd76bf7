// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/morphology.h"

#include <limits>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

namespace forest {
namespace {

Morphology bifurcating() {
  MorphologyBuilder builder;
  builder.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 5}}, .parents = {}, .contour_starts = {}});
  const auto stem =
      builder.add_section({}, SectionKind::apical, std::vector<Point>{{0, 5, 0, 2}, {0, 15, 0, 1}});
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{3, 19, 0, 1}});
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{0, 15, 0, .5f}, {-3, 19, 0, .5f}});
  return builder.build();
}

TEST(Morphology, IsParentFirstWithJointsRepeated) {
  const Morphology m = bifurcating();
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.roots().size(), 1u);
  EXPECT_EQ(m.children(SectionId(0)).size(), 2u);
  EXPECT_TRUE(m.is_terminal(SectionId(2)));
  EXPECT_EQ(m.points(SectionId(1))[0], (Point{0, 15, 0, 1}));
  EXPECT_EQ(m.points(SectionId(2))[0].radius, .5f);  // a joint's own radius is kept
  EXPECT_EQ(m.order(SectionId(2)), 1);
  EXPECT_EQ(m.segment_count(), 3u);
}

TEST(Morphology, HasLengthAreaAndPathDistance) {
  const Morphology m = bifurcating();
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  EXPECT_NEAR(section_area(m, SectionId(2)), std::numbers::pi * 5., 1e-12);
  EXPECT_DOUBLE_EQ(path_distances(m)[1], 15.);
}

TEST(Morphology, EmptyIsAValue) {
  const Morphology m;
  EXPECT_TRUE(m.sections().empty());
  EXPECT_TRUE(m.bounds().empty());
  EXPECT_EQ(m.segment_count(), 0u);
}

TEST(MorphologyBuilder, SectionsAllAtOnceAreThoseOneByOne) {
  const Morphology m = bifurcating();
  const std::vector<Point> points(m.points().begin(), m.points().end());
  const std::vector<Section> sections(m.sections().begin(), m.sections().end());
  MorphologyBuilder b;
  b.set_soma(m.soma());
  b.add_sections(points, sections);
  EXPECT_EQ(b.build(), m);

  const auto refused = [&](auto spoil) {
    auto p = points;
    auto s = sections;
    spoil(p, s);
    EXPECT_THROW(MorphologyBuilder().add_sections(p, s), Error);
  };
  const float inf = std::numeric_limits<float>::infinity();
  refused([&](auto& p, auto&) { p[1].y = inf; });
  refused([&](auto& p, auto&) { p[3].radius = -1.f; });
  refused([&](auto& p, auto&) { p[2].x += 1.f; });  // a daughter elsewhere than its parent's end
  refused([&](auto& p, auto&) { p.push_back({}); });
  refused([&](auto& p, auto&) { p.pop_back(); });
  refused([&](auto&, auto& s) { s[1].parent = SectionId(2); });
  refused([&](auto&, auto& s) { s[1].parent = SectionId(1); });
  refused([&](auto&, auto& s) { s[2].first_point = 3; });
  refused([&](auto&, auto& s) { s[2].point_count = 0; });
  refused([&](auto& p, auto& s) { p.pop_back(), s[2].point_count = 1; });
  b.add_sections(points, sections);
  EXPECT_THROW(b.add_sections(points, sections), Error);
}

TEST(MorphologyBuilder, RefusesWhatIsNotANeuron) {
  MorphologyBuilder b;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(b.add_section({}, SectionKind::axon, {}), Error);
  EXPECT_THROW(b.add_section(SectionId(0), SectionKind::axon, std::vector<Point>{{0, 0, 0, 1}}), Error);
  EXPECT_THROW(b.add_section({}, SectionKind::axon, std::vector<Point>{{nan, 0, 0, 1}}), Error);
  EXPECT_THROW(b.add_section({}, SectionKind::axon, std::vector<Point>{{0, 0, 0, -1}}), Error);
  EXPECT_THROW(b.add_spine({}), Error);
  EXPECT_THROW(b.set_soma({.kind = SomaKind::sphere, .points = {}, .parents = {}, .contour_starts = {}}),
               Error);
}

TEST(Validate, ReturnsWhatIsOdd) {
  MorphologyBuilder b;
  const auto root =
      b.add_section({}, SectionKind::basal, std::vector<Point>{{0, 0, 0, 1}, {1, 0, 0, 0}, {1, 0, 0, 1}});
  b.add_section(root, SectionKind::axon, std::vector<Point>{{2, 0, 0, 1}});
  std::vector<std::string_view> codes;
  for (const Finding& f : validate(b.build())) codes.push_back(f.code);
  const std::vector<std::string_view> expected{"no-soma", "zero-radius", "zero-length", "unifurcation",
                                               "kind-change"};
  EXPECT_EQ(codes, expected);
}

TEST(Soma, CylindersHaveLateralArea) {
  const Soma soma{.kind = SomaKind::cylinders,
                  .points = {{0, -5, 0, 5}, {0, 5, 0, 5}},
                  .parents = {-1, 0},
                  .contour_starts = {}};
  EXPECT_NEAR(soma.area(), std::numbers::pi * 100., 1e-6);
  EXPECT_NEAR(soma.sphere().radius, 5.f, 1e-5f);
}

TEST(Soma, OfPointsAtOnePlaceIsTheWidestBall) {
  const Soma soma{.kind = SomaKind::cylinders,
                  .points = {{1, 0, 0, .5f}, {1, 0, 0, .75f}},
                  .parents = {-1, 0},
                  .contour_starts = {}};
  EXPECT_FLOAT_EQ(soma.sphere().radius, .75f);
  EXPECT_NEAR(soma.area(), 4. * std::numbers::pi * .75 * .75, 1e-6);
}

}  // namespace
}  // namespace forest
