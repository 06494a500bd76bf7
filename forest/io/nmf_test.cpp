// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nmf.h"

#include <algorithm>
#include <cctype>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/asc.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

std::string file(std::string_view inside) {
  return fmt::format("<mbf version=\"4.0\">\n{}\n</mbf>\n", inside);
}
std::string point(float x, float y, float z, float d) {
  return fmt::format("<point x=\"{}\" y=\"{}\" z=\"{}\" d=\"{}\"/>", x, y, z, d);
}
std::string tree(std::string_view inside) {
  return fmt::format("<tree type=\"Axon\" leaf=\"Normal\">{}</tree>", inside);
}

const std::string& sample() {
  static const std::string bytes(MappedFile(FOREST_SOURCE_DIR "/fuzz/corpus/nmf/cell.xml").text());
  return bytes;
}

TEST(Nmf, ReadsSomaStemSpineAndBranches) {
  const auto [m, warnings] = read_nmf(sample(), "cell.xml");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].sentence, "there is more than the shape (thumbnail); left out");
  EXPECT_TRUE(warnings[0].lost);
  EXPECT_EQ(m.soma().kind, SomaKind::contours);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::apical);
  EXPECT_EQ(m.points(SectionId(1))[0], (Point{0, 15, 0, .5f}));
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  ASSERT_EQ(m.spines().size(), 1u);
  EXPECT_EQ(m.spines()[0], (Spine{SectionId(0), 10.f, Vec3(1, 0, 0), .6f, .1f, SpineShape::mushroom}));
  const Annotations expected{{"description", "a cell"},
                             {"species", "rat"},
                             {"subjectid", "7"},
                             {"sex", "Male"},
                             {"age", "14 Days"},
                             {"image", "C:\\cell.lsm"},
                             {"contour", "(\"pia\" (Color RGB (0, 255, 0)) (0 99 0 1))"},
                             {"marker", "(Circle1 (Color RGB (0, 0, 255)) (Name \"here '1'\") (1 2 3 0.5))"},
                             {"tree", "0 5 0 (Color RGB (255, 255, 0)) (Set \"traced\")"},
                             {"leaf", "Incomplete 3 19 0"}};
  EXPECT_EQ(m.annotations(), expected);
}

TEST(Nmf, WhatItKeepsAsAnnotationsIsWrittenIntoAsc) {
  const std::string asc = write_asc(read_nmf(sample(), "cell.xml").morphology);
  for (const std::string_view part :
       {"\n(\"pia\" (Color RGB (0, 255, 0)) (0 99 0 1))\n", "\n(Circle1 (Color", "Incomplete\n",
        "( (Color RGB (255, 255, 0)) (Set \"traced\") (Apical)\n"})
    EXPECT_NE(asc.find(part), asc.npos) << part;
}

TEST(Nmf, EveryDeviationIsToldWithItsLineAndRead) {
  const std::string stem = point(0, 0, 0, 1) + point(0, 10, 0, 1) + "\n";
  const auto branch = [](const std::string& inside) { return "<branch>" + inside + "</branch>"; };
  const std::string a = branch(point(1, 10, 0, 1)), b = branch(point(2, 10, 0, 1));
  const std::string soma = "<contour name=\"Soma 1\" shape=\"Contour\">" + point(5, 0, 0, 1) +
                           point(0, 5, 0, 1) + point(-5, 0, 0, 1) + "</contour>\n";
  struct Deviation {
    std::string_view code;
    std::size_t line;
    std::string text;
    double length;
  };
  const std::vector<Deviation> table{
      {"version", 1, "<mbf version=\"3\">" + tree(stem) + "</mbf>", 10.},
      {"unknown-type", 2, file("<tree type=\"Airway\">" + stem + "</tree>"), 10.},
      {"no-diameter", 3, file(tree(stem + "<point x=\"0\" y=\"20\" z=\"0\"/>")), 20.},
      {"negative-diameter", 3, file(tree(stem + point(0, 20, 0, -1))), 20.},
      {"unknown-diameter", 3, file(tree(stem + "<point x=\"0\" y=\"20\" z=\"0\" d=\"NaN\"/>")), 20.},
      {"unknown-place", 3, file(tree(stem + "<point x=\"1e99\" y=\"20\" z=\"0\" d=\"1\"/>")), 20.},
      {"several-outlines", 3, file(soma + soma + tree(stem)), 10.},
      {"small-outline", 0,
       file("<contour name=\"Cell Body\">" + point(5, 0, 0, 8) + "</contour>" + tree(stem)), 10.},
      {"empty-tree", 3, file(soma + tree("")), 0.},
      {"tree-begins-with-split", 2, file(tree(branch(stem) + branch(stem))), 20.},
      {"branch-without-points", 3, file(tree(stem + branch(a + b) + a)), 10. + 1. + 2. + 1.},
      {"only-branch-point", 3, file(tree(stem + branch(point(0, 10, 0, 3)) + a + b)), 13.},
      {"empty-branch", 3, file(tree(stem + branch("") + a + b)), 13.},
      {"single-daughter", 2, file(tree(stem + a)), 11.},
      {"spine-without-place", 3, file(tree(stem + "<spine classification=\"thin\"/>")), 10.},
      {"spine-before-points", 2, file(tree("<spine>" + point(1, 0, 0, 1) + "</spine>" + stem)), 10.},
      {"skipped-element", 2, file("<vessel/>" + tree(stem)), 10.},
      {"several-documents", 5, file(tree(stem)) + file(tree(stem)), 10.},
      {"not-kept", 3, file("\n<filefacts/>" + tree(stem)), 10.},
      {"not-kept", 2, file(tree("<property name=\"Class\"><s>7</s></property>" + stem)), 10.},
      {"not-kept", 2,
       file("<images><image><filename>a</filename><scale x=\"2\"/></image></images>" + tree(stem)), 10.},
      {"not-kept", 3, file(tree(stem + "<spine><backbone/>" + point(1, 0, 0, 1) + "</spine>")), 10.},
  };
  std::set<std::string_view> seen;
  for (const Deviation& row : table) {
    SCOPED_TRACE(row.text);
    const auto [m, warnings] = read_nmf(row.text, "cell.xml");
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0].code, row.code);
    EXPECT_EQ(warnings[0].line, row.line);
    EXPECT_DOUBLE_EQ(total_length(m), row.length);
    seen.insert(row.code);
  }
  const std::string page(MappedFile(FOREST_SOURCE_DIR "/docs/formats/nmf.md").text());
  for (const Oddity& row : nmf_oddities()) {
    EXPECT_TRUE(seen.contains(row.code)) << row.code << " has no test";
    EXPECT_NE(page.find(fmt::format("`{}`", row.code)), page.npos) << row.code << " is not documented";
  }
}

