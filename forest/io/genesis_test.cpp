// SPDX-License-Identifier: Apache-2.0
#include "forest/io/genesis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/genesis_names.h"
#include "forest/io/swc.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

Morphology cell(const std::string& text) { return read_genesis(text, "cell.p").morphology; }

// One cell, told in every mode: a soma of a sphere with a dendrite of 10 + 10 µm that divides into two of 5 µm.
constexpr std::string_view told[] = {
    "*relative\nsoma none 0 0 0 20\ndend soma 0 10 0 2\ndend_1 dend 0 10 0 2\ndend_2 . 3 4 0 1\ndend_3 "
    "dend_1 -3 4 0 1\n",
    "*absolute\nsoma none 0 0 0 20\ndend soma 0 10 0 2\ndend_1 dend 0 20 0 2\ndend_2 . 3 24 0 1\ndend_3 "
    "dend_1 -3 24 0 1\n",
    "/* all of\n it */ soma none 0 0 0 20 // a sphere\ndend soma 0 10 0 2 Na 12.5 K -3e-9\r\ndend_1 . 0 20 0 "
    "2\n"
    "dend_2 . 3 24 0 1\n\n*relative\ndend_3 dend_1 -3 4 0 1",
    "*relative\n*polar\nsoma none 0 0 0 20\ndend soma 10 90 90 2\ndend_1 . 10 90 90 2\n"
    "dend_2 . 5 90 53.13010235415598 1\ndend_3 dend_1 5 90 126.86989764584402 1\n",
    "*double_endpoint\n*spherical\nsoma none 0 0 0 0 0 0 20\n*cylindrical\ndend soma 0 0 0 0 10 0 2\n"
    "dend_1 dend 0 10 0 0 20 0 2\n*double_endpoint_off\ndend_2 . 3 24 0 1\ndend_3 dend_1 -3 24 0 1\n",
    "*relative\n*symmetric\n*set_global RM 0.3\nsoma none 0 0 0 20\n*compt /library/x\ndend soma 0 10 0 2\n"
    "dend_1 . 0 10 0 2\n*lambda_warn 0.01 0.2\ndend_2 . 3 4 0 1\ndend_3 dend_1 -3 4 0 1\n"};

TEST(Genesis, EveryModeTellsTheSameCell) {
  for (const std::string_view text : told) {
    SCOPED_TRACE(text);
    const Morphology m = cell(std::string(text));
    EXPECT_EQ(m.soma().kind, SomaKind::sphere);
    EXPECT_FLOAT_EQ(m.soma().sphere().radius, 10.f);
    ASSERT_EQ(m.sections().size(), 3u);
    EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::basal);
    EXPECT_EQ(m.section(SectionId(0)).soma_point, 0);
    EXPECT_EQ(m.points(SectionId(0)).size(), 3u);
    EXPECT_EQ(m.children(SectionId(0)).size(), 2u);
    EXPECT_NEAR(section_length(m, SectionId(0)), 20., 1e-5);
    EXPECT_NEAR(total_length(m), 30., 1e-5);
    EXPECT_NEAR(total_area(m), std::numbers::pi * (20. * 2. + 10. * 1.), 1e-4);
    EXPECT_NEAR(m.points(SectionId(1)).back().x, 3., 1e-5);
    EXPECT_NEAR(m.points(SectionId(2)).back().y, 24., 1e-5);
  }
}

TEST(Genesis, ACompartmentNamedSomaIsACylinderWithItsNeuritesAtItsEnds) {
  const auto [m, warnings] = read_genesis(
      "*relative\nbasal_2 none 0 20 0 2\nbasal_1 . 0 10 0 3\nside basal_2 5 0 0 1\nsoma basal_1 0 12 0 8\n"
      "apical soma 0 50 0 4\naxon soma 9 0 0 1\n",
      "cell.p");
  EXPECT_EQ(m.soma().kind, SomaKind::cylinders);
  EXPECT_NEAR(m.soma().area(), std::numbers::pi * 8. * 12., 1e-4);
  ASSERT_EQ(m.roots().size(), 3u);
  std::vector<std::int32_t> places;
  for (const SectionId root : m.roots()) places.push_back(m.section(root).soma_point);
  std::ranges::sort(places);
  EXPECT_EQ(places, (std::vector<std::int32_t>{0, 1, 1}));
  EXPECT_NEAR(total_length(m), 20. + 10. + 5. + 50. + 9., 1e-5);
  const auto turned = std::ranges::find(warnings, "soma-inside", &Warning::code);
  ASSERT_NE(turned, warnings.end());
  // The dendrite that led to the soma leads away from it now, and its daughter hangs where it hung.
  for (std::size_t i = 0; i < m.sections().size(); ++i)
    if (const Section& s = m.sections()[i]; s.kind == SectionKind::basal && !s.parent.valid()) {
      EXPECT_FLOAT_EQ(m.points(SectionId(i)).front().y, 30.f);
      EXPECT_FLOAT_EQ(m.points(SectionId(i)).back().y, 20.f);
      EXPECT_EQ(m.children(SectionId(i)).size(), 2u);
    }
}

