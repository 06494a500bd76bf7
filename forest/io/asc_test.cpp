// SPDX-License-Identifier: Apache-2.0
#include "forest/io/asc.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/asc_words.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

constexpr std::string_view soma = "(\"CellBody\" (CellBody) (1 0 0 0) (0 1 0 0) (-1 0 0 0))\n";

Morphology neuron(std::string_view text) { return read_asc(text, "cell.asc").morphology; }

TEST(Asc, ReadsSomaStemAndBranches) {
  const auto [m, warnings] = read_asc(
      "; by hand\n(\"CellBody\" (CellBody) (5 0 0 0) (0 5 0 0) (-5 0 0 0) (0 -5 0 0))\n"
      "((Apical) (0 5 0 2) (0 15 0 1) ( (3 19 0 1) | (-3 19 0 1) ))",
      "cell.asc");
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(m.soma().kind, SomaKind::contours);
  EXPECT_FLOAT_EQ(m.soma().sphere().radius, 5.f);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.section(SectionId(2)).kind, SectionKind::apical);
  EXPECT_EQ(m.section(SectionId(2)).parent, SectionId(0));
  EXPECT_EQ(m.points(SectionId(1))[0], (Point{0, 15, 0, .5f}));
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  EXPECT_EQ(m.annotations(), (Annotations{{"comment", "by hand"}}));
}

TEST(Asc, WhatIsNotKeptIsCountedAndTold) {
  const ReadResult result = read_asc(
      "(\"soma A\" (Name \"soma A\") (CellBody) (5 0 0 0) (0 5 0 0) (Color Green) (-5 0 0 0))\n"
      "((Axon) (Color Red) (0 0 0 1) (0 9 0 1) <(Class 1 \"thin\") (Name \"s\") (1 9 0 1)> (Color Blue))\n"
      "(\"CellBody\" (CellBody) (5 0 9 0))",
      "cell");
  const auto told =
      std::ranges::find(result.warnings, std::string_view("properties-not-kept"), &Warning::code);
  ASSERT_NE(told, result.warnings.end());
  EXPECT_TRUE(told->lost);
  EXPECT_EQ(told->line, 1u);
  EXPECT_EQ(told->sentence.find("5 properties"), 0u) << told->sentence;  // the tree's own is kept
}

TEST(Asc, ABranchHasTheRadiusOfItsOwnFirstPointAtTheNode) {
  const Morphology said = neuron("((Axon) (0 0 0 2) (0 9 0 2) ( (0 9 0 20) (1 9 0 1) | (-1 9 0 1) ))");
  EXPECT_EQ(said.points(SectionId(1))[0].radius, 10.f);  // the point is repeated: as it says
  EXPECT_EQ(said.points(SectionId(2))[0].radius, .5f);   // it is not: as the branch begins
}

TEST(Asc, ReadsNumbersAsTheyAreWritten) {
  const Morphology m = neuron("((Axon)(+1 -.5 1e1 2)( \t1.25\n 2. ; x\r\n 3 4 S1)\r( 1 2 3 0.0000001 7 ))");
  ASSERT_EQ(m.points().size(), 3u);
  EXPECT_EQ(m.points()[0], (Point{1, -.5f, 10, 1}));
  EXPECT_EQ(m.points()[1], (Point{1.25f, 2, 3, 2}));
}

TEST(Asc, SpinesSitOnTheirPoint) {
  const Morphology m = neuron(
      "((Dendrite) (0 0 0 1) (0 10 0 1) <(1 10 0 .5)> (0 20 0 1) <(Class 3 \"Mushroom\") (Color Red)(0 20 2 "
      ".25)>\n"
      "( <(0 20 9 1)> (0 30 0 1) | (9 20 0 1) Normal <(9 21 0 1)> ))");
  ASSERT_EQ(m.spines().size(), 4u);
  EXPECT_EQ(m.spines()[0], (Spine{SectionId(0), 10.f, Vec3(1, 0, 0), .5f, 0.f, SpineShape::unknown}));
  EXPECT_EQ(m.spines()[1], (Spine{SectionId(0), 20.f, Vec3(0, 0, 2), .25f, 0.f, SpineShape::mushroom}));
  EXPECT_EQ(m.spines()[2], (Spine{SectionId(1), 0.f, Vec3(0, 0, 9), 1.f, 0.f, SpineShape::unknown}));
  EXPECT_EQ(m.spines()[3], (Spine{SectionId(2), 9.f, Vec3(0, 1, 0), 1.f, 0.f, SpineShape::unknown}));
}

