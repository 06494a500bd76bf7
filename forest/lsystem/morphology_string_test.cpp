// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/morphology_string.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"
#include "forest/lsystem/grow.h"

#include "tests/zoo.h"

namespace forest::lsystem {
namespace {

// Equal to the last bit: operator== takes 0 and -0 for the same.
bool same_bits(const Morphology& a, const Morphology& b) {
  const auto same = [](std::span<const Point> p, std::span<const Point> q) {
    return p.size() == q.size() && (p.empty() || std::memcmp(p.data(), q.data(), p.size_bytes()) == 0);
  };
  return a == b && same(a.points(), b.points()) && same(a.soma().points, b.soma().points);
}

float any_float() {
  const auto bits = *rc::gen::arbitrary<std::uint32_t>();
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return std::isfinite(value) ? value : 1.f / 3.f;
}
Point any_point() { return {any_float(), any_float(), any_float(), std::abs(any_float())}; }

// A neuron of any shape: sections in any parent-first order, any kinds, tags, floats, somata and spines.
Morphology any_neuron() {
  MorphologyBuilder builder;
  Soma soma{.kind = *rc::gen::elementOf(
                std::vector{SomaKind::none, SomaKind::sphere, SomaKind::cylinders, SomaKind::contours}),
            .points = {},
            .parents = {},
            .contour_starts = {}};
  const int points = soma.kind == SomaKind::none     ? 0
                     : soma.kind == SomaKind::sphere ? 1
                                                     : *rc::gen::inRange(3, 8);
  for (int i = 0; i < points; ++i) {
    soma.points.push_back(any_point());
    if (soma.kind == SomaKind::cylinders) soma.parents.push_back(i == 0 ? -1 : *rc::gen::inRange(0, i));
  }
  if (soma.kind == SomaKind::contours) soma.contour_starts = {0, std::uint32_t(*rc::gen::inRange(1, points))};
  builder.set_soma(soma);
  const auto sections = *rc::gen::inRange<std::size_t>(0, 20);
  const std::vector kinds{SectionKind::undefined, SectionKind::axon,   SectionKind::basal,
                          SectionKind::apical,    SectionKind::custom, SectionKind::unspecified,
                          SectionKind::glia};
  std::vector<Point> ends;
  for (std::size_t i = 0; i < sections; ++i) {
    const auto parent = *rc::gen::inRange<std::size_t>(0, i + 1);  // i: a root
    std::vector<Point> line;
    if (parent < i) line.push_back(ends[parent]), line[0].radius = std::abs(any_float());
    const int more = *rc::gen::inRange(1, 5);
    for (int k = 0; k < more; ++k) line.push_back(any_point());
    ends.push_back(line.back());
    const bool plain = *rc::gen::arbitrary<bool>();
    const SectionKind kind = *rc::gen::elementOf(kinds);
    builder.add_section(parent < i ? SectionId(parent) : SectionId(), kind, line,
                        plain ? std::int32_t(kind) : *rc::gen::arbitrary<std::int32_t>(),
                        plain ? -1 : *rc::gen::inRange(-1, 9));
  }
  const int spines = sections ? *rc::gen::inRange(0, 5) : 0;
  for (int i = 0; i < spines; ++i)
    builder.add_spine({.section = SectionId(*rc::gen::inRange<std::size_t>(0, sections)),
                       .position = any_float(),
                       .head = {any_float(), any_float(), any_float()},
                       .head_diameter = any_float(),
                       .neck_diameter = any_float(),
                       .shape = SpineShape(*rc::gen::inRange(0, 6))});
  return builder.build();
}

RC_GTEST_PROP(MorphologyString, IsReadBackBitForBit, ()) {
  const Morphology m = any_neuron();
  const std::string text = to_string(m);
  const Morphology back = morphology_from_string(text);
  RC_ASSERT(same_bits(back, m));
  RC_ASSERT(to_string(back) == text);
}

TEST(MorphologyString, HoldsEverySpecimenOfTheZoo) {
  for (const Specimen& specimen : zoo())
    EXPECT_TRUE(same_bits(morphology_from_string(to_string(specimen.morphology)), specimen.morphology))
        << specimen.name;
}

TEST(MorphologyString, HoldsGrownNeurons) {
  for (const char* name : {"motoneuron", "purkinje", "pyramidal"}) {
    const Grammar g = parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/" + name + ".lsys");
    const Morphology m = grow(g, 4, 2);
    EXPECT_TRUE(same_bits(morphology_from_string(to_string(m)), m)) << name;
  }
}

TEST(MorphologyString, IsWhatTheHeaderShows) {
  MorphologyBuilder b;
  b.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 5}}, .parents = {}, .contour_starts = {}});
  const auto stem = b.add_section({}, SectionKind::apical, std::vector<Point>{{0, 5, 0, 2}, {0, 15, 0, 1}});
  b.add_section(stem, SectionKind::apical, std::vector<Point>{{0, 15, 0, 1}, {3, 19, 0, 1}});
  b.add_section(stem, SectionKind::apical, std::vector<Point>{{0, 15, 0, .5f}, {-3, 19, 0, .5f}});
  b.add_spine({.section = SectionId(2),
               .position = 2.5f,
               .head = {.4f, 0, .3f},
               .head_diameter = .5f,
               .neck_diameter = .1f,
               .shape = SpineShape::mushroom});
  const char* text =
      "[sphere P(0,0,0,5)]\n[apical P(0,5,0,2) P(0,15,0,1)\n [apical P(0,15,0,1) P(3,19,0,1)]\n"
      " [apical P(0,15,0,0.5) P(-3,19,0,0.5) Spine(2.5,0.4,0,0.3,0.5,0.1,3)]]\n";
  EXPECT_EQ(to_string(b.build()), text);
}

