// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/surface.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/zoo.h"

namespace forest {
namespace {

void expect_sound(const Mesh& mesh) {
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(mesh.labels.size(), mesh.positions.size());
  for (const Vec3& p : mesh.positions) ASSERT_TRUE(p.allFinite());
  for (const std::uint8_t label : mesh.labels) ASSERT_LT(label, 8);
}

TEST(Surface, TubesOfAnyNeuronAreClosed) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    expect_sound(tubes(specimen.morphology, {.sides = 5}));
  }
}

TEST(Surface, SticksOfAnyNeuronAreLinesOfTwoPointsOrMore) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Lines lines = sticks(specimen.morphology);
    for (std::size_t i = 0; i < lines.starts.size(); ++i) EXPECT_GE(lines.line(i).size(), 2u);
  }
}

TEST(Surface, OfAnyNeuronIsClosedAndTheSameTwice) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    try {
      const Surface once = surface(specimen.morphology, {.voxel = 2.f});
      expect_sound(once.mesh);
      EXPECT_EQ(once.mesh.positions, surface(specimen.morphology, {.voxel = 2.f}).mesh.positions);
    } catch (const LimitError& error) {  // told, not tried
      EXPECT_THAT(error.what(), testing::HasSubstr("choose"));
    }
  }
}

TEST(Surface, OfATreeIsOnePieceAndHasTheVolumeOfItsParts) {
  const Morphology m = zoo_parts::binary_tree(3);
  const Surface made = surface(m);
  EXPECT_EQ(count_pieces(made.mesh), 1u);
  EXPECT_EQ(made.thickened, 0u);
  const Mesh parts = tubes(m, {.sides = 32});
  EXPECT_NEAR(volume(made.mesh) / volume(parts), 1., .1);  // the parts overlap a little
  EXPECT_TRUE(std::ranges::count(made.mesh.labels, soma_label) > 0);
  EXPECT_TRUE(std::ranges::count(made.mesh.labels, std::uint8_t(SectionKind::basal)) > 0);
}

TEST(Surface, AnUnbranchedCylinderHasItsVolume) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, std::vector<Point>{{0, 0, 0, 1}, {30, 10, 0, 1}, {60, 20, 0, 1}});
  const Morphology m = b.build();
  const double length = std::hypot(60., 20.), expected = pi * length;
  EXPECT_NEAR(volume(tubes(m, {.sides = 48})) / expected, 1., .01);
  EXPECT_NEAR(volume(surface(m, {.voxel = .25f}).mesh) / expected, 1. + 4. / 3. / length, .02);
}

TEST(Surface, ALongThinNeuronIsMadeWithinMemory) {
  MorphologyBuilder b;
  std::vector<Point> line;
  for (int i = 0; i <= 300; ++i)
    line.push_back({5.f * float(i), 20.f * std::sin(.1f * float(i)), 20.f * std::cos(.13f * float(i)), .5f});
  b.add_section({}, SectionKind::axon, line);
  const Surface made = surface(b.build());
  EXPECT_FLOAT_EQ(made.voxel, .5f);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(count_pieces(made.mesh), 1u);
  EXPECT_LT(made.mesh.triangles.size(), 500'000u);
}

TEST(Surface, AVoxelTooFineIsRefusedByOneSentence) {
  EXPECT_THROW(surface(zoo_parts::binary_tree(3), {.voxel = 1e-4f}), LimitError);
}

}  // namespace
}  // namespace forest