TEST(Asc, BracketsWithinASpineSayNothing) {
  const Morphology bare = neuron("((Dendrite) (0 0 0 1) <(0 2 0 .5)> (0 10 0 1))");
  const Morphology bracketed = neuron("((Dendrite) (0 0 0 1) <( (Color Red) (0 2 0 .5) )> (0 10 0 1))");
  ASSERT_EQ(bracketed.spines().size(), 1u);
  EXPECT_EQ(bracketed.spines()[0], bare.spines()[0]);
  EXPECT_EQ(bracketed.points().size(), 2u);
}

TEST(Asc, TheSomaIsKnownByOtherWordsToo) {
  for (const std::string_view word : {"CellBody", "Soma", "cell body 2", "SOMA_1"}) {
    SCOPED_TRACE(word);
    const Morphology m =
        neuron(fmt::format("(\"{0}\" {1} (5 0 0 0) (0 5 0 0) (-5 0 0 0) (0 -5 0 0))", word,
                           word.find_first_of(" _") != word.npos ? "(Closed)" : fmt::format("({})", word)));
    EXPECT_FLOAT_EQ(m.soma().sphere().radius, 5.f);
    EXPECT_EQ(m.sections().size(), 0u);
  }
}

TEST(Asc, ANamedBlockWithinATreeIsKeptAndTheTreeGoesOn) {
  const Morphology m =
      neuron("((Axon) (0 0 0 1) (0 10 0 1) (\"layer\" (Closed) (9 9 9 1) (8 8 8 1)) (0 20 0 1))");
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  EXPECT_EQ(m.annotations(), (Annotations{{"contour", "(\"layer\" (Closed) (9 9 9 1) (8 8 8 1))"}}));
}

TEST(Asc, WhatIsNoNeuriteIsKeptAsItsText) {
  const auto [m, warnings] = read_asc(
      "(ImageCoords)\n(Sections S1 \"a \\\" 3 100 0) ; none\n(Dot (Color RGB (1, 2, 3))\n (Name \"m;1\") (1 "
      "2 3 .5) )\n"
      "(\"pia\" (Closed) (1 2 3 4) (2 3 4 5))\n( (Color White) (1 2 3) \"<-- look\" )\n"
      "( (Color Red) (Set \"axons\") (Axon) (0 0 0 1) (0 1 0 1) (Cross (0 1 0 1)) ( (1 2 0 1) Incomplete | "
      "(2 2 0 1) Normal ))",
      "cell.asc");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].code, "comments-not-kept");  // "none"
  const Annotations expected{{"asc", "(Sections S1 \"a \\\" 3 100 0)"},
                             {"marker", "(Dot (Color RGB (1, 2, 3)) (Name \"m;1\") (1 2 3 .5))"},
                             {"contour", "(\"pia\" (Closed) (1 2 3 4) (2 3 4 5))"},
                             {"text", "((Color White) (1 2 3) \"<-- look\")"},
                             {"marker", "(Cross (0 1 0 1))"},
                             {"tree", "0 0 0 (Color Red) (Set \"axons\")"},
                             {"leaf", "Incomplete 1 2 0"}};
  EXPECT_EQ(m.annotations(), expected);
  const std::string written = write_asc(m);
  for (const std::string_view text :
       {"(Color Red) (Set \"axons\") (Axon)", "Incomplete\n", "(Cross (0 1 0 1))\n"})
    EXPECT_NE(written.find(text), written.npos) << text;
  Annotations again = neuron(written).annotations();
  EXPECT_TRUE(std::ranges::is_permutation(again, expected));
}

TEST(Asc, AnnotationsFromElsewhereCannotBreakTheFile) {
  MorphologyBuilder b;
  const std::vector<Point> points{{0, 0, 0, 1}, {0, 1, 0, 1}};
  b.add_section({}, SectionKind::axon, points);
  for (const std::string_view text :
       {"(Cross (0 0 0 1)) ((Axon) (5 5 5 1) (6 6 6 1))", ")", "(", "\"", "(a) ; b", "x\n(y)"}) {
    b.annotate("marker", std::string(text));
    b.annotate("tree", "0 0 0 " + std::string(text));
    b.annotate("leaf", std::string(text) + " 0 1 0");
    b.annotate("comment", std::string(text));
  }
  b.annotate("leaf", "Normal 0 1 0");
  const Morphology m = b.build();
  const Morphology read = neuron(write_asc(m));
  EXPECT_EQ(read.sections().size(), 1u);
  EXPECT_EQ(write_asc(read), write_asc(m));
}

