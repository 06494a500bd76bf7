// SPDX-License-Identifier: Apache-2.0
#include "forest/io/swc.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/numbers.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

TEST(Swc, ReadsSomaStemAndBranches) {
  const auto [m, warnings] = read_swc(
      "# CREATURE rat\n1 1 0 0 0 5 -1\n2 4 0 5 0 1 1\n3 4 0 15 0 .5 2\n4 4 3 19 0 .5 3\n5 4 -3 19 0 .5 3\n",
      "cell.swc");
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(m.soma().kind, SomaKind::sphere);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.section(SectionId(0)).soma_point, 0);
  EXPECT_EQ(m.section(SectionId(2)).kind, SectionKind::apical);
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  EXPECT_EQ(m.annotations(), (Annotations{{"CREATURE", "rat"}}));
}

// A deviation from INCF v1: a file that has it, where it is told, and what is read. The same cell as often as possible:
// a soma of radius 5 and a stem of 10 µm that divides into two daughters of 5 µm.
struct Dialect {
  std::string_view code;
  std::size_t line;
  std::string text;
  void (*check)(const Morphology& m);
};

void is_the_cell(const Morphology& m) {
  EXPECT_EQ(m.soma().kind, SomaKind::sphere);
  EXPECT_FLOAT_EQ(m.soma().sphere().radius, 5.f);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.children(SectionId(0)).size(), 2u);
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::basal);
  EXPECT_NEAR(section_length(m, SectionId(0)), 10., 1e-6);
  EXPECT_NEAR(total_length(m), 20., 1e-6);
}
void has_one_section(const Morphology& m) { EXPECT_EQ(m.sections().size(), 1u); }
void is_a_sphere(const Morphology& m) { EXPECT_EQ(m.soma().kind, SomaKind::sphere); }
void is_cylinders(const Morphology& m) { EXPECT_EQ(m.soma().kind, SomaKind::cylinders); }

std::string repeated(std::size_t count, const std::function<std::string(std::size_t)>& row) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += row(i);
  return text;
}

