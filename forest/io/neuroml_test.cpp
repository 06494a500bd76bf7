// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/keeps.h"
#include "forest/io/neuron.h"
#include "forest/io/soma_place.h"
#include "forest/io/swc.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

bool told(const ReadResult& result, std::string_view code) {
  return std::ranges::find(result.warnings, code, &Warning::code) != result.warnings.end();
}

std::string in_cell(const std::string& morphology) {
  return "<neuroml xmlns=\"http://www.neuroml.org/schema/neuroml2\" id=\"n\">\n<cell id=\"c\"><morphology "
         "id=\"m\">\n" +
         morphology + "\n</morphology></cell></neuroml>\n";
}
std::string segment(int id, int parent, const std::string& ends, const std::string& more = "") {
  return "<segment id=\"" + std::to_string(id) + "\">" +
         (parent < 0 ? "" : "<parent segment=\"" + std::to_string(parent) + "\"" + more + "/>") + ends +
         "</segment>\n";
}
std::string from(const std::string& x, const std::string& d = "2") {
  return "<proximal x=\"" + x + "\" y=\"0\" z=\"0\" diameter=\"" + d + "\"/>";
}
std::string to(const std::string& x, const std::string& d = "2") {
  return "<distal x=\"" + x + "\" y=\"0\" z=\"0\" diameter=\"" + d + "\"/>";
}

ReadResult read_text(const std::string& text) { return read_neuroml(text, "cell"); }

TEST(Neuroml, SegmentsBecomeSectionsAndABallASoma) {
  const ReadResult result =
      read_text(in_cell(segment(0, -1, from("0", "10") + to("0", "10")) +
                        segment(1, 0, from("5") + to("15")) + segment(2, 1, to("25", "1")) +
                        segment(3, 2, to("30", "1")) + segment(4, 2, from("25", "3") + to("20")) +
                        "<segmentGroup id=\"soma_group\"><member segment=\"0\"/></segmentGroup>"
                        "<segmentGroup id=\"x\" neuroLexId=\"sao1770195789\"><subTree><from "
                        "segment=\"4\"/></subTree></segmentGroup>"
                        "<segmentGroup id=\"dendrite_group\"><path><from segment=\"1\"/><to "
                        "segment=\"3\"/></path></segmentGroup>"));
  EXPECT_TRUE(result.warnings.empty()) << result.warnings[0].sentence;
  const Morphology& m = result.morphology;
  EXPECT_EQ(m.soma().kind, SomaKind::sphere);
  EXPECT_FLOAT_EQ(m.soma().sphere().radius, 5.f);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.points(SectionId(0)).size(), 3u);
  EXPECT_EQ(m.section(SectionId(0)).soma_point, 0);
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::basal);
  EXPECT_EQ(m.section(SectionId(2)).kind, SectionKind::axon);
  EXPECT_FLOAT_EQ(m.points(SectionId(2))[0].radius, 1.5f);
  EXPECT_NEAR(total_length(m), 30., 1e-6);
}

