// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nts.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

/// A file of these records: code, tag, x, y, z, thickness.
struct Row {
  std::string_view code;
  int tag;
  float x, y, z, thick;
};

std::string file(const std::vector<Row>& rows, std::size_t trees = 1) {
  std::string text =
      fmt::format("No. points {:6}\r\nNo. trees  {:6}\r\nText  unassigned\r\n \r\n Point  Type  Tag\r\n\r\n",
                  rows.size(), trees);
  std::size_t number = 0;
  for (const Row& r : rows)
    text += fmt::format("{:6}  {:>3}{:5}{:8.1f}{:8.1f}{:8.1f}{:6.1f}\r\n", ++number, r.code, r.tag, r.x, r.y,
                        r.z, r.thick);
  return text;
}

ReadResult cell(const std::vector<Row>& rows, std::size_t trees = 1) {
  return read_nts(file(rows, trees), "cell.nts");
}

TEST(Nts, TheOrderOfRecordsIsTheTree) {
  const auto [m, warnings] = cell({{"MTO", 4, 0, 5, 0, 4},
                                   {"CP", 4, 0, 10, 0, 3},
                                   {"BP", 4, 0, 15, 0, 2},
                                   {"CP", 4, 3, 19, 0, 1},
                                   {"BP", 4, 3, 24, 0, 1},
                                   {"NE", 4, 3, 25, 0, 1},
                                   {"NE", 4, 4, 24, 0, 1},
                                   {"NE", 4, -3, 19, 0, 1}});
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(m.sections().size(), 5u);
  const std::vector<int> parents{-1, 0, 1, 1, 0};
  for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(m.sections()[i].parent, SectionId(std::size_t(parents[i])));
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::apical);
  EXPECT_EQ(m.points(SectionId(4))[0], (Point{0, 15, 0, .5f}));  // the daughter's own thickness
  EXPECT_DOUBLE_EQ(total_length(m), 10. + 10. + 1. + 1. + 5.);
}

TEST(Nts, SuccessiveBranchPointsAtOnePlaceAreOneNode) {
  const Morphology m = cell({{"MTO", 0, 0, 0, 0, 1},
                             {"BP", 0, 0, 9, 0, 1},
                             {"BP", 0, 0, 9, 0, 1},
                             {"BP", 0, 0, 9, 0, 1},
                             {"NE", 0, 1, 9, 0, 1},
                             {"NE", 0, 2, 9, 0, 1},
                             {"BP", 0, 0, 9, 0, 1},  // and once more on coming back
                             {"NE", 0, 3, 9, 0, 1},
                             {"NE", 0, 4, 9, 0, 1},
                             {"NE", 0, 5, 9, 0, 1}})
                           .morphology;
  EXPECT_EQ(m.children(SectionId(0)).size(), 5u);
  EXPECT_DOUBLE_EQ(total_length(m), 9. + 1. + 2. + 3. + 4. + 5.);
}

TEST(Nts, PiecesOfUnmergedSlicesAreRootsOfTheirOwn) {
  const auto [m, warnings] = cell({{"MTO", 3, 0, 0, 0, 1},
                                   {"TAE", 3, 0, 10, 0, 1},
                                   {"BTO", 3, 0, 11, 9, 1},
                                   {"NE", 3, 0, 20, 9, 1},
                                   {"TTO", 3, 5, 0, 0, 1},
                                   {"MAE", 3, 5, 10, 0, 1}},
                                  3);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(m.roots().size(), 3u);
  EXPECT_DOUBLE_EQ(total_length(m), 29.);
  EXPECT_EQ(m.annotations(), (Annotations{{"eutectic", "TAE 0 10 0"},
                                          {"eutectic", "BTO 0 11 9"},
                                          {"eutectic", "TTO 5 0 0"},
                                          {"eutectic", "MAE 5 10 0"}}));
}

TEST(Nts, OutlinesOfTheSomaAreAStackAndSpineBasesSpines) {
  const Morphology m = cell({{"SOS", 0, 5, 0, 0, 0},
                             {"SCP", 0, 0, 5, 0, 0},
                             {"SOE", 0, -5, 0, 0, 0},
                             {"SOS", 0, 4, 0, 2, 0},
                             {"SCP", 0, 0, 4, 2, 0},
                             {"SOE", 0, -4, 0, 2, 0},
                             {"MTO", 0, 0, 5, 0, 1},
                             {"SB", 0, 0, 15, 0, 1},
                             {"NE", 0, 0, 25, 0, 1}})
                           .morphology;
  EXPECT_EQ(m.soma().kind, SomaKind::contours);
  EXPECT_EQ(m.soma().contour_starts, (std::vector<std::uint32_t>{0, 3}));
  ASSERT_EQ(m.spines().size(), 1u);
  EXPECT_EQ(m.spines()[0].position, 10.f);
  EXPECT_EQ(m.points().size(), 3u);
}