TEST(Genesis, NamesTellTheKinds) {
  const std::pair<std::string_view, SectionKind> names[] = {
      {"apical_10", SectionKind::apical},  {"Apic[3]", SectionKind::apical},
      {"apdend1", SectionKind::apical},    {"primary_dend", SectionKind::basal},
      {"basal_8", SectionKind::basal},     {"den[2]", SectionKind::basal},
      {"axon_hillock", SectionKind::axon}, {"iseg", SectionKind::axon},
      {"Myelin4", SectionKind::axon},      {"main[0]", SectionKind::undefined}};
  for (const auto& [name, kind] : names) {
    EXPECT_EQ(genesis_name(name).kind, kind) << name;
    EXPECT_FALSE(genesis_name(name).soma);
  }
  EXPECT_TRUE(genesis_name("Soma_2").soma);
  const Morphology m = cell("soma none 0 0 0 9\nglom soma 0 9 0 1\napic1 glom 0 19 0 1\nx apic1 0 29 0 1\n");
  ASSERT_EQ(m.sections().size(), 2u);
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::undefined);
  EXPECT_EQ(m.section(SectionId(1)).kind, SectionKind::apical);  // and x like its parent
}

struct Oddly {
  std::string_view code;
  std::size_t line;
  std::string text;
};
const Oddly oddly[] = {
    {"parameters", 1, "*set_compt_param RM 1\nsoma none 0 0 0 9\n"},
    {"prototypes", 1, "*compt /library/a\nsoma none 0 0 0 9\n"},
    {"spine-options", 2, "soma none 0 0 0 9\n*rand_spines 3 13 1 7 1 /library/s\n"},
    {"unknown-option", 1, "*hexagonal\nsoma none 0 0 0 9\n"},
    {"channels", 1, "soma none 0 0 0 9 Na 1\n"},
    {"unknown-diameter", 2, "soma none 0 0 0 9\nd soma 0 9 0 nan\n"},
    {"missing-parent", 2, "soma none 0 0 0 9\nd e 0 9 0 1\n"},
    {"duplicate-name", 3, "soma none 0 0 0 9\nd soma 0 9 0 1\nd d 0 19 0 1\n"},
    {"several-roots", 2, "soma none 0 0 0 9\nd none 0 9 0 1\n"},
    {"several-somata", 3, "soma none 0 0 0 9\nd soma 0 9 0 1\nsoma2 d 0 19 0 9\n"},
    {"soma-inside", 1, "d none 0 9 0 1\nsoma d 0 19 0 9\n"},
    {"sphere-outside", 4, "soma none 0 0 0 9\nd soma 0 9 0 1\n*spherical\nhead d 0 9.5 0 1\n"},
    {"gap", 3, "soma none 0 0 0 9\n*double_endpoint\nd soma 0 4 0 0 9 0 1\ne d 0 5 0 5 5 0 1\n"},
    {"unknown-kind", 2, "soma none 0 0 0 9\nglom soma 0 9 0 1\n"},
    {"stale-diameters", 4,
     std::string(genesis_marker) + "\n*double_endpoint\n//@ends 1 2\ndend_0_1 none 0 0 0 0 9 0 7\n"},
    {"open-comment", 2, "soma none 0 0 0 9\n/* no end"},
    {"byte-order-mark", 1, "\xef\xbb\xbfsoma none 0 0 0 9\n"},
    {"padding", 0, "soma none 0 0 0 9\n\x1a"},
    {"several-cells", 0, "soma none 0 0 0 9\n*start_cell /b\nsoma none 0 0 0 5\n"},
    {"names-not-kept", 2, "*relative\nsoma none 0 0 0 9\n"},
};