// A deviation: where it is told, and what is read.
struct Deviation {
  std::string_view code;
  std::size_t line;
  std::string text;
  std::size_t sections;
  double length;
};

TEST(Asc, EveryDeviationIsToldWithItsLineAndRead) {
  const std::string cell(soma), stem = "((Axon) (0 0 0 1) (0 10 0 1)\n";
  const std::vector<Deviation> table{
      {"byte-order-mark", 1, "\xef\xbb\xbf" + stem + ")", 1, 10.},
      {"thumbnail", 1, "(Thumbnail (Cols 4) \"ff00\")\n" + stem + ")", 1, 10.},
      {"several-outlines", 2, cell + cell + stem + ")", 1, 10.},
      {"outline-by-name", 1, "(\"Cell Body\" (Closed) (1 0 0 0) (0 1 0 0) (-1 0 0 0))" + stem + ")", 1, 10.},
      {"small-outline", 1, "(\"Soma\" (CellBody) (1 0 0 6))" + stem + ")", 1, 10.},
      {"empty-outline", 2, cell + "(\"Soma\" (CellBody))" + stem + ")", 1, 10.},
      {"no-type", 1, "((Color Red) (0 0 0 1)\n(0 10 0 1) )", 1, 10.},
      {"type-in-branch", 2, stem + "( (Dendrite) (0 20 0 1) | (9 10 0 1)))", 3, 29.},
      {"no-diameter", 2, stem + "(0 20 0))", 1, 20.},
      {"negative-diameter", 2, stem + "(0 20 0 -1))", 1, 20.},
      {"unknown-diameter", 2, stem + "(0 20 0 1e99))", 1, 20.},
      {"unknown-place", 2, stem + "(1e99 20 0 1))", 1, 20.},
      {"extra-numbers", 2, stem + "(0 20 0 1 5))", 1, 20.},
      {"empty-tree", 2, cell + "((Axon) (Color Red))", 0, 0.},
      {"empty-tree", 2, cell + "()", 0, 0.},
      {"tree-begins-with-split", 2, cell + "((Axon) ( (0 0 0 1) (0 1 0 1) | (5 0 0 1) (5 1 0 1)))", 2, 2.},
      {"branch-without-points", 2, stem + "( ( (0 11 0 1) | (0 12 0 1)) | (1 10 0 1)))", 4, 14.},
      {"only-branch-point", 2, stem + "( (0 10 0 3) | (1 10 0 1) | (2 10 0 1)))", 3, 13.},
      {"empty-branch", 2, stem + "( (1 10 0 1) | | (2 10 0 1)))", 3, 13.},
      {"single-daughter", 2, stem + "( (1 10 0 1) ))", 2, 11.},
      {"second-split", 3, stem + "( (1 10 0 1) | (2 10 0 1))\n( (3 10 0 1) | (4 10 0 1)))", 5, 20.},
      {"unknown-word", 2, stem + "Ending)", 1, 10.},
      {"text-in-tree", 2, stem + "\"text\" (0 20 0 1))", 1, 20.},
      {"spine-before-points", 1, "((Axon) <(1 2 3 1)> (0 0 0 1) (0 20 0 1))", 1, 20.},
      {"comments-not-kept", 2, "((Axon) ; R\n (0 0 0 1) ; a swelling\n (0 20 0 1)) ; 1, R-1", 1, 20.},
      {"properties-not-kept", 2, "((Axon) (Color Red)\n (0 0 0 1) (Name \"b\") (0 20 0 1))", 1, 20.},
      {"spine-without-place", 2, stem + "< > (0 20 0 1))", 1, 20.},
      {"stray-bracket", 2, stem + "))", 1, 10.},
      {"text-in-tree", 2, stem + "(\"text\" (Color Red)) (0 20 0 1))", 1, 20.},
      {"trailing-text", 2, stem + ") the end", 1, 10.},
      {"padding", 0, stem + ")\n\x1a", 1, 10.},
  };
  std::set<std::string_view> seen;
  for (const Deviation& row : table) {
    SCOPED_TRACE(row.text);
    const auto [m, warnings] = read_asc(row.text, "cell.asc");
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0].code, row.code);
    EXPECT_EQ(warnings[0].line, row.line);
    EXPECT_EQ(m.sections().size(), row.sections);
    EXPECT_DOUBLE_EQ(total_length(m), row.length);
    seen.insert(row.code);
  }
  const std::string page(MappedFile(FOREST_SOURCE_DIR "/docs/formats/asc.md").text());
  for (const Oddity& row : asc_oddities()) {
    EXPECT_TRUE(seen.contains(row.code)) << row.code << " has no test";
    EXPECT_NE(page.find(fmt::format("`{}`", row.code)), page.npos) << row.code << " is not documented";
  }
}