TEST(Nts, OtherCodesAndNamesAreWrittenAgain) {
  std::string text = file({{"MTO", 0, 0, 0, 0, 1}, {"FS", 0, 0, 5, 0, 3}, {"ES", 0, 0, 9, 0, 3}});
  text.insert(text.find("1.0\r\n") + 3, "  15rc01  soma       7");
  text +=
      "     4   OS    0     1.0     2.0     3.0    .5\n     5  OCP    0     2.0     2.0     3.0    .5\n"
      "     6   DS    0    -1.5     2.0     3.0    .5\n";
  const Morphology m = read_nts("by hand\n" + text, "cell.nts").morphology;
  const Annotations expected{
      {"comment", "by hand"},   {"eutectic", "MTO 15rc01 soma 7 0 0 0"}, {"eutectic", "FS 0 5 0"},
      {"eutectic", "ES 0 9 0"}, {"outline", "1 2 3 0.5; 2 2 3 0.5"},     {"dots", "-1.5 2 3 0.5"}};
  EXPECT_EQ(m.annotations(), expected);
  const std::string written = write_nts(m);
  for (const std::string_view part :
       {"   1.0  15rc01  soma       7\n", "   FS    0      .0     5.0      .0   3.0\n",
        "   ES    0      .0     9.0      .0   3.0\n", "   OE    0     2.0     2.0     3.0    .5\n"})
    EXPECT_NE(written.find(part), written.npos) << part << written;
  EXPECT_TRUE(std::ranges::is_permutation(read_nts(written, "again").morphology.annotations(), expected));
}

TEST(Nts, FieldsMayTouchAndColumnsMayBeLost) {
  const Morphology touching =
      read_nts(
          "     1  MTO   19-12345.6-99999.9 12345.6 999.9\n     2   NE   19-12345.6-99989.9 12345.61234.5\n",
          "cell")
          .morphology;
  EXPECT_EQ(touching.points()[0], (Point{-12345.6f, -99999.9f, 12345.6f, .5f * 999.9f}));
  EXPECT_EQ(touching.points()[1].radius, .5f * 1234.5f);
  EXPECT_EQ(touching.section(SectionId(0)).tag, 19);
  const auto [parted, warnings] = read_nts("No. points 2\n1 MTO 3 0 0 0 1\n2 ne 3 0 10 0 1\n", "cell");
  EXPECT_DOUBLE_EQ(total_length(parted), 10.);
  EXPECT_EQ(parted.section(SectionId(0)).kind, SectionKind::basal);
}

