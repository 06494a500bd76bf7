// SPDX-License-Identifier: Apache-2.0
// What is written is parsed by a small reader of Arbor's grammar and held against the neuron.
#include "forest/io/acc.h"

#include <cctype>
#include <charconv>

#include <gtest/gtest.h>

#include "forest/morphology/measure.h"

#include "tests/zoo.h"

namespace forest::io {
namespace {

struct Expression {
  std::string atom;
  std::vector<Expression> list;
  bool is(std::string_view head) const { return !list.empty() && list[0].atom == head; }
};

Expression parse(std::string_view& text) {
  const auto skip = [&] {
    while (!text.empty() && (std::isspace(static_cast<unsigned char>(text[0])) || text[0] == ';'))
      text.remove_prefix(text[0] == ';' ? std::min(text.find('\n'), text.size()) : 1);
  };
  skip();
  Expression e;
  if (text.starts_with('(')) {
    text.remove_prefix(1);
    for (skip(); !text.empty() && text[0] != ')'; skip()) e.list.push_back(parse(text));
    EXPECT_FALSE(text.empty()) << "a bracket is not closed";
    if (!text.empty()) text.remove_prefix(1);
  } else {
    const std::size_t end = std::min(text.find_first_of(" \n()"), text.size());
    e.atom = text.substr(0, end);
    text.remove_prefix(end);
  }
  skip();
  return e;
}

template <class Number>
Number number(const Expression& e) {
  Number value = 0;
  const auto [end, error] = std::from_chars(e.atom.data(), e.atom.data() + e.atom.size(), value);
  EXPECT_TRUE(error == std::errc() && end == e.atom.data() + e.atom.size()) << e.atom;
  return value;
}

struct Segment {
  Point from, to;
  int tag;
};
struct Branch {
  int parent;
  std::vector<Segment> segments;
};

Point point(const Expression& e) {
  EXPECT_TRUE(e.is("point") && e.list.size() == 5);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_NE(e.list[i].atom.find('.'), std::string::npos);
  return {number<float>(e.list[1]), number<float>(e.list[2]), number<float>(e.list[3]),
          number<float>(e.list[4])};
}

/// component: meta-data and one morphology of branches, numbered in order, each of one segment or more.
std::vector<Branch> branches(const std::string& bytes) {
  std::string_view text = bytes;
  const Expression component = parse(text);
  EXPECT_TRUE(text.empty());
  EXPECT_TRUE(component.is("arbor-component") && component.list.size() == 3);
  EXPECT_TRUE(component.list[1].is("meta-data"));
  EXPECT_EQ(component.list[1].list[1].list[1].atom, "\"0.1-dev\"");
  EXPECT_TRUE(component.list[2].is("morphology"));
  std::vector<Branch> found;
  int segments = 0;
  for (std::size_t i = 1; i < component.list[2].list.size(); ++i) {
    const Expression& e = component.list[2].list[i];
    EXPECT_TRUE(e.is("branch") && e.list.size() >= 4);
    EXPECT_EQ(number<int>(e.list[1]), int(found.size()));
    Branch& branch = found.emplace_back();
    branch.parent = number<int>(e.list[2]);
    EXPECT_LT(branch.parent, int(found.size()) - 1);
    for (std::size_t k = 3; k < e.list.size(); ++k) {
      const Expression& s = e.list[k];
      EXPECT_TRUE(s.is("segment") && s.list.size() == 5);
      EXPECT_EQ(number<int>(s.list[1]), segments++);
      branch.segments.push_back({point(s.list[2]), point(s.list[3]), number<int>(s.list[4])});
    }
  }
  return found;
}

TEST(Acc, HasTheBranchesLengthsAreasAndJointsOfTheNeuron) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology m = as_kept(specimen.morphology, acc_keeps);
    const std::vector<Branch> found = branches(write_acc(specimen.morphology));
    double length = 0., area = 0., soma_area = 0.;
    std::size_t neurites = 0;
    for (const Branch& branch : found) {
      const bool soma = branch.segments[0].tag == 1;
      neurites += !soma;
      for (std::size_t k = 0; k < branch.segments.size(); ++k) {
        const Segment& s = branch.segments[k];
        if (k > 0) {
          EXPECT_EQ(s.from, branch.segments[k - 1].to);
        }
        (soma ? soma_area : area) += segment_area(s.from, s.to);
        length += soma ? 0. : segment_length(s.from, s.to);
      }
      if (branch.parent < 0) continue;
      const Segment& end = found[std::size_t(branch.parent)].segments.back();
      if ((end.tag == 1) == soma) {
        EXPECT_EQ(branch.segments[0].from.position(), end.to.position());
      }
    }
    EXPECT_EQ(neurites, m.sections().size());
    EXPECT_NEAR(length, total_length(m), 1e-9 * length);
    EXPECT_NEAR(area, total_area(m), 1e-9 * area);
    EXPECT_NEAR(soma_area, m.soma().area(), 1e-6 * soma_area);
  }
}

TEST(Acc, ASphereFarFromTheOriginKeepsItsArea) {
  MorphologyBuilder b;
  b.set_soma({.kind = SomaKind::sphere,
              .points = {{-14881.317f, 11789.978f, -8017.575f, .311f}},
              .parents = {},
              .contour_starts = {}});
  const Morphology m = b.build();
  double area = 0.;
  for (const Branch& branch : branches(write_acc(m)))
    area += segment_area(branch.segments[0].from, branch.segments[0].to);
  EXPECT_NEAR(area, m.soma().area(), 1e-6 * area);
}

TEST(Acc, NeuritesLeaveFromTheMiddleOfASphere) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.add_section({}, SectionKind::apical, zoo_parts::Points{{0, 5, 0, 1}, {0, 25, 0, 1}}, 4, 0);
  b.annotate("species", "rat\n(brown)");
  const std::string bytes = write_acc(b.build());
  EXPECT_TRUE(bytes.starts_with("; species rat (brown)\n"));
  const std::vector<Branch> found = branches(bytes);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].segments[0].to, (Point{0, 0, 0, 5}));
  EXPECT_EQ(found[2].parent, 0);
  EXPECT_EQ(found[2].segments[0].tag, 4);
}

}  // namespace
}  // namespace forest::io