TEST(Genesis, DeviationsAreReadAndToldWithTheirLine) {
  for (const Oddly& odd : oddly) {
    SCOPED_TRACE(odd.code);
    const auto [m, warnings] = read_genesis(odd.text, "cell.p");
    const auto found = std::ranges::find(warnings, odd.code, &Warning::code);
    ASSERT_NE(found, warnings.end());
    EXPECT_EQ(found->line, odd.code == "gap" ? 4 : odd.line);
  }
  for (const Oddity& row : genesis_oddities())
    EXPECT_TRUE(row.code == "no-length" ||
                std::ranges::find(oddly, row.code, &Oddly::code) != std::end(oddly))
        << row.code;
}

TEST(Genesis, CommentsBehindCompartmentsAndOptionsWithoutShapeAreKept) {
  const Annotations expected{
      {"genesis", "*symmetric"}, {"comment", "the cell body"}, {"genesis", "*lambda_warn 0.01 0.2"}};
  EXPECT_EQ(cell("*symmetric\nsoma none 0 0 0 9 // the cell body\n*lambda_warn 0.01 0.2\n").annotations(),
            expected);
  const Morphology ours = cell("soma none 0 0 0 9\n");
  EXPECT_TRUE(read_genesis(write_genesis(ours), "ours").warnings.empty());
}

TEST(Genesis, WhatHasNoReadingIsRefusedWithItsLine) {
  const std::pair<std::size_t, std::string> broken[] = {
      {0, "// nothing\n"},
      {2, "soma none 0 0 0 9\nd soma 0 9 0\n"},
      {2, "soma none 0 0 0 9\nd soma 0 nine 0 1\n"},
      {1, "soma none 0 {y} 0 9\n"},
      {2, "*relative\nsoma none 1e39 0 0 9\n"},
      {2, "*double_endpoint\nsoma none 0 0 0 9\n"},
      {0, std::string("soma none 0\0 0 0 9\n", 19)},
  };
  for (const auto& [line, text] : broken) {
    SCOPED_TRACE(text);
    try {
      cell(text);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), line);
    }
  }
}

TEST(Genesis, CellsOfOneFileAreApartAndPrototypesAreNone) {
  const std::vector<Cell> cells = read_genesis_cells(
      "*relative\n*start_cell /library/spine\nneck none 0 1 0 .1\n*makeproto /library/spine\n*start_cell\n"
      "soma none 0 0 0 9\nd soma 0 9 0 1\n*start_cell /two\nsoma none 0 0 0 5\nd soma 0 7 0 1\n",
      "cells.p");
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells[1].name, "/two");
  EXPECT_EQ(std::ranges::count(cells[0].read.warnings, std::string_view("prototypes"), &Warning::code), 1);
  EXPECT_NEAR(total_length(cells[0].read.morphology), 9., 1e-6);
  EXPECT_NEAR(total_length(cells[1].read.morphology), 7., 1e-6);
}

TEST(Genesis, WhatIsSaidOfACellIsItsOwn) {
  const std::vector<Cell> cells = read_genesis_cells(
      "// of both\n*start_cell /library/s\n*compt /library/x\nneck none 0 1 0 .1\n*makeproto /library/s\n"
      "*start_cell /one\n// the first\n*set_global RM 1\nsoma none 0 0 0 9 Na 1\n*rand_spines 3 13 1 7 1 /x\n"
      "*start_cell /two\n// the second\n*set_global RM 2\nsoma none 0 0 0 5\n",
      "cells.p");
  ASSERT_EQ(cells.size(), 2u);
  const Annotations outside{
      {"comment", "of both"}, {"genesis", "*compt /library/x"}, {"genesis", "*makeproto /library/s"}};
  Annotations one = outside, two = outside;
  one.insert(one.end(), {{"comment", "the first"},
                         {"genesis", "*set_global RM 1"},
                         {"channels", "soma Na 1"},
                         {"genesis", "*rand_spines 3 13 1 7 1 /x"}});
  // Parameters hold for the lines below, of whatever cell.
  two.insert(two.end(),
             {{"genesis", "*set_global RM 1"}, {"comment", "the second"}, {"genesis", "*set_global RM 2"}});
  EXPECT_EQ(cells[0].read.morphology.annotations(), one);
  EXPECT_EQ(cells[1].read.morphology.annotations(), two);
}