TEST(Nts, EveryDeviationIsToldAndRead) {
  const std::vector<Row> stem{{"MTO", 0, 0, 0, 0, 1}, {"NE", 0, 0, 10, 0, 1}};
  const auto with = [&](std::vector<Row> more) {
    more.insert(more.begin(), stem.begin(), stem.end());
    return more;
  };
  struct Deviation {
    std::string_view code;
    std::size_t line;
    std::string text;
    double length;
  };
  const std::vector<Deviation> table{
      {"columns", 2, "No. points 2\n1 MTO 0 0 0 0 1\n2 NE 0 0 10 0 1\n", 10.},
      {"no-header", 1, file(stem).substr(file(stem).find("     1  MTO")), 10.},
      {"byte-order-mark", 1, "\xef\xbb\xbf" + file(stem), 10.},
      {"point-count", 0, "No. points 3\n" + file(stem).substr(file(stem).find("     1  MTO")), 10.},
      {"tree-count", 0, file(stem, 2), 10.},
      {"late-comment", 9, file(stem) + "the end\n", 10.},
      {"second-header", 9, file(stem) + file(stem), 20.},
      {"small-letters", 8, file({stem[0], {"ne", 0, 0, 10, 0, 1}}), 10.},
      {"unknown-code", 8, file({stem[0], {"XP", 0, 0, 5, 0, 1}, {"NE", 0, 0, 10, 0, 1}}), 10.},
      {"negative-diameter", 8, file({stem[0], {"NE", 0, 0, 10, 0, -1}}), 10.},
      {"tag-change", 8, file({stem[0], {"NE", 7, 0, 10, 0, 1}}), 10.},
      {"point-without-origin", 9, file(with({{"CP", 0, 5, 0, 0, 1}, {"NE", 0, 5, 5, 0, 1}}), 2), 15.},
      {"origin-alone", 9, file(with({{"MTO", 0, 5, 0, 0, 1}}), 2), 10.},
      {"unfinished-branch", 8, file({stem[0], {"CP", 0, 0, 10, 0, 1}}), 10.},
      {"open-branches", 9, file({stem[0], {"BP", 0, 0, 10, 0, 1}, {"NE", 0, 0, 15, 0, 1}}), 15.},
      {"outline-without-start", 9, file(with({{"OCP", 0, 0, 0, 0, 0}})), 10.},
      {"several-outlines", 12,
       file(with(
           {{"SOS", 0, 0, 0, 0, 0}, {"SCP", 0, 1, 0, 0, 0}, {"SOE", 0, 1, 1, 0, 0}, {"SOS", 0, 0, 0, 1, 0}})),
       10.},
      {"small-outline", 0, file(with({{"SOS", 0, 0, 0, 0, 0}})), 10.},
  };
  std::set<std::string_view> seen;
  for (const Deviation& row : table) {
    SCOPED_TRACE(row.text);
    const auto [m, warnings] = read_nts(row.text, "cell.nts");
    const auto told = std::ranges::find(warnings, row.code, &Warning::code);
    ASSERT_NE(told, warnings.end());
    EXPECT_EQ(told->line, row.line);
    EXPECT_EQ(warnings.size(), 1u);
    EXPECT_DOUBLE_EQ(total_length(m), row.length);
    seen.insert(row.code);
  }
  const std::string page(MappedFile(FOREST_SOURCE_DIR "/docs/formats/nts.md").text());
  for (const Oddity& row : nts_oddities()) {
    EXPECT_TRUE(seen.contains(row.code)) << row.code << " has no test";
    EXPECT_NE(page.find(fmt::format("`{}`", row.code)), page.npos) << row.code << " is not documented";
  }
}

TEST(Nts, WhatCannotBeReadIsRefusedWithItsLine) {
  struct Refused {
    std::string text;
    std::size_t line;
    std::string_view says;
  };
  const std::vector<Refused> table{
      {"No. points 1\n\n     1  MTO    0      .0      x0\n", 3, "no record"},
      {"     1  MTO    0      .0      .0      .0\n", 1, "columns"},
      {"     1  MTO    0 nan .0 .0 .1\n", 1, "outside"},
      {"     1  MTO    0 0 1e9 .0 .1\n", 1, "outside"},
      {"     1  MTO    1000000 0 0 0 .1\n", 1, "tag"},
      {"hello\n", 0, "no point"},
      {"\xff\xfe", 1, "UTF-16"},
  };
  for (const Refused& row : table) {
    SCOPED_TRACE(row.text);
    try {
      read_nts(row.text, "cell.nts");
      ADD_FAILURE() << "was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), row.line);
      EXPECT_NE(error.sentence().find(row.says), std::string::npos) << error.sentence();
    }
  }
}

TEST(Nts, WhatIsTooLargeForTheColumnsIsNotWritten) {
  const auto neuron = [](Point end) {
    MorphologyBuilder b;
    b.add_section({}, SectionKind::axon, std::vector<Point>{{0, 0, 0, 1}, end});
    return b.build();
  };
  EXPECT_NO_THROW(write_nts(neuron({-99999.9f, 0, 0, .5f * 9999.9f})));
  EXPECT_THROW(write_nts(neuron({0, 100000.f, 0, 1})), LimitError);
  EXPECT_THROW(write_nts(neuron({0, 0, 0, 5000})), LimitError);
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, std::vector<Point>(1000000));
  EXPECT_THROW(write_nts(b.build()), LimitError);
}

TEST(Nts, AHundredThousandOpenBranchesAreReadAndWritten) {
  constexpr int levels = 100000;
  std::vector<Row> rows{{"MTO", 0, 0, 0, 0, 1}};
  for (int i = 0; i < levels; ++i) rows.push_back({"BP", 0, float(i % 2), 1, 0, 1});
  for (int i = 0; i <= levels; ++i) rows.push_back({"NE", 0, 5, 5, 0, 1});
  const Morphology m = cell(rows).morphology;
  EXPECT_EQ(m.sections().size(), 2u * levels + 1);
  EXPECT_TRUE(std::ranges::equal(read_nts(write_nts(m), "again").morphology.sections(), m.sections()));
}