const std::vector<Dialect>& dialects() {
  static const std::string cell =
      "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n";
  static const std::vector<Dialect> table{
      {"byte-order-mark", 1, "\xef\xbb\xbf" + cell, is_the_cell},
      {"line-ends", 1,
       "1 1 0 0 0 5 -1\r\n2 3 0 5 0 1 1\r\n3 3 0 15 0 1 2\r\n4 3 3 19 0 1 3\r\n5 3 -3 19 0 1 3\r\n",
       is_the_cell},
      {"line-ends", 1, "1 1 0 0 0 5 -1\r2 3 0 5 0 1 1\r3 3 0 15 0 1 2\r4 3 3 19 0 1 3\r5 3 -3 19 0 1 3",
       is_the_cell},
      {"text-header", 1, "n type x y z radius parent\n" + cell, is_the_cell},
      {"blank-line", 2,
       "1 1 0 0 0 5 -1\n  \n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n\n", is_the_cell},
      {"late-comment", 2,
       "1 1 0 0 0 5 -1\n# dendrite\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"padding", 0, cell + "\x1a", is_the_cell},
      {"trailing-text", 6, cell + "end of file\n", is_the_cell},
      {"typography", 1,
       "\"1\" 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3\xc2\xa0"
       "3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 \xe2\x88\x92"
       "3 19 0 1 3\n",
       is_the_cell},
      {"commas", 1, "1;1;0;0;0;5;-1\n2;3;0;5;0;1;1\n3;3;0;15;0;1;2\n4;3;3;19;0;1;3\n5;3;-3;19;0;1;3\n",
       is_the_cell},
      {"trailing-comment", 2,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1 # stem\n3 3 0 15 0 1 2#x\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"tabs", 1,
       "1\t1\t0\t0\t0\t5\t-1\n2\t3\t0\t5\t0\t1\t1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"commas", 1, "1,1,0,0,0,5,-1\n2, 3, 0, 5, 0, 1, 1\n3,3,0,15,0,1,2\n4,3,3,19,0,1,3\n5,3,-3,19,0,1,3\n",
       is_the_cell},
      {"decimal-commas", 2,
       "1 1 0 0 0 5 -1\n2 3 0,0 5,0 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"extra-columns", 1,
       "1 1 0 0 0 5 -1 0 1\n2 3 0 5 0 1 1 7 8 9\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"decimal-integer", 2,
       "1 1 0 0 0 5 -1\n2.0 3.0 0 5 0 1 1.0\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"exponent", 1,
       "1 1 0 0 0 5e0 -1\n2 3 0 5 0 1 1\n3 3 0 1.5E+1 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"unknown-radius", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 2 1\n3 3 0 15 0 NaN 2\n4 3 3 19 0 NA 3\n5 3 -3 19 0 1 3\n",
       [](const Morphology& m) {
         is_the_cell(m);
         EXPECT_EQ(m.points(SectionId(0))[1].radius, 2.f);
         EXPECT_EQ(m.points(SectionId(1))[1].radius, 2.f);
       }},
      {"unknown-radius", 2,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 NaN 1\n3 3 0 15 0 NaN 2\n4 3 3 19 0 NA 3\n5 3 -3 19 0 1 3\n",
       [](const Morphology& m) {  // not the soma's 5
         is_the_cell(m);
         for (const Point& p : m.points()) EXPECT_EQ(p.radius, 1.f);
       }},
      {"negative-radius", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 2 1\n3 3 0 15 0 -1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       [](const Morphology& m) {
         is_the_cell(m);
         EXPECT_EQ(m.points(SectionId(0))[1].radius, 2.f);
       }},
      {"zero-radius", 3, "1 1 0 0 0 5 -1\n2 3 0 5 0 2 1\n3 3 0 15 0 0 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       [](const Morphology& m) {
         is_the_cell(m);
         EXPECT_EQ(m.points(SectionId(0))[1].radius, 0.f);
       }},
      {"unknown-place", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 nan 15 inf 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"unknown-place", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 1e400 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"precision", 4,
       "1 1 50000000 0 0 5 -1\n2 3 50000008 0 0 1 1\n3 3 50000016 0 0 1 2\n4 3 50000017 0 0 1 3\n",
       has_one_section},
      {"precision", 4,
       "1 1 0 -200000 0 5 -1\n2 3 0 -200000.05 0 1 1\n3 3 0 -200000.1 0 1 2\n4 3 0 -200000.095 +0 1 3\n",
       has_one_section},
      {"first-id", 1, "0 1 0 0 0 5 -1\n1 3 0 5 0 1 0\n2 3 0 15 0 1 1\n3 3 3 19 0 1 2\n4 3 -3 19 0 1 2\n",
       is_the_cell},
      {"id-order", 3, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n7 3 0 15 0 1 2\n4 3 3 19 0 1 7\n5 3 -3 19 0 1 7\n",
       is_the_cell},
      {"id-order", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n2147483647 3 0 15 0 1 2\n9007199254740991 3 3 19 0 1 2147483647\n5 3 "
       "-3 19 0 1 2147483647\n",
       is_the_cell},
      {"negative-id", 2, "1 1 0 0 0 5 -1\n-2 3 0 5 0 1 1\n3 3 0 15 0 1 -2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"repeated-row", 3,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"duplicate-id", 4, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n3 3 3 19 0 1 3\n5 3 3 19 0 1 3\n",
       [](const Morphology& m) {  // the second row 3 hangs on the first, and row 5 on the second
         EXPECT_EQ(m.sections().size(), 1u);
         EXPECT_NEAR(total_length(m), 15., 1e-6);
       }},
      {"child-first", 2, "1 1 0 0 0 5 -1\n2 3 3 19 0 1 4\n3 3 -3 19 0 1 4\n4 3 0 15 0 1 5\n5 3 0 5 0 1 1\n",
       is_the_cell},
      {"root-marker", 1, "1 1 0 0 0 5 0\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"root-marker", 1, "1 1 0 0 0 5 -2\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"self-parent", 1, "1 1 0 0 0 5 1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       is_the_cell},
      {"missing-parent", 2,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 17\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n",
       [](const Morphology& m) {
         is_the_cell(m);
         EXPECT_EQ(m.section(SectionId(0)).soma_point, -1);
       }},
      {"several-roots", 2,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 -1\n3 3 0 15 0 1 2\n4 3 3 19 0 1 3\n5 3 -3 19 0 1 3\n", is_the_cell},
      {"several-roots", 3, "1 3 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 -1\n",
       [](const Morphology& m) { EXPECT_EQ(m.roots().size(), 2u); }},
      {"type-undefined", 2, "1 1 0 0 0 5 -1\n2 0 0 5 0 1 1\n",
       [](const Morphology& m) { EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::undefined); }},
      {"type-custom", 2, "1 1 0 0 0 5 -1\n2 20 0 5 0 1 1\n",
       [](const Morphology& m) {
         EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::custom);
         EXPECT_EQ(m.section(SectionId(0)).tag, 20);
       }},
      {"type-negative", 2, "1 1 0 0 0 5 -1\n2 -5 0 5 0 1 1\n",
       [](const Morphology& m) { EXPECT_EQ(m.section(SectionId(0)).tag, -5); }},
      {"type-change", 4, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 15 0 1 2\n4 2 3 19 0 1 3\n5 2 3 29 0 1 4\n",
       [](const Morphology& m) {
         ASSERT_EQ(m.sections().size(), 2u);
         EXPECT_EQ(m.section(SectionId(1)).kind, SectionKind::axon);
         EXPECT_NEAR(section_length(m, SectionId(1)), 15., 1e-6);
       }},
      {"cnic-types", 0, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 5 0 15 0 1 2\n4 6 3 19 0 1 3\n5 6 -3 19 0 1 3\n",
       is_the_cell},
      {"soma-under-neurite", 5,
       "1 3 3 19 0 1 -1\n2 3 0 15 0 1 1\n3 3 -3 19 0 1 2\n4 3 0 5 0 1 2\n5 1 0 0 0 5 4\n", is_the_cell},
      {"soma-inside-neurite", 4,
       "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 10 0 1 2\n4 1 0 15 0 1 3\n5 3 3 19 0 1 4\n6 3 -3 19 0 1 4\n",
       is_the_cell},
      {"several-somata", 3, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 1 8 0 0 5 -1\n4 3 8 5 0 1 3\n",
       [](const Morphology& m) {
         EXPECT_EQ(m.soma().points.size(), 2u);
         EXPECT_EQ(m.section(SectionId(1)).soma_point, 1);
       }},
      {"soma-three-points-turned", 2, "1 1 7 0 0 5 -1\n2 1 12 0 0 5 1\n3 1 2 0 0 5 1\n", is_a_sphere},
      {"soma-three-points-inexact", 2, "1 1 0 0 0 5 -1\n2 1 0 -5.2 0 5 1\n3 1 0 5.2 0 5 1\n", is_a_sphere},
      {"soma-three-points-off", 2, "1 1 0 0 0 5 -1\n2 1 0 -9 0 5 1\n3 1 0 9 0 5 1\n", is_cylinders},
      {"soma-three-points-attachment", 4, "1 1 0 0 0 5 -1\n2 1 0 -5 0 5 1\n3 1 0 5 0 5 1\n4 3 0 -6 0 1 2\n",
       [](const Morphology& m) { EXPECT_EQ(m.section(SectionId(0)).soma_point, 0); }},
      {"soma-contour", 1,
       "1 1 -10 10 0 .1 -1\n2 1 10 10 0 .1 1\n3 1 10 -10 0 .1 2\n4 1 -10 -10 0 .1 3\n5 1 -10 10 0 .1 4\n",
       [](const Morphology& m) {
         EXPECT_EQ(m.soma().kind, SomaKind::contours);
         EXPECT_EQ(m.soma().contour_starts.size(), 1u);
       }},
      {"soma-branches", 1, "1 1 0 0 0 5 -1\n2 1 0 4 0 4 1\n3 1 0 8 0 2 2\n4 1 4 4 0 2 2\n", is_cylinders},
      {"all-soma", 1,
       repeated(150,
                [](std::size_t i) {
                  return fmt::format("{0} 1 {0} {1} 0 1 {2}\n", i + 1, i % 2,
                                     i < 2 ? int(i) - (i == 0) : int(i) - 1);
                }),
       [](const Morphology& m) {
         EXPECT_EQ(m.soma().kind, SomaKind::sphere);
         EXPECT_EQ(m.sections().size(), 2u);
       }},
      {"units", 0, "1 1 0 0 0 5000 -1\n2 3 0 5000 0 1000 1\n", has_one_section},
      {"units", 0,
       "1 1 0 0 0 .005 -1\n" + repeated(30,
                                        [](std::size_t i) {
                                          return fmt::format("{} 3 0 .{:02} 0 .001 {}\n", i + 2, i + 1,
                                                             i + 1);
                                        }),
       has_one_section},
  };
  return table;
}

