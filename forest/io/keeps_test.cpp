// SPDX-License-Identifier: Apache-2.0
#include "forest/io/keeps.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"

#include "tests/zoo.h"

namespace forest::io {
namespace {

constexpr Keeps nothing{.kinds = false,
                        .tags = false,
                        .cylinders = false,
                        .contours = false,
                        .loose_roots = false,
                        .joints = false,
                        .single_daughters = false,
                        .stumps = false,
                        .still_points = false,
                        .lengthless = false,
                        .zero_radii = false,
                        .spines = false,
                        .annotations = false};

TEST(Keeps, AllKeptIsTheSameNeuronAndNothingIsLost) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology left = as_kept(specimen.morphology, {});
    EXPECT_EQ(left, specimen.morphology);
    EXPECT_EQ(left.annotations(), specimen.morphology.annotations());
    EXPECT_TRUE(losses(specimen.morphology, {}).empty());
  }
}

TEST(Keeps, WhatIsLeftHasNothingMoreToLose) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology left = as_kept(specimen.morphology, nothing);
    EXPECT_EQ(as_kept(left, nothing), left);
    for (const Warning& warning : losses(left, nothing))
      EXPECT_TRUE(warning.code == "roots-joined" || warning.code == "zero-radii") << warning.sentence;
  }
}

TEST(Keeps, ASectionWithoutLengthGetsAlmostNoneAndItsDaughtersFollow) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  const auto stump = b.add_section({}, SectionKind::basal, zoo_parts::Points{{700, 0, 900, 1}}, 3, 0);
  b.add_section(stump, SectionKind::basal, zoo_parts::Points{{710, 0, 900, 1}});
  b.add_section(stump, SectionKind::basal, zoo_parts::Points{{700, 0, 900, 2}});
  const Morphology left = as_kept(b.build(), {.lengthless = false});
  ASSERT_EQ(left.sections().size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_GT(section_length(left, SectionId(i)), .99e-6);
  EXPECT_NEAR(total_length(left), 10., 1e-5);
  const Point end = next_place({700, 800, -900, 1});
  EXPECT_EQ(end.y, 800.f);
  EXPECT_NEAR(end.x, 700., 1e-4);
}

TEST(Keeps, JoinedSectionsKeepTheirLengthAndTheirSpines) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  SectionId at = b.add_section({}, SectionKind::basal, zoo_parts::Points{{0, 5, 0, 1}, {0, 15, 0, 1}}, 3, 0);
  at = b.add_section(at, SectionKind::basal, zoo_parts::Points{{0, 25, 0, 1}});
  b.add_spine({at, 4.f, Vec3(1, 0, 0), .5f, .1f, SpineShape::thin});
  b.add_section(at, SectionKind::axon, zoo_parts::Points{{0, 30, 0, 1}});
  const Morphology m = b.build();
  const Keeps keeps{.single_daughters = false};
  const Morphology left = as_kept(m, keeps);
  ASSERT_EQ(left.sections().size(), 2u);  // the axon is of another kind and stays its own
  EXPECT_EQ(left.sections()[1].parent, SectionId(0));
  EXPECT_DOUBLE_EQ(total_length(left), total_length(m));
  ASSERT_EQ(left.spines().size(), 1u);
  EXPECT_EQ(left.spines()[0].section, SectionId(0));
  EXPECT_FLOAT_EQ(left.spines()[0].position, 14.f);
  ASSERT_EQ(losses(m, keeps).size(), 1u);
  EXPECT_EQ(losses(m, keeps)[0].code, "sections-joined");
}

TEST(Keeps, WhereNeuritesLeaveFromTheSomaIsToldWhenItIsLost) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.add_section({}, SectionKind::basal, zoo_parts::Points{{0, 50, 0, 1}, {0, 60, 0, 1}}, 3, 0);
  const Morphology m = b.build();
  const Keeps keeps{.soma_points = false};
  ASSERT_EQ(losses(m, keeps).size(), 1u);
  EXPECT_EQ(losses(m, keeps)[0].code, "attachments-lost");
  const Morphology left = as_kept(m, keeps);
  EXPECT_EQ(left.section(SectionId(0)).soma_point, -1);
  EXPECT_TRUE(losses(left, keeps).empty());
}

TEST(Keeps, AnnotationsWhoseKeysAFormatLacksBecomeCommentsAndAreToldOnce) {
  constexpr std::array<std::string_view, 1> own{"leaf"};
  const Keeps keeps{.keys = false, .own_keys = own};
  MorphologyBuilder b;
  const Annotations kept{
      {"leaf", "Incomplete 1 2 3"}, {"CREATURE", "rat"}, {"SOMA_AREA", "7"}, {"comment", "x"}};
  for (const auto& [key, value] : kept) b.annotate(key, value);
  EXPECT_TRUE(losses(b.build(), keeps).empty());
  for (const auto& [key, value] : kept) b.annotate(key, value);
  b.annotate("reference_doi", "10.1/a");
  b.annotate("notes", "of two\nlines");
  b.annotate("CREATURE X", "a key of two words");
  b.annotate("FOREST_NODE", "2");
  const Morphology m = b.build();
  const std::vector<Warning> told = losses(m, keeps);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].code, "keys-lost");
  EXPECT_TRUE(told[0].sentence.starts_with("4 annotations become comments")) << told[0].sentence;
  Annotations left = kept;
  for (const char* const line :
       {"reference_doi 10.1/a", "notes of two", "lines", "CREATURE X a key of two words", "FOREST_NODE 2"})
    left.emplace_back("comment", line);
  EXPECT_EQ(as_kept(m, keeps).annotations(), left);
  EXPECT_TRUE(losses(as_kept(m, keeps), keeps).empty());
}