TEST(Asc, WhatCannotBeReadIsRefusedWithItsLine) {
  struct Refused {
    std::string text;
    std::size_t line;
    std::string_view says;
  };
  const std::vector<Refused> table{
      {"\xff\xfe(", 1, "UTF-16"},
      {"ncols 5\n", 1, "ncols"},
      {"((Axon)\n(1 2 x 4))", 2, "\"x\" is not a number"},
      {"((Axon)\n(x 2 3 4))", 2, "\"x\" is not a number"},
      {"((Axon)\n(1 2 3 2x))", 2, "2x"},
      {"((Axon)\n(1 2))", 2, "2 numbers"},
      {"((Axon)\n(1 2 3 4) Low\n(2 2 3 4))", 3, "Low"},
      {"((Axon)\n(1 2 3 4) ( (2 2 2 2) | (3 3 3 3) )\n(2 2 3 4))", 3, "split"},
      {"((Axon)\n(1 2 3 4) | (2 2 3 4))", 2, "outside of a split"},
      {"((Axon)\n(1 2 3 4) (Axon)\n(Dendrite))", 3, "before the first one"},
      {"((Axon)\n(1 2 3 4) %)", 2, "no meaning"},
      {"((Axon)\n(1e99 2 3 4))", 2, "no place"},
      {"((Axon)\n(1 2 3 4)\n( (2 2 2 2) |\n", 4, "opened on line 3"},
      {"((Axon)\n(1 2 3 4", 2, "inside of a point"},
      {"((Axon)\n(1 2 3 4) < (1 2 3 4)", 2, "inside of a spine"},
      {"(\"CellBody\" (CellBody)\n(1 2 3 4)\n", 3, "inside of an outline"},
      {"(Dot (1 2 3 4)\n", 2, "inside of a block"},
      {"\n(\"CellBody", 2, "quotation mark"},
      {"(Dot (1 2 3 4))\n", 0, "neither a tree nor a cell body"},
  };
  for (const Refused& row : table) {
    SCOPED_TRACE(row.text);
    try {
      read_asc(row.text, "cell.asc");
      ADD_FAILURE() << "was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), row.line);
      EXPECT_NE(error.sentence().find(row.says), std::string::npos) << error.sentence();
    }
  }
}

TEST(Asc, AHundredThousandLevelsAreReadAndWritten) {
  constexpr std::size_t levels = 100000;
  std::string text = "((Axon) (0 0 0 1)";
  for (std::size_t i = 1; i <= levels; ++i) text += fmt::format("((1 {} 0 1)|(0 {} 0 1)", i, i);
  text += std::string(levels, ')') + ')';
  const Morphology m = neuron(text);
  EXPECT_EQ(m.sections().size(), 2 * levels + 1);
  EXPECT_EQ(m.order(SectionId(2 * levels)), int(levels));
  const std::string written = write_asc(m);
  EXPECT_LT(written.size(), 250u * 2 * levels);
  EXPECT_TRUE(std::ranges::equal(neuron(written).sections(), m.sections()));
  for (const std::string_view opening :
       {"(", "((Axon)(", "((Axon)(1 2 3 4)((", "(a (", "((Axon)(1 2 3 4)<("}) {
    std::string open;
    for (std::size_t i = 0; i < levels; ++i) open += opening;
    EXPECT_THROW(read_asc(open, "cell.asc"), InputError) << opening;
  }
}

TEST(Asc, OursSaysWhatTheFormatHasNoWordFor) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology left = as_kept(specimen.morphology, asc_keeps);
    const Morphology read = neuron(write_asc(specimen.morphology));
    EXPECT_TRUE(read == left);
  }
}