TEST(Nmf, WhatCannotBeReadIsRefusedWithItsLine) {
  struct Refused {
    std::string text;
    std::size_t line;
    std::string_view says;
  };
  const std::vector<Refused> table{
      {"\xff\xfe<", 1, "UTF-16"},
      {"<mbf>\n<tree>\n", 2, "broken"},
      {"<mbf>\n<tree></branch></mbf>\n", 2, "broken"},
      {"\n<neuroml/>", 2, "no <mbf>"},
      {file(tree("\n<point x=\"a\" y=\"0\" z=\"0\" d=\"1\"/>")), 3, "no number"},
      {file(tree("\n<point y=\"0\" z=\"0\" d=\"1\"/>")), 3, "no number"},
      {file(tree("\n<point x=\"inf\" y=\"0\" z=\"0\" d=\"1\"/>")), 3, "no place"},
      {file(tree(point(0, 0, 0, 1) + "<branch/>\n" + point(0, 0, 0, 1))), 3, "follows the branches"},
      {file("<images/>"), 0, "neither"},
  };
  for (const Refused& row : table) {
    SCOPED_TRACE(row.text);
    try {
      read_nmf(row.text, "cell.xml");
      ADD_FAILURE() << "was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), row.line);
      EXPECT_NE(error.sentence().find(row.says), std::string::npos) << error.sentence();
    }
  }
}

TEST(Nmf, HostileXmlCostsNeitherStackNorMemory) {
  constexpr std::size_t levels = 100000;
  std::string deep;
  for (std::size_t i = 0; i < levels; ++i)
    deep += "<branch>" + point(float(i), 1, 1, 1) + "<branch>" + point(0, 0, 0, 1) + "</branch>";
  for (std::size_t i = 0; i < levels; ++i) deep += "</branch>";
  const Morphology m = read_nmf(file(tree(point(0, 0, 0, 1) + deep)), "deep.xml").morphology;
  EXPECT_GT(m.sections().size(), levels);
  std::string open = "<mbf>";
  for (std::size_t i = 0; i < levels; ++i) open += "<tree>";
  EXPECT_THROW(read_nmf(open, "open.xml"), InputError);
  std::string laughs = "<!DOCTYPE mbf [<!ENTITY a \"aaaaaaaaaa\">";
  for (char c = 'b'; c <= 'z'; ++c)
    laughs += fmt::format("<!ENTITY {} \"&{};&{};&{};&{};&{};&{};&{};&{};\">", c, c - 1, c - 1, c - 1, c - 1,
                          c - 1, c - 1, c - 1, c - 1);
  laughs += "<!ENTITY file SYSTEM \"file:///etc/passwd\">]>" +
            file("<description>&z;&file;</description>" + tree(point(0, 0, 0, 1)));
  const Morphology laughed = read_nmf(laughs, "laughs.xml").morphology;
  EXPECT_EQ(laughed.annotations(), (Annotations{{"description", "&z;&file;"}}));
}