TEST(Swc, EachDialectIsReadAndToldWithItsLine) {
  for (const Dialect& dialect : dialects()) {
    SCOPED_TRACE(dialect.text.substr(0, 300));
    const auto [m, warnings] = read_swc(dialect.text, "cell.swc");
    dialect.check(m);
    const auto told = std::ranges::find(warnings, dialect.code, &Warning::code);
    ASSERT_NE(told, warnings.end()) << dialect.code;
    EXPECT_EQ(told->line, dialect.line) << told->sentence;
  }
}

TEST(Swc, ZeroRadiiAreToldOfAllButOutlines) {
  std::string loop;
  for (int i = 1; i <= 8; ++i)
    loop += fmt::format("{} 1 {} {} 0 0 {}\n", i, 9. * std::cos(.8 * i), 9. * std::sin(.8 * i),
                        i > 1 ? i - 1 : -1);
  const auto told = [](const std::string& text) {
    const auto warnings = read_swc(text, "cell.swc").warnings;
    return std::ranges::count(warnings, "zero-radius", &Warning::code);
  };
  EXPECT_EQ(told(loop), 0);
  EXPECT_EQ(told(loop + "9 3 0 20 0 0 1\n10 3 0 30 0 0 9\n"), 2);
  EXPECT_EQ(told("1 1 0 0 0 0 -1\n2 3 0 5 0 1 1\n3 3 0 9 0 1 2\n"), 1);
}