TEST(Nts, SpinesBetweenPointsGetAPointOfTheirOwn) {
  MorphologyBuilder b;
  const auto stem = b.add_section({}, SectionKind::apical,
                                  std::vector<Point>{{0, 0, 0, 1}, {0, 10, 0, .5f}, {0, 20, 0, .5f}});
  b.add_section(stem, SectionKind::apical, std::vector<Point>{{0, 30, 0, .5f}});
  b.add_section(stem, SectionKind::apical, std::vector<Point>{{5, 20, 0, .5f}});
  for (const float position : {-1.f, 4.f, 10.f, 10.01f, 99.f})
    b.add_spine({.section = stem, .position = position});
  b.add_spine({.section = SectionId(2), .position = 2.5f});
  const Morphology read = read_nts(write_nts(b.build()), "spines").morphology;
  ASSERT_EQ(read.spines().size(), 6u);
  const std::vector<float> positions{0, 4, 10, 10, 20, 2.5f};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(read.spines()[i].position, positions[i], .06f);
  EXPECT_DOUBLE_EQ(total_length(read), 35.);
}

TEST(Nts, IsRecognisedWhateverTheExtension) {
  EXPECT_TRUE(recognises_nts(file({{"MTO", 0, 0, 0, 0, 1}})));
  EXPECT_TRUE(recognises_nts("     1  MTO    0      .0      .0      .0    .6\n"));
  EXPECT_EQ(format_of("cell.ca1", file({{"MTO", 0, 0, 0, 0, 1}})).name, "nts");
  for (const std::string_view text : {"", "1 1 0 0 0 1 -1\n", "((Axon) (0 0 0 1))", "<mbf>"})
    EXPECT_FALSE(recognises_nts(text));
}

TEST(NtsRealData, TheTracedNeuronIsReadAndSurvivesExport) {
  FOREST_REAL_DATA(folder, "eutectic");
  std::size_t neurons = 0;
  for (const auto& path : files_below(folder, ".nts")) {
    SCOPED_TRACE(path.string());
    const auto [m, warnings] = read(path);
    EXPECT_TRUE(warnings.empty());
    EXPECT_TRUE(losses(m, nts_keeps).empty());
    const std::string bytes = write_nts(m);
    const Morphology again = read_nts(bytes, "again").morphology;
    EXPECT_TRUE(again == m);
    EXPECT_TRUE(std::ranges::is_permutation(again.annotations(), m.annotations()));
    EXPECT_EQ(write_nts(again), bytes);
    for (std::size_t i = 0; i < m.sections().size(); ++i) EXPECT_NE(m.children(SectionId(i)).size(), 1u);
    // Record by record what was traced, line ends and blanks behind aside.
    const auto records = [](std::string_view text) {
      std::vector<std::string> lines;
      while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size() - 1);
        std::string line(text.substr(0, end));
        line.erase(line.find_last_not_of(" \r") + 1);
        if (line.starts_with("  ")) lines.push_back(line);
        text.remove_prefix(end + 1);
      }
      return lines;
    };
    EXPECT_EQ(records(bytes), records(MappedFile(path).text()));
    ++neurons;
  }
  EXPECT_GE(neurons, 1u);
}

TEST(NtsRealData, EveryTracedNeuronOfOtherFormatsComesBackToItsStep) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  std::size_t neurons = 0;
  for (const auto& path : files_below(folder, ".swc")) {
    if (++neurons % 5) continue;
    SCOPED_TRACE(path.string());
    const Morphology m = read(path).morphology, left = as_kept(m, nts_keeps);
    if (m.bounds().high.maxCoeff() > 90000.f) {  // in nm
      EXPECT_THROW(write_nts(m), LimitError);
      continue;
    }
    const std::string bytes = write_nts(m);
    const Morphology again = read_nts(bytes, "again").morphology;
    ASSERT_TRUE(std::ranges::equal(again.sections(), left.sections(), [](const Section& a, const Section& b) {
      return a.parent == b.parent && a.kind == b.kind && a.tag == b.tag;
    }));
    EXPECT_NEAR(total_length(again), total_length(left), 1e-6 * total_length(left));
    EXPECT_NEAR(total_area(again), total_area(left), 1e-6 * total_area(left));
    EXPECT_EQ(write_nts(again), bytes);
  }
  EXPECT_GT(neurons, 100u);
}

}  // namespace
}  // namespace forest::io