TEST(MorphologyString, LongChainsOfSectionsNeedNoStack) {
  MorphologyBuilder b;
  SectionId last;
  for (int i = 0; i < 20000; ++i)
    last = b.add_section(last, SectionKind::axon,
                         std::vector<Point>{{float(i), 0, 0, 1}, {float(i + 1), 0, 0, 1}});
  const Morphology m = b.build();
  EXPECT_TRUE(same_bits(morphology_from_string(to_string(m)), m));
}

TEST(MorphologyString, CutOffAnywhereIsAValueOrASentence) {
  const Grammar g = parse("axiom: Soma(9) Basal f(4) F(3) [+F F][-F]\np: A -> B\nangle: 30\n", "small");
  const std::string text = to_string(grow(g, 1, 1));
  for (std::size_t length = 0; length < text.size(); ++length) {
    try {
      morphology_from_string(text.substr(0, length), "cut");
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("cut:"), std::string::npos);
    }
  }
}

TEST(MorphologyString, ErrorsNameLineAndColumn) {
  const std::pair<const char*, const char*> table[] = {
      {"[basal P(0,0,0,1)\n P(1,0,x,1)]", "s:2: column 8: a number is missing"},
      {"[basal P(0,0,0,1) P(1,0,0,1)", "not closed"},
      {"]", "closes nothing"},
      {"[dendrite P(0,0,0,1)]", "no such kind"},
      {"[basal P(0,0,0,-1)]", "s:1: column 1: a point of section 0"},
      {"[basal(3,-1,5) P(0,0,0,1)]", "index 5 is there twice or too large"},
      {"[basal(3,-1,1) P(0,0,0,1)[basal(3,-1,0) P(0,0,0,1) P(1,0,0,1)]]", "greater index than its parent"},
      {"[sphere P(0,0,0,1)][sphere P(0,0,0,1)]", "two somata"},
      {"[basal Spine(1,2,3,4,5,6,9)]", "from 0 to 5"},
      {"[basal]", "at least one point"},
      {"P(0,0,0,1)", "is missing here"},
  };
  for (const auto& [text, says] : table) {
    try {
      morphology_from_string(text, "s");
      ADD_FAILURE() << "was read: " << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what() << "\nfor " << text;
    }
  }
}

}  // namespace
}  // namespace forest::lsystem