TEST(Neuroml, AChildAtAFractionOfTheSomaHangsThere) {
  const auto at = [](const char* fraction) { return " fractionAlong=\"" + std::string(fraction) + "\""; };
  const ReadResult result =
      read_text(in_cell(segment(0, -1, from("0", "8") + to("10", "4")) + segment(1, 0, to("20"), at("0.5")) +
                        segment(2, 0, to("30"), at("0.5")) + segment(3, 0, to("40"), at("0.75")) +
                        segment(4, 0, to("50"), at("0")) + segment(5, 0, to("60")) +
                        "<segmentGroup id=\"soma_group\"><member segment=\"0\"/></segmentGroup>"));
  EXPECT_TRUE(result.warnings.empty());
  const Morphology& m = result.morphology;
  ASSERT_EQ(m.soma().kind, SomaKind::cylinders);
  ASSERT_EQ(m.soma().points.size(), 4u);
  EXPECT_EQ(m.soma().points[1], (Point{5, 0, 0, 3}));
  EXPECT_NEAR(m.soma().area(),
              read_text(in_cell(segment(0, -1, from("0", "8") + to("10", "4")) +
                                "<segmentGroup id=\"soma_group\"><member "
                                "segment=\"0\"/></segmentGroup>"))
                  .morphology.soma()
                  .area(),
              1e-4);
  const std::int32_t places[] = {1, 1, 2, 0, 3};
  ASSERT_EQ(m.sections().size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(m.section(SectionId(i)).soma_point, places[i]) << i;
  EXPECT_NE(write_neuron_hoc(m).find("connect dend_0[0](0), soma[0](0.5)"), std::string::npos);
  EXPECT_EQ(read_text(write_neuroml(m)).morphology, m);
}

TEST(Neuroml, AChildAtAFractionSplitsItsParent) {
  const ReadResult result = read_text(
      in_cell(segment(0, -1, from("0") + to("10", "4")) + segment(1, 0, to("20"), " fractionAlong=\"0.25\"") +
              segment(2, 0, to("30"), " fractionAlong=\"0.75\"") + segment(3, 0, to("11"))));
  const Morphology& m = result.morphology;
  ASSERT_EQ(m.sections().size(), 5u);  // two pieces, the last with its continuation, and two children
  EXPECT_EQ(m.roots().size(), 1u);
  EXPECT_FLOAT_EQ(m.points(SectionId(0)).back().x, 2.5f);
  EXPECT_FLOAT_EQ(m.points(SectionId(0)).back().radius, 1.25f);
  EXPECT_EQ(m.children(SectionId(0)).size(), 2u);
  EXPECT_NEAR(total_length(m), 10. + 17.5 + 22.5 + 1., 1e-5);
  // At 0 it hangs where its parent begins.
  const Morphology at_begin =
      read_text(in_cell(segment(0, -1, from("0") + to("10")) + segment(1, 0, to("20")) +
                        segment(2, 1, to("30"), " fractionAlong=\"0\"")))
          .morphology;
  EXPECT_EQ(at_begin.sections().size(), 3u);
  EXPECT_NEAR(total_length(at_begin), 40., 1e-5);
}

TEST(Neuroml, DeviationsAreReadAndTold) {
  const std::string stem = segment(0, -1, from("0") + to("10"));
  const std::map<std::string_view, std::string> cases{
      {"duplicate-id", in_cell(stem + segment(0, -1, from("0") + to("9")))},
      {"missing-parent", in_cell(stem + segment(1, 7, from("0") + to("9")))},
      {"child-first", in_cell(segment(1, 0, to("20")) + stem)},
      {"several-roots", in_cell(stem + segment(1, -1, from("0") + to("9")))},
      {"missing-proximal", in_cell(segment(0, -1, to("9")))},
      {"unknown-number", in_cell(stem + segment(1, 0, to("NaN")))},
      {"diameter", in_cell(stem + segment(1, 0, to("20", "-1")))},
      {"zero-diameter", in_cell(stem + segment(1, 0, to("20", "0")))},
      {"several-documents", in_cell(stem) + in_cell(stem)},
      {"fraction", in_cell(stem + segment(1, 0, to("20"), " fractionAlong=\"1.5\""))},
      {"gap", in_cell(stem + segment(1, 0, from("12") + to("20")))},
      {"several-somata",
       in_cell("<segment id=\"0\" name=\"soma\">" + from("0") + to("1") +
               "</segment><segment id=\"1\" name=\"soma\">" + from("5") + to("6") + "</segment>")},
      {"soma-inside-neurite",
       in_cell(stem + "<segment id=\"1\" name=\"soma\"><parent segment=\"0\"/>" + to("12") + "</segment>")},
      {"group", in_cell(stem + "<segmentGroup id=\"axon\"><member segment=\"5\"/></segmentGroup>")},
      {"groups-not-kept",
       in_cell(stem + "<segmentGroup id=\"input\"><member segment=\"0\"/></segmentGroup>")},
      {"include",
       "<neuroml><include href=\"x.nml\"/><morphology id=\"m\">" + stem + "</morphology></neuroml>"},
      {"not-kept", "<neuroml><ionChannel id=\"x\"/><morphology id=\"m\">" + stem + "</morphology></neuroml>"},
      {"several-cells", "<neuroml><morphology id=\"m\">" + stem + "</morphology><morphology id=\"o\">" +
                            stem + "</morphology></neuroml>"},
      {"names-not-kept",
       in_cell("<segment id=\"0\" name=\"oblique_7\">" + from("0") + to("10") + "</segment>")},
      {"morphology-elsewhere",
       "<neuroml><cell id=\"a\" morphology=\"b\"/><morphology id=\"m\">" + stem + "</morphology></neuroml>"},
  };
  for (const auto& [code, text] : cases) {
    SCOPED_TRACE(code);
    const ReadResult result = read_text(text);
    EXPECT_TRUE(told(result, code));
    for (const Warning& warning : result.warnings) {
      EXPECT_TRUE(warning.code == code || warning.code == "several-roots" || warning.code == "names-not-kept")
          << warning.sentence;
    }
  }
  for (const Oddity& oddity : neuroml_oddities()) EXPECT_TRUE(cases.contains(oddity.code)) << oddity.code;
}

TEST(Neuroml, WhatCannotBeReadIsRefusedWithItsLine) {
  const auto refusal = [](const std::string& text) -> std::pair<std::size_t, std::string> {
    try {
      read_text(text);
      return {0, ""};
    } catch (const InputError& error) {
      return {error.line(), error.sentence()};
    }
  };
  const auto expect = [&](const std::string& text, std::size_t line, std::string_view part) {
    const auto [at, sentence] = refusal(text);
    EXPECT_EQ(at, line) << sentence;
    EXPECT_NE(sentence.find(part), std::string::npos) << sentence;
  };
  expect("<neuroml>\n<cell>\n</neuroml>\n", 3, "is not XML");
  expect("<things/>", 1, "not <neuroml>");
  expect("<neuroml xmlns=\"http://morphml.org/neuroml/schema\"/>", 1, "NeuroML 1");
  expect("<neuroml><cell id=\"a\" morphology=\"b\"/></neuroml>", 0, "in another file");
  expect("<neuroml><network id=\"a\"/></neuroml>", 0, "no cell with a morphology");
  expect(in_cell(""), 2, "no segment");
  expect(in_cell(segment(0, -1, from("0"))), 3, "no distal point");
  expect(in_cell(segment(0, -1, from("0") + to("one"))), 3, "x = \"one\", which is no number");
  expect(in_cell(segment(0, 1, to("0")) + segment(1, 0, to("1"))), 3, "its own ancestor");
  expect(in_cell(segment(-5, -1, from("0") + to("1"))), 3, "whole number");
}

TEST(Neuroml, DeepFilesNeedNoStack) {
  std::string deep, chain;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_THROW(read_text(deep), InputError);
  for (int i = 0; i < 100'000; ++i)
    chain += segment(i, i - 1, (i ? "" : from("0")) + to(std::to_string(i + 1)));
  EXPECT_EQ(read_text(in_cell(chain)).morphology.points().size(), 100'001u);
  std::string rings;
  for (int i = 0; i < 2000; ++i)
    rings += "<segmentGroup id=\"g" + std::to_string(i) + "\"><include segmentGroup=\"g" +
             std::to_string((i + 1) % 2000) + "\"/><member segment=\"0\"/></segmentGroup>";
  EXPECT_EQ(read_text(in_cell(segment(0, -1, from("0") + to("1")) + rings)).morphology.sections().size(), 1u);
}

/// What the schema says of order, ids and numbers where we write.
void expect_valid(const std::string& text) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(text.c_str()));
  const auto id = [](std::string_view s) {
    return !s.empty() && (std::isalpha(s[0]) || s[0] == '_') &&
           std::ranges::all_of(s, [](char c) { return std::isalnum(c) || c == '_'; });
  };
  const auto in_order = [](const pugi::xml_node& node, std::initializer_list<std::string_view> names) {
    auto at = names.begin();
    for (const pugi::xml_node& child : node.children()) {
      while (at != names.end() && *at != child.name()) ++at;
      EXPECT_NE(at, names.end()) << child.name() << " in " << node.name();
    }
  };
  const auto cell = document.child("neuroml").child("cell");
  EXPECT_TRUE(id(document.child("neuroml").attribute("id").value()));
  EXPECT_TRUE(id(cell.attribute("id").value()));
  in_order(cell, {"notes", "property", "morphology"});
  std::set<int> segments;
  std::set<std::string> groups;
  const auto morphology = cell.child("morphology");
  in_order(morphology, {"segment", "segmentGroup"});
  for (const auto& node : morphology.children("segment")) {
    in_order(node, {"parent", "proximal", "distal"});
    EXPECT_TRUE(segments.insert(node.attribute("id").as_int(-1)).second);
    EXPECT_TRUE(!node.child("parent") ||
                segments.contains(node.child("parent").attribute("segment").as_int(-1)));
    for (const char* end : {"proximal", "distal"})
      if (node.child(end)) {
        EXPECT_GT(std::stod(node.child(end).attribute("diameter").value()), 0.);
      }
  }
  for (const auto& node : morphology.children("segmentGroup")) {
    in_order(node, {"member", "include"});
    EXPECT_TRUE(id(node.attribute("id").value()) && groups.insert(node.attribute("id").value()).second);
    for (const auto& part : node.children("member"))
      EXPECT_TRUE(segments.contains(part.attribute("segment").as_int(-1)));
    for (const auto& part : node.children("include"))
      EXPECT_TRUE(groups.contains(part.attribute("segmentGroup").value()));
  }
}

/// The neuron with its neurites on the soma points that a writer hangs them on.
Morphology settled(const Morphology& m) {
  const SomaPlaces place(m);
  MorphologyBuilder b;
  b.set_soma(m.soma());
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const Section& s = m.sections()[i];
    b.add_section(s.parent, s.kind, m.points(SectionId(i)), s.tag,
                  s.parent.valid() ? -1 : place(SectionId(i)));
  }
  for (const Spine& spine : m.spines()) b.add_spine(spine);
  return b.build();
}