/// What GENESIS computes of a written file: cylinders by their diameter, spheres where there is no length.
struct Membrane {
  double area = 0., length = 0.;
};
Membrane membrane(const std::string& bytes) {
  Membrane sum;
  std::size_t begin = 0;
  while (begin < bytes.size()) {
    const std::size_t end = bytes.find('\n', begin);
    const std::string line = bytes.substr(begin, end - begin);
    begin = end + 1;
    char name[100], parent[100];
    double x[7];
    if (std::sscanf(line.c_str(), "%99s %99s %lf %lf %lf %lf %lf %lf %lf", name, parent, x, x + 1, x + 2,
                    x + 3, x + 4, x + 5, x + 6) != 9)
      continue;
    const double length = std::hypot(x[3] - x[0], x[4] - x[1], x[5] - x[2]);
    sum.area += std::numbers::pi * x[6] * (length > 0. ? length : x[6]);
    if (std::string_view(name).substr(0, 4) != "soma") sum.length += length;
  }
  return sum;
}

TEST(Genesis, TheWrittenCellHasTheMeasuredMembrane) {
  for (const Specimen& specimen : zoo()) {
    if (specimen.name == "numbers at the ends of their range") continue;
    SCOPED_TRACE(specimen.name);
    const Morphology m = as_kept(specimen.morphology, genesis_keeps);
    const Membrane found = membrane(write_genesis(specimen.morphology));
    EXPECT_NEAR(found.length, total_length(m), 1e-7 * found.length);
    EXPECT_NEAR(found.area, total_area(m) + m.soma().area(), 1e-6 * found.area);
  }
}

TEST(Genesis, ADiameterChangedByHandIsRead) {
  std::string text = write_genesis(zoo_parts::binary_tree(1));
  const std::size_t at = text.rfind("\ndend_2_1 "), end = text.find('\n', at + 1);
  const std::size_t diameter = text.rfind(' ', end);
  text.replace(diameter, end - diameter, " 7");
  const auto [m, warnings] = read_genesis(text, "cell.p");
  EXPECT_FLOAT_EQ(m.points(SectionId(2)).back().radius, 3.5f);
}

TEST(GenesisRealData, EverySampleIsReadAndComesBack) {
  FOREST_REAL_DATA(folder, "genesis");
  std::size_t count = 0;
  for (const auto& path : files_below(folder, ".p")) {
    SCOPED_TRACE(path.filename().string());
    const Morphology m = read_genesis(MappedFile(path).text(), path.string()).morphology;
    EXPECT_NE(m.soma().kind, SomaKind::none);
    EXPECT_TRUE(recognises_genesis(MappedFile(path).text()));
    const Morphology back = cell(write_genesis(m));
    EXPECT_EQ(back, as_kept(m, genesis_keeps));
    EXPECT_EQ(back.annotations(), m.annotations());
    const Morphology through_swc = read_swc(write_swc(m), "cell.swc").morphology;
    EXPECT_EQ(through_swc.sections().size(), m.sections().size());
    EXPECT_NEAR(total_length(through_swc), total_length(m), 1e-6 * total_length(m));
    ++count;
  }
  EXPECT_GE(count, 10u);
}

TEST(GenesisRealData, EveryTracedNeuronComesBack) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  for (const auto& path : files_below(folder, ".swc")) {
    SCOPED_TRACE(path.filename().string());
    const Morphology m = read_swc(MappedFile(path).text(), path.string()).morphology;
    const std::string bytes = write_genesis(m);
    const Morphology back = cell(bytes);
    ASSERT_EQ(back.sections().size(), m.sections().size());
    EXPECT_NEAR(total_length(back), total_length(m), 1e-6 * total_length(m) + 1e-5);
    EXPECT_NEAR(total_area(back), total_area(as_kept(m, genesis_keeps)), 1e-6 * total_area(m) + 1e-4);
    EXPECT_EQ(back.annotations(), m.annotations());
    for (std::size_t i = 0; i < m.sections().size(); ++i) {
      ASSERT_EQ(back.sections()[i].parent, m.sections()[i].parent);
      ASSERT_EQ(back.sections()[i].tag, m.sections()[i].tag);
    }
  }
}

}  // namespace
}  // namespace forest::io
