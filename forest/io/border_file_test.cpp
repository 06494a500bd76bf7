// SPDX-License-Identifier: Apache-2.0
#include "forest/io/border_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

using ::testing::HasSubstr;

std::string file(const std::string& vertices, const std::string& weights) {
  return R"(<?xml version="1.0"?><BorderFile Version="3" SurfaceNumberOfVertices="9"><Class Name="???"><Border Name="CS">)"
         R"(<BorderPart Closed="False"><Vertices>)" +
         vertices + "</Vertices><Weights>" + weights +
         "</Weights></BorderPart></Border></Class></BorderFile>";
}

TEST(BorderFile, ItsWeightsAreMadeToAddUpToOne) {
  const Borders read = read_borders(file("1 2 3\n4 5 8", "2 1 1\n0 .5 0"), "cs.border");
  EXPECT_EQ(read.surface_vertices, 9u);
  ASSERT_EQ(read.borders.size(), 1u);
  EXPECT_EQ(read.borders[0].name, "CS");
  ASSERT_EQ(read.borders[0].points.size(), 2u);
  EXPECT_THAT(read.borders[0].points[0].vertices, ::testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(read.borders[0].points[0].weights, ::testing::ElementsAre(.5, .25, .25));
  EXPECT_THAT(read.borders[0].points[1].weights, ::testing::ElementsAre(0., 1., 0.));
}

TEST(BorderFile, RefusesWhatCannotBe) {
  const auto refusal = [](const std::string& text) {
    return refused<InputError>([&] { (void)read_borders(text, "cs.border"); });
  };
  EXPECT_EQ(refusal(file("1 2 3", "1 1 1")), "");
  EXPECT_THAT(refusal(file("1 2 9", "1 1 1")), HasSubstr("names vertex 9, but its surface has 9"));
  EXPECT_THAT(refusal(file("1 2", "1 1")), HasSubstr("three each"));
  EXPECT_THAT(refusal(file("1 2 3", "1 1")), HasSubstr("three each"));
  EXPECT_THAT(refusal(file("1 2 3", "0 0 0")), HasSubstr("all 0"));
  EXPECT_THAT(refusal(file("1 2 3", "1 -1 3")), HasSubstr("not 0 or more"));
  EXPECT_THAT(refusal(file("1 2 3", "1 nan 3")), HasSubstr("not 0 or more"));
  EXPECT_THAT(refusal(file("1 x 3", "1 1 3")), HasSubstr("'x'"));
  EXPECT_THAT(refusal("<BorderFile SurfaceNumberOfVertices=\"9\"/>"), HasSubstr("has no borders"));
  EXPECT_THAT(refusal("<BorderFile/>"), HasSubstr("how many vertices"));
  EXPECT_THAT(refusal("<GIFTI/>"), HasSubstr("<BorderFile>"));
}

TEST(BorderFile, CutOffAnywhereIsRefused) {
  const std::string whole = file("1 2 3", "1 1 1");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(refused<InputError>([&] { (void)read_borders(whole.substr(0, size), "cs.border"); }), "")
        << size;
}

TEST(BorderFile, WhatIsWrittenIsReadAgain) {
  Borders written{9, {}};
  written.borders.push_back(
      {"a & b", {{{1, 2, 3}, {.5, .25, .25}}, {{4, 5, 8}, {0., 1., 0.}}}, "sulci", {1.f, .5f, 0.f}});
  written.borders.push_back({"ring", {{{0, 2, 3}, {1., 0., 0.}}}, "sulci", {0.f, .5f, 0.f}, true});
  written.borders.push_back({"crest", {{{0, 2, 3}, {1. / 3, 1. / 3, 1. / 3}}}, "crests"});
  written.borders.push_back({"trough", {{{0, 1, 3}, {1., 0., 0.}}}, "sulci", {1.f, .5f, 0.f}});
  written.structure = "CORTEX_RIGHT";
  const std::string text = write_borders(written);
  EXPECT_EQ(text.find("<Class Name=\"sulci\""),
            text.rfind("<Class Name=\"sulci\""));  // Workbench takes it once
  std::ranges::rotate(written.borders.begin() + 2, written.borders.end() - 1, written.borders.end());
  const Borders read = read_borders(text, "lh.border");
  EXPECT_EQ(read.surface_vertices, 9u);
  EXPECT_EQ(read.structure, "CORTEX_RIGHT");
  ASSERT_EQ(read.borders.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Border &a = written.borders[i], &b = read.borders[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.group, b.group);
    EXPECT_EQ(a.closed, b.closed);
    EXPECT_LT((a.colour - b.colour).norm(), 1e-6f);
    ASSERT_EQ(a.points.size(), b.points.size());
    for (std::size_t k = 0; k < a.points.size(); ++k) {
      EXPECT_EQ(a.points[k].vertices, b.points[k].vertices);
      for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(a.points[k].weights[j], b.points[k].weights[j], 1e-6);
    }
  }
  std::size_t groups = 0;
  for (std::size_t at = text.find("<Class"); at != text.npos; at = text.find("<Class", at + 1)) ++groups;
  EXPECT_EQ(groups, 2u);
}

TEST(BorderFile, DrawnSulciAreRead) {
  FOREST_REAL_DATA(folder, "cortex/fs_LR_left");
  std::size_t points = 0;
  for (const auto& path : files_below(folder, ".border")) {
    const Borders read = read_borders(MappedFile(path).text(), path.string());
    EXPECT_EQ(read.surface_vertices, 32492u);
    ASSERT_EQ(read.borders.size(), 1u);
    points += read.borders[0].points.size();
  }
  EXPECT_EQ(points, 67u);
}

}  // namespace
}  // namespace forest::io