TEST(Swc, EachDialectIsTriedAndDocumented) {
  const MappedFile page(FOREST_SOURCE_DIR "/docs/formats/swc.md");
  std::set<std::string_view> tried;
  for (const Dialect& dialect : dialects()) tried.insert(dialect.code);
  std::set<std::string_view> codes;
  for (const Oddity& oddity : swc_oddities()) {
    EXPECT_TRUE(codes.insert(oddity.code).second) << oddity.code;
    EXPECT_TRUE(tried.contains(oddity.code)) << oddity.code;
    EXPECT_NE(page.text().find(fmt::format("| `{}` |", oddity.code)), std::string_view::npos) << oddity.code;
  }
}

TEST(Swc, AFileOfTheStandardHasNoWarning) {
  for (const char* text :
       {"1 1 0 0 0 5 -1", "# x\n\n1 1 0 0 0 5 -1\n 2  3 0  5 0 1  1 \n",
        "1 1 0 0 0 5 -1\n2 1 0 -5 0 5 1\n3 1 0 5 0 5 1\n4 2 0 6 0 1 1\n5 7 0 -6 0 1 1\n6 12 0 -8 0 1 1\n",
        "1 1 0 0 0 5 -1\n2 1 0 4 0 4 1\n3 1 0 7 0 2 2\n4 1 0 9 0 1 3\n", "1 3 0 0 0 1 -1\n2 3 0 1 0 1 1\n"})
    for (const Warning& warning : read_swc(text, "cell.swc").warnings) ADD_FAILURE() << warning.sentence;
}

struct Bad {
  std::size_t line;
  std::string_view text, part_of_sentence;
};