void expect_round_trip(const Morphology& m, const std::string& name) {
  const std::string text = write_neuroml(m);
  const Morphology again = read_neuroml(text, name).morphology;
  EXPECT_EQ(again, settled(as_kept(m, neuroml_keeps))) << name;
  EXPECT_EQ(write_neuroml(again), text) << name;
}

TEST(Neuroml, WhatIsWrittenIsValidAndComesBack) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    if (specimen.name != "numbers at the ends of their range")
      expect_valid(write_neuroml(specimen.morphology));
    expect_round_trip(specimen.morphology, specimen.name);
    const auto annotations =
        read_neuroml(write_neuroml(specimen.morphology), "cell").morphology.annotations();
    EXPECT_EQ(annotations, specimen.morphology.annotations());
  }
}

TEST(Neuroml, NeuritesOfTracersHangOnTheSomaTheyBeginAt) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.add_section({}, SectionKind::basal, zoo_parts::Points{{0, 6, 0, 1}, {0, 16, 0, 1}});
  b.add_section({}, SectionKind::axon, zoo_parts::Points{{0, 90, 0, 1}, {0, 99, 0, 1}});
  const Morphology read = read_text(write_neuroml(b.build())).morphology;
  ASSERT_EQ(read.roots().size(), 2u);
  EXPECT_EQ(read.sections()[0].soma_point, 0);
  EXPECT_EQ(read.sections()[1].soma_point, -1);  // too far away to be of it
}