TEST(Keeps, AnOutlineThatBecomesASphereHasNoPointsWithoutRadius) {
  MorphologyBuilder b;
  b.set_soma({.kind = SomaKind::contours,
              .points = {{5, 0, 0, 0}, {0, 5, 0, 0}, {-5, 0, 0, 0}},
              .parents = {},
              .contour_starts = {0}});
  const Morphology m = b.build();
  ASSERT_EQ(losses(m, {.contours = false, .zero_radii = false}).size(), 1u);
  EXPECT_EQ(losses(m, {.contours = false, .least_diameter = 1e-6f})[0].code, "soma-simplified");
  EXPECT_EQ(losses(m, {.zero_radii = false})[0].code, "zero-radii");
}

TEST(Keeps, CoordinatesAreRoundedToTheStep) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5.04f));
  b.add_section({}, SectionKind::basal, zoo_parts::Points{{.26f, -.24f, 7, .33f}, {1.05f, 2, 3, .1f}}, 3, 0);
  const Morphology left = as_kept(b.build(), {.step = .1f});
  EXPECT_THAT(left.points()[0], testing::Eq(Point{.3f, -.2f, 7.f, .35f}));
}

TEST(Keeps, DepthFirstIsTheSameTreeInAnotherOrder) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology left = as_kept(specimen.morphology, {.order = false});
    ASSERT_EQ(left.sections().size(), specimen.morphology.sections().size());
    for (std::size_t i = 1; i < left.sections().size(); ++i)
      if (const SectionId parent = left.sections()[i].parent; parent.valid()) {
        EXPECT_TRUE(parent.value() == i - 1 || left.children(parent)[0] != SectionId(i));
      }
    EXPECT_EQ(as_kept(left, {.order = false}), left);
    EXPECT_TRUE(losses(specimen.morphology, {.order = false}).empty());
    EXPECT_EQ(left.spines().size(), specimen.morphology.spines().size());
  }
}

// HDF5 numbers processes of glia by numbers that mean dendrites in SWC.
TEST(Keeps, NumbersOfAnotherKindAreTold) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::glia, zoo_parts::Points{{0, 0, 0, 1}, {0, 9, 0, 1}}, 2);
  b.add_section({}, SectionKind::glia, zoo_parts::Points{{0, 0, 0, 1}, {0, -9, 0, 1}}, 7);
  const Morphology m = b.build();
  const Keeps keeps{.foreign_tags = false};
  const auto told = losses(m, keeps);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].code, "tags-lost");
  EXPECT_THAT(told[0].sentence, testing::HasSubstr("1 sections"));
  EXPECT_EQ(as_kept(m, keeps).sections()[0].tag, 7);
  EXPECT_TRUE(losses(m, {}).empty());
  EXPECT_EQ(as_kept(m, {}), m);
}

TEST(Keeps, WhatIsRoundedOrTooLargeIsTold) {
  const Keeps keeps{.spine_sizes = false,
                    .step = .1f,
                    .largest_tag = 9999,
                    .largest_place = 1000.f,
                    .largest_diameter = 10.f};
  MorphologyBuilder b;
  const auto stem =
      b.add_section({}, SectionKind::custom, zoo_parts::Points{{0, .04f, 0, 1}, {0, 22.46f, 0, 1}}, 10000);
  b.add_spine({stem, 4.f, Vec3(1, 0, 0), .5f, .1f, SpineShape::thin});
  const Morphology m = b.build(), left = as_kept(m, keeps);
  EXPECT_EQ(left.points()[1].y, 22.5f);
  EXPECT_EQ(left.sections()[0].tag, int(SectionKind::custom));
  EXPECT_EQ(left.spines()[0], (Spine{.section = stem, .position = 4.f}));
  std::vector<std::string_view> codes;
  for (const Warning& warning : losses(m, keeps)) codes.push_back(warning.code);
  EXPECT_THAT(codes, testing::ElementsAre("spine-sizes-lost", "tags-lost", "rounded"));
  EXPECT_TRUE(losses(left, keeps).empty());
  EXPECT_NO_THROW(check_fits(m, keeps));
  b.add_section({}, SectionKind::axon, zoo_parts::Points{{0, 0, 0, 1}, {0, -1001, 0, 1}});
  EXPECT_THROW(check_fits(b.build(), keeps), LimitError);
  b.add_section({}, SectionKind::axon, zoo_parts::Points{{0, 0, 0, 1}, {0, 1, 0, 6}});
  EXPECT_THROW(check_fits(b.build(), keeps), LimitError);
}

}  // namespace
}  // namespace forest::io