TEST(Swc, WhatCannotBeReadSaysWhereAndWhatToDo) {
  const std::vector<Bad> table{
      {0, "# only a comment\n", "a row of SWC is"},
      {2, "1 1 0 0 0 5 -1\n2 3 0 abc 0 1 1\n", "column 4 (y) is \"abc\", not a number"},
      {2, "1 1 0 0 0 5 -1\n2 3 0 5 0 1\n", "6 of 7 columns"},
      {2, "1 1 0 0 0 5 -1\n2.5 3 0 5 0 1 1\n", "not a whole number"},
      {2, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1e30\n", "beyond 9000000000000000"},
      {2, "1 1 0 0 0 5 -1\n2 3000000000 0 5 0 1 1\n", "type"},
      {2, "1 1 0 0 0 5 -1\n<html>\n2 3 0 5 0 1 1\n", "1 of 7 columns"},
      {3, "1 1 0 0 0 5 -1\n2 3 0 5 0 1 1\n3 3 0 6 0 1 4\n4 3 0 7 0 1 5\n5 3 0 8 0 1 3\n", "3 -> 4 -> 5 -> 3"},
      {1, "1 3 nan 0 0 1 -1\n", "no place"},
      {1, "\xff\xfe\x31\x00", "UTF-16"},
  };
  for (const Bad& bad : table) {
    try {
      read_swc(bad.text, "cell.swc");
      ADD_FAILURE() << bad.text;
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), bad.line) << bad.text;
      EXPECT_NE(error.sentence().find(bad.part_of_sentence), std::string::npos) << error.what();
    }
  }
}

TEST(Swc, ALongListOfOneKindIsCounted) {
  const std::string text = "1 1 0 0 0 5 -1\n" + repeated(1000, [](std::size_t i) {
                             return fmt::format("{} 3 0 {} 0 -1 {}\n", i + 2, i, i + 1);
                           });
  const auto warnings = read_swc(text, "cell.swc").warnings;
  ASSERT_EQ(warnings.size(), 21u);
  EXPECT_EQ(warnings.back().line, 1001u);
  EXPECT_NE(warnings.back().sentence.find("980 more"), std::string::npos);
}

TEST(Swc, TheOrderOfRowsAndTheIdsDoNotMatter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Morphology tree = zoo_parts::random_tree(seed, 40);
    const std::string text = write_swc(tree);
    std::vector<std::string> rows;  // without the header line, so that nothing is read to the letter
    for (std::size_t begin = text.find('\n') + 1; begin < text.size();) {
      const std::size_t end = text.find('\n', begin);
      if (text[begin] != '#') rows.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
    Random random(seed, 1);
    std::vector<std::int64_t> ids(rows.size() + 1);
    for (std::size_t i = 1; i < ids.size(); ++i) ids[i] = std::int64_t(i) * (seed % 2 ? 3 : 1000000007) + 11;
    for (std::size_t i = rows.size(); i > 1; --i)
      std::swap(rows[i - 1], rows[random.below(std::uint32_t(i))]);
    std::string shuffled;
    for (const std::string& row : rows) {
      const std::size_t first = row.find(' '), last = row.rfind(' ');
      const long parent = std::stol(row.substr(last));
      shuffled += fmt::format("{}{} {}\n", ids[std::size_t(std::stol(row))], row.substr(first, last - first),
                              parent < 0 ? -1 : ids[std::size_t(parent)]);
    }
    const Morphology read = read_swc(shuffled, "shuffled").morphology,
                     straight = read_swc(text, "straight").morphology;
    // Sections without a node of one daughter in the shuffled file: there that is no node.
    EXPECT_NEAR(total_length(read), total_length(straight), 1e-6 * total_length(straight));
    EXPECT_NEAR(total_area(read), total_area(straight), 1e-6 * total_area(straight));
    EXPECT_EQ(read.roots().size(), straight.roots().size());
    std::map<std::size_t, int> forks, forks_straight;  // how many branch points have how many daughters
    for (std::size_t i = 0; i < read.sections().size(); ++i) ++forks[read.children(SectionId(i)).size()];
    for (std::size_t i = 0; i < straight.sections().size(); ++i)
      ++forks_straight[straight.children(SectionId(i)).size()];
    forks.erase(1), forks_straight.erase(1);
    EXPECT_EQ(forks, forks_straight);
  }
}

TEST(Swc, WhatIsWrittenIsReadBackToTheLastBit) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology read = read_swc(write_swc(specimen.morphology), "cell.swc").morphology;
    EXPECT_TRUE(read.soma() == specimen.morphology.soma());
    EXPECT_TRUE(std::ranges::equal(read.points(), specimen.morphology.points()));
    EXPECT_TRUE(std::ranges::equal(read.sections(), specimen.morphology.sections()));
    EXPECT_TRUE(std::ranges::equal(read.spines(), specimen.morphology.spines()));
  }
}