TEST(Neuroml, NotesOfTheFileAreKeptWithItsCells) {
  const std::string cell =
      "<morphology id=\"m\">" + segment(0, -1, from("0") + to("9")) + "</morphology></cell>";
  const std::string text =
      "<neuroml><notes> of Doe 1999 </notes><annotation/><cell id=\"a\"><notes>one</notes>" + cell +
      "<cell id=\"b\">" + cell + "</neuroml>";
  const std::vector<Cell> cells = read_all_neuroml(text, "cell");
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells[0].read.morphology.annotations(),
            (Annotations{{"notes", "of Doe 1999"}, {"notes", "one"}}));
  EXPECT_EQ(cells[1].read.morphology.annotations(), (Annotations{{"notes", "of Doe 1999"}}));
  EXPECT_TRUE(told(cells[0].read, "not-kept"));  // the annotation, which no neuron has a place for
  const Morphology again = read_text(write_neuroml(cells[0].read.morphology)).morphology;
  EXPECT_EQ(again.annotations(), cells[0].read.morphology.annotations());
}

TEST(Neuroml, WhatIsLostIsTold) {
  std::set<std::string_view> codes;
  for (const Specimen& specimen : zoo())
    for (const Warning& warning : losses(specimen.morphology, neuroml_keeps)) codes.insert(warning.code);
  EXPECT_EQ(codes, (std::set<std::string_view>{"diameters-lifted", "soma-simplified"}));
}