TEST(Nmf, CutOrChangedAnywhereItIsAnErrorOrANeuron) {
  const auto reads = [](const std::string& bytes) {
    try {
      (void)read_nmf(bytes, "cell.xml");
      return true;
    } catch (const InputError& error) {
      EXPECT_GT(error.sentence().size(), 10u);
      return false;
    }
  };
  for (std::size_t size = 0; size < sample().size(); ++size) reads(sample().substr(0, size));
  Random random(7, 0, 5);
  std::size_t read = 0, refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string changed = sample();
    const std::size_t at = random.below(std::uint32_t(changed.size()));
    if (trial % 3 == 0)
      changed.erase(at, 1 + random.below(30));
    else if (trial % 3 == 1)
      changed.insert(at, changed.substr(random.below(std::uint32_t(changed.size())), random.below(200)));
    else
      changed[at] = char(random.below(256));
    ++(reads(changed) ? read : refused);
  }
  EXPECT_GT(read, 0u);
  EXPECT_GT(refused, 0u);
}

TEST(Nmf, LatinLettersBecomeUtf8AndCirclesOutlines) {
  const Morphology m =
      read_nmf("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>" +
                   file("<description>5 \xb5m</description><contour name=\"Soma\" shape=\"Circle\">" +
                        point(1, 0, 0, 1) + point(6, 0, 0, 1) + "</contour>"),
               "cell.xml")
          .morphology;
  EXPECT_EQ(m.annotations()[0].second, "5 µm");
  EXPECT_NEAR(m.soma().sphere().radius, 5., 1e-5);
}

TEST(Nmf, PrefixesOfANameSpaceAreSeenThrough) {
  std::string text;
  for (std::size_t i = 0; i < sample().size(); ++i) {
    const bool opens = sample()[i] == '<' && std::isalpha(static_cast<unsigned char>(sample()[i + 1]));
    const bool closes = i > 0 && sample()[i] == '/' && sample()[i - 1] == '<';
    text += sample()[i];
    if (opens || closes) text += "n:";
  }
  ASSERT_TRUE(recognises_nmf(text));
  const auto [m, warnings] = read_nmf(text, "cell.xml");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].sentence, read_nmf(sample(), "cell.xml").warnings[0].sentence);
  const Morphology bare = read_nmf(sample(), "cell.xml").morphology;
  EXPECT_TRUE(std::ranges::equal(m.points(), bare.points()));
  EXPECT_TRUE(std::ranges::equal(m.spines(), bare.spines()));
  EXPECT_EQ(m.annotations(), bare.annotations());
}

TEST(Nmf, Utf16IsRecognisedAndRefusedByASentence) {
  std::string wide = "\xff\xfe";
  for (const char c : sample()) (wide += c) += '\0';
  EXPECT_TRUE(recognises_nmf(wide));
  EXPECT_NE(refused<InputError>([&] { read_nmf(wide, "cell.xml"); }).find("UTF-16; save it as UTF-8"),
            std::string::npos);
}

TEST(Nmf, IsRecognisedByItsElement) {
  EXPECT_TRUE(recognises_nmf(sample()));
  for (const std::string_view text : {"", "<mbf", "<mbfx>", "<neuroml>", "((Axon)"})
    EXPECT_FALSE(recognises_nmf(text));
}

TEST(NmfRealData, TheTracedNeuronIsReadAndSurvivesAsc) {
  FOREST_REAL_DATA(folder, "formats");
  std::size_t neurons = 0;
  for (const auto& path : files_below(folder, ".xml")) {
    SCOPED_TRACE(path.string());
    const MappedFile bytes(path);
    if (!recognises_nmf(bytes.text())) continue;
    const auto [m, warnings] = read_nmf(bytes.text(), path.string());
    EXPECT_LE(std::ranges::count(warnings, false, &Warning::lost), 1);
    EXPECT_EQ(m.soma().kind, SomaKind::contours);
    // Every point is there once, and once more where a branch begins.
    std::size_t points = 0, branches = 0;
    for (std::size_t at = 0; (at = bytes.text().find("<point ", at)) != bytes.text().npos; ++at) ++points;
    for (std::size_t at = 0; (at = bytes.text().find("<branch", at)) != bytes.text().npos; ++at) ++branches;
    EXPECT_EQ(m.soma().points.size() + m.points().size(), points + branches);
    const Morphology again = read_asc(write_asc(m), "again").morphology;
    EXPECT_TRUE(again == m);
    for (const std::string_view key : {"tree", "leaf", "marker", "contour"})
      EXPECT_EQ(std::ranges::count(again.annotations(), key, &Annotations::value_type::first),
                std::ranges::count(m.annotations(), key, &Annotations::value_type::first));
    ++neurons;
  }
  EXPECT_GE(neurons, 1u);
}

}  // namespace
}  // namespace forest::io