TEST(Swc, WhatIsWrittenKeepsToTheStandard) {
  for (const Specimen& specimen : zoo()) {
    if (specimen.name.find("root") != std::string::npos || specimen.name.find("lost") != std::string::npos)
      continue;
    SCOPED_TRACE(specimen.name);
    for (const Warning& warning : read_swc(write_swc(specimen.morphology), "cell.swc").warnings)
      EXPECT_TRUE(warning.code.starts_with("type-") || warning.code == "zero-radius")  // that the neuron has
          << warning.sentence;
  }
}

TEST(Swc, RootsOfUnknownPlaceHangOnANearSomaOnly) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.add_section({}, SectionKind::basal, std::vector<Point>{{0, 6, 0, 1}, {0, 9, 0, 1}});
  b.add_section({}, SectionKind::axon, std::vector<Point>{{0, 600, 0, 1}, {0, 900, 0, 1}});
  const Morphology read = read_swc(write_swc(b.build()), "cell.swc").morphology;
  EXPECT_EQ(read.sections()[0].soma_point, 0);
  EXPECT_EQ(read.sections()[1].soma_point, -1);
}

TEST(Swc, CommentsAreKept) {
  const auto [m, warnings] = read_swc(
      "# ORIGINAL_SOURCE Neurolucida\n#CREATURE   rat F344\n# TYPE\n# free text\n#\n1 1 0 0 0 5 -1\n"
      "#start synapse\n#1 2 3 4 5 6 7 8 9\n2 3 4 5 6 7 8 9 10\n#end synapse\n",
      "cell.swc");
  EXPECT_EQ(m.annotations(), (Annotations{{"ORIGINAL_SOURCE", "Neurolucida"},
                                          {"CREATURE", "rat F344"},
                                          {"TYPE", ""},
                                          {"comment", "free text"},
                                          {"comment", ""},
                                          {"synapse", "1 2 3 4 5 6 7 8 9"},
                                          {"synapse", "2 3 4 5 6 7 8 9 10"}}));
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(read_swc(write_swc(m), "again").morphology.annotations(), m.annotations());
}

TEST(Swc, HugeIdsNeedNoHugeTable) {  // a table over them would have 32 GB
  const auto m =
      read_swc("1 1 0 0 0 5 -1\n2147483647 3 0 5 0 1 1\n9000000000000000 3 0 9 0 1 2147483647\n", "cell.swc")
          .morphology;
  EXPECT_DOUBLE_EQ(total_length(m), 4.);
}

TEST(Numbers, AreReadAsTheStandardLibraryReadsThem) {
  Random random(7, 0);
  std::size_t halfway = 0;
  for (int trial = 0; trial < 300000; ++trial) {
    std::string text;
    switch (trial % 4) {
      case 0:
        text = fmt::format("{:.{}f}", random.normal(0, 300), random.below(12));
        break;
      case 1:
        append_number(text, std::bit_cast<float>(random() & 0xff7fffff));
        break;
      case 2:
        text = fmt::format("{}.{:07}", random.below(40000000), random.below(10000000));
        break;
      default: {  // exactly half way between two floats, and one digit more
        const double half =
            std::ldexp(double(2 * (8388608u + random.below(8388608)) + 1), -int(random.below(20)));
        text = fmt::format("{:.{}f}{}", half, 20, trial % 8 < 4 ? "" : "1");
        ++halfway;
      }
    }
    float expected = 0.f, value = 0.f;
    std::from_chars(text.data(), text.data() + text.size(), expected);
    text += '\n';
    const char* p = text.data();
    bool exponent = false;
    ASSERT_TRUE(read_real(p, value, exponent)) << text;
    ASSERT_EQ(std::bit_cast<std::uint32_t>(value), std::bit_cast<std::uint32_t>(expected)) << text;
    ASSERT_EQ(*p, '\n');
  }
  EXPECT_GT(halfway, 0u);
}