TEST(NeuromlRealData, CellsOfTheStandardsExamplesAreRead) {
  FOREST_REAL_DATA(folder, "neuroml");
  std::size_t cells = 0;
  for (const auto& path : files_below(folder, ".nml")) {
    SCOPED_TRACE(path.string());
    const MappedFile file(path);
    EXPECT_TRUE(recognises_neuroml(file.text()));
    const bool shaped = file.text().find("<segment ") != std::string_view::npos;
    try {
      for (const Cell& cell : read_all_neuroml(file.text(), path.string())) {
        EXPECT_TRUE(shaped);
        expect_round_trip(cell.read.morphology, path.string());
        ++cells;
      }
    } catch (const InputError& error) {
      EXPECT_FALSE(shaped) << error.what();
    }
  }
  EXPECT_GT(cells, 30u);
  // Ten cells that NEURON's cvapp converted from SWC.
  for (int i = 1; i <= 5; ++i)
    for (const std::string kind : {"new", "orig"}) {
      const std::string stem = "Case" + std::to_string(i) + "_" + kind;
      const Morphology nml =
          read(folder / ("cvapp_cases/caseExamples__NeuroML2__" + stem + ".cell.nml")).morphology;
      const Morphology only =
          read(folder / ("cvapp_cases/caseExamples__NeuroML2__" + stem + "_morphOnly.cell.nml")).morphology;
      const Morphology swc = read(folder / ("cvapp_cases/caseExamples__" + stem + ".swc")).morphology;
      EXPECT_EQ(nml, only) << stem;
      if (stem == "Case1_orig") continue;  // its conversion left the dendrites out
      EXPECT_EQ(nml.sections().size(), swc.sections().size()) << stem;
      EXPECT_NEAR(total_length(nml), total_length(swc), 1e-6 * total_length(swc)) << stem;
      if (kind == "new") {
        EXPECT_NEAR(nml.soma().area(), swc.soma().area(), 1e-6 * swc.soma().area()) << stem;
      }
    }
  const Morphology l23 = read(folder / "smith_l23/L23_morph.cell.nml").morphology;
  EXPECT_EQ(l23.sections().size(), 105u);
  EXPECT_EQ(l23.roots().size(), 5u);
}

}  // namespace
}  // namespace forest::io