TEST(Asc, IsRecognisedByItsFirstBracket) {
  for (const std::string_view text :
       {"; x\n(ImageCoords)", "\n( (Color Red)", "(\"CellBody\"", "\xef\xbb\xbf(("})
    EXPECT_TRUE(recognises_asc(text)) << text;
  for (const std::string_view text : {"", "; only", "1 1 0 0 0 1 -1\n", "(1 2 3)", "<mbf>", "# swc\n"})
    EXPECT_FALSE(recognises_asc(text)) << text;
}

void expect_round_trip(const Morphology& m, const std::string& name) {
  const std::string bytes = write_asc(m);
  const Morphology read = read_asc(bytes, name).morphology;
  EXPECT_TRUE(read == m) << name;
  EXPECT_NEAR(total_length(read), total_length(m), 1e-6 * total_length(m)) << name;
  EXPECT_NEAR(total_area(read), total_area(m), 1e-6 * total_area(m)) << name;
  EXPECT_TRUE(std::ranges::is_permutation(read.annotations(), m.annotations())) << name;
  EXPECT_EQ(write_asc(read), bytes) << name;
}

TEST(AscRealData, EveryTracedNeuronIsReadAndSurvivesExport) {
  std::size_t neurons = 0, spines = 0;
  for (const char* const folder_name : {"morphologies", "formats", "sonata/sonata_extension"}) {
    FOREST_REAL_DATA(folder, folder_name);
    for (const auto& path : files_below(folder, ".asc")) {
      if (path.string().find("broken") != std::string::npos) continue;
      const auto [m, warnings] = read(path);
      expect_round_trip(m, path.string());
      EXPECT_EQ(m.soma().kind, SomaKind::contours) << path;
      EXPECT_LE(std::ranges::count(warnings, false, &Warning::lost), 1) << path;
      ++neurons, spines += m.spines().size();
    }
  }
  std::printf("  %zu neurons, %zu spines\n", neurons, spines);
  EXPECT_GT(neurons, 15u);
  EXPECT_GT(spines, 100u);
}

TEST(AscRealData, TheSameCellInSwcHasTheSameTreeLengthAndArea) {
  FOREST_REAL_DATA(folder, "sonata/sonata_extension/source/usecases/components");
  std::size_t pairs = 0;
  for (const auto& path : files_below(folder, ".asc")) {
    const auto twin = path.parent_path().parent_path() / "swc" / path.stem().concat(".swc");
    if (!std::filesystem::exists(twin)) continue;
    SCOPED_TRACE(twin.string());
    const Morphology a = read(path).morphology, b = read(twin).morphology;
    EXPECT_EQ(a.sections().size(), b.sections().size());
    EXPECT_NEAR(total_length(a), total_length(b), 1e-4 * total_length(b));
    EXPECT_NEAR(total_area(a), total_area(b), 1e-3 * total_area(b));
    ++pairs;
  }
  EXPECT_GE(pairs, 2u);
}

TEST(AscRealData, WhatOddFilesHoldIsWhereItBelongs) {
  FOREST_REAL_DATA(folder, "morphologies/broken");
  const auto points = [&](const char* file, std::size_t section) {
    const Morphology m = read(folder / file).morphology;
    const auto span = m.points(SectionId(section));
    return std::vector<Point>(span.begin(), span.end());
  };
  EXPECT_EQ(points("inline_morphio_asc/explicit_duplicates_with_arbitrary_diameter_1.asc", 1),
            (std::vector<Point>{{3, -10, 0, 10}, {0, -10, 0, 1}, {-3, -10, 0, .15f}}));
  EXPECT_EQ(points("inline_morphio_asc/section_single_point_1.asc", 1),
            (std::vector<Point>{{3, -10, 0, 2}, {3, -10, 2, 2}}));
  EXPECT_EQ(
      read(folder / "inline_morphio_asc/parse_number_with_plus_symbol_1.asc").morphology.soma().points[1].y,
      1.f);
  const auto count = [&](const char* file, std::string_view key) {
    return std::ranges::count(read(folder / file).morphology.annotations(), key,
                              &Annotations::value_type::first);
  };
  EXPECT_EQ(count("morphio/markers.asc", "marker"), 3);
  EXPECT_EQ(count("morphio/markers.asc", "leaf"), 2);
  EXPECT_EQ(count("morphio/pia.asc", "contour"), 2);
  EXPECT_EQ(count("morphio/marker-with-string.asc", "text"), 1);
  EXPECT_EQ(read(folder / "morphio/spine.asc").morphology.spines().size(), 2u);
}

}  // namespace
}  // namespace forest::io