void expect_round_trip(const Morphology& m, const std::string& name) {
  const std::string bytes = write_swc(m);
  const Morphology read = read_swc(bytes, name).morphology;
  ASSERT_EQ(read.sections().size(), m.sections().size()) << name;
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    ASSERT_EQ(read.sections()[i].parent, m.sections()[i].parent) << name;
    ASSERT_EQ(read.sections()[i].kind, m.sections()[i].kind) << name;
    ASSERT_EQ(read.sections()[i].tag, m.sections()[i].tag) << name;
  }
  EXPECT_TRUE(std::ranges::equal(read.points(), m.points())) << name;
  EXPECT_NEAR(total_length(read), total_length(m), 1e-6 * total_length(m)) << name;
  EXPECT_NEAR(total_area(read), total_area(m), 1e-6 * total_area(m)) << name;
  EXPECT_TRUE(read.soma() == m.soma()) << name;
  EXPECT_EQ(read.annotations(), m.annotations()) << name;
  EXPECT_EQ(write_swc(read), bytes) << name;
}

TEST(SwcRealData, EveryTracedNeuronIsReadAndSurvivesExport) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  std::size_t neurons = 0, sections = 0;
  std::map<std::string_view, std::size_t> odd;  // files by code
  for (const auto& path : files_below(folder, ".swc")) {
    const auto [m, warnings] = read(path);
    expect_round_trip(m, path.string());
    std::set<std::string_view> codes;
    for (const Warning& warning : warnings) codes.insert(warning.code);
    for (const std::string_view code : codes) ++odd[code];
    ++neurons, sections += m.sections().size();
  }
  for (const auto& [code, files] : odd)
    std::printf("  %4zu files with %s\n", files, std::string(code).c_str());
  std::printf("  %4zu neurons, %zu sections\n", neurons, sections);
  EXPECT_GT(neurons, 400u);
  for (const std::string_view code :
       {"type-undefined", "several-roots", "soma-under-neurite", "child-first", "line-ends"})
    EXPECT_GT(odd[code], 0u) << code;
}

TEST(SwcRealData, OneNeuronWrittenManyWaysIsOneNeuron) {
  FOREST_REAL_DATA(folder, "morphologies/broken");
  const Morphology simple = read(folder / "morphio/simple.swc").morphology;
  EXPECT_TRUE(read(folder / "morphio/simple-windows-eol.swc").morphology.sections().size() ==
              simple.sections().size());
  const Morphology indented = read(folder / "inline_morphio_swc/weird_indent_1.swc").morphology;
  EXPECT_TRUE(std::ranges::equal(indented.sections(), simple.sections()));
  const Morphology reversed = read(folder / "inline_morphio_swc/simple_reversed_1.swc").morphology;
  EXPECT_EQ(reversed.sections().size(), simple.sections().size());
  EXPECT_DOUBLE_EQ(total_length(reversed), total_length(simple));
  const Morphology ordered = read(folder / "neurom/swc/ordering/sample.swc").morphology;
  for (const char* same :
       {"neurom/swc/ordering/sample_disordered.swc", "neurom/swc/ordering/sample_mixed_tree_sections.swc"}) {
    const Morphology other = read(folder / same).morphology;
    EXPECT_EQ(other.sections().size(), ordered.sections().size()) << same;
    EXPECT_DOUBLE_EQ(total_area(other), total_area(ordered)) << same;
  }
}

TEST(Eswc, ColumnsOfVaa3dFollowFromTheNeuron) {
  const ReadResult traced = read_swc(
      "1 1 0 0 0 5 -1 7 7 7 7 7\n2 3 0 5 0 1 1 7 7 7 7 7\n3 3 0 9 0 1 2 7 7 7 7 7\n4 3 4 9 0 1 3 7 7 7 7 7\n"
      "5 3 -4 9 0 1 3 7 7 7 7 7\n",
      "cell");
  ASSERT_EQ(traced.warnings.size(), 1u);
  EXPECT_EQ(traced.warnings[0].code, "extra-columns");
  EXPECT_TRUE(traced.warnings[0].lost);
  const std::string text = write_eswc(traced.morphology);
  for (const char* row :
       {"\n1 1 0 0 0 5 -1 0 0 0 0 0\n", "\n3 3 0 9 0 1 2 1 1 0 0 0\n", "\n5 3 -4 9 0 1 3 3 2 0 0 0\n"})
    EXPECT_NE(text.find(row), text.npos) << row << text;
  const ReadResult again = read_swc(text, "cell");
  EXPECT_TRUE(again.warnings.empty());
  EXPECT_EQ(again.morphology, traced.morphology);
}

}  // namespace
}  // namespace forest::io
