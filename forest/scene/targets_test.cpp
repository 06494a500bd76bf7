// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/targets.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/scene/pick.h"
#include "forest/scene/view.h"

#include "tests/refused.h"
#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

using circuit::Clause;
using circuit::Members;
using frame::State;
using ::testing::HasSubstr;

// Types "first" (excitatory) and "second", layers "upper" and "lower"; nodes 10…19 of "b", then 0…29 of "a".
Forest sample() {
  const circuit::NodeNames nodes{{"a", "b"}, {{1, 0, 10, 10}, {0, 10, 0, 30}}};
  return Forest::from_bytes(
      pack(testing::sample_circuit(40), testing::sample_neurons(), Progress::none(), nodes));
}

Members where(const Forest& forest, auto&& holds) {
  Members members;
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i)
    if (holds(i)) members.push_back(i);
  return members;
}

TEST(Targets, NodeSetsOfACircuitStayWithTheForest) {
  for (const bool named : {false, true}) {
    circuit::NodeNames nodes{{}, {}, "{\"α\": {\"layer\": \"upper\"}}\n"};
    if (named) nodes.populations = {"a"}, nodes.runs = {{0, 0, 7, 40}};
    const Forest f = Forest::from_bytes(
        pack(testing::sample_circuit(40), testing::sample_neurons(), Progress::none(), nodes));
    EXPECT_EQ(f.nodes().sets, nodes.sets);
    EXPECT_EQ(f.nodes().populations[0], named ? "a" : "column");
    EXPECT_EQ(f.nodes().runs.front().first_node, named ? 7u : 0u);
  }
  EXPECT_EQ(sample().nodes().sets, "");
}

TEST(Targets, WhatACircuitsFilesTellOfNeuronsStaysWithTheForestAndGoesFirst) {
  circuit::NodeNames nodes;
  circuit::Attribute score, name;
  name.words = {"wide", "narrow"};
  for (std::uint32_t i = 0; i < 40; ++i) {
    score.numbers.push_back(i % 4 ? .1 * double(i) : NAN);
    name.index.push_back(i % 3 < 2 ? i % 3 : circuit::Attribute::unknown);
  }
  nodes.attributes = {{"score", score}, {"model_name", name}};
  auto bytes = pack(testing::sample_circuit(40), testing::sample_neurons(), Progress::none(), nodes);
  const Forest f = Forest::from_bytes(bytes);
  circuit::NodeSets sets{.source = "sets.json", .sets = {}};
  sets.put({.name = "high", .clauses = {{"score", Clause::Test::at_least, {}, {.1 * 7.}}}, .of = {}});
  sets.put({.name = "wide", .clauses = {{"model_name", Clause::Test::any_of, {"wide"}, {}}}, .of = {}});
  sets.put({.name = "odd", .clauses = {{"depth", Clause::Test::less, {}, {1.}}}, .of = {}});
  sets.put({.name = "both", .clauses = {}, .of = {"high", "wide"}, .compound = true});
  const Targets targets(f, sets);
  const auto high = [](auto i) { return i % 4 && i >= 7; };
  EXPECT_EQ(targets.find("high"), where(f, high));
  EXPECT_EQ(targets.find("wide"), where(f, [](auto i) { return i % 3 == 0; }));
  EXPECT_EQ(targets.find("both"), where(f, [&](auto i) { return i % 3 == 0 || high(i); }));
  // One that cannot be resolved says so with its name, and leaves the others as they are.
  EXPECT_THAT(refused([&] { targets.find("odd"); }),
              ::testing::AllOf(HasSubstr("'odd' asks for 'depth'"), HasSubstr("model_type, x, y, z, score")));
  std::size_t odd = 0;
  for (const TargetFacts& t : targets.list()) odd += !t.problem.empty();
  EXPECT_EQ(odd, 1u);
  // Attributes that are not of all neurons are refused, and so is a file whose last one is cut off.
  nodes.attributes[0].of.numbers.pop_back();
  EXPECT_THAT(forest::refused([&] {
                pack(testing::sample_circuit(40), testing::sample_neurons(), Progress::none(), nodes);
              }),
              HasSubstr("score"));
}

TEST(Targets, AForestHasThemByItself) {
  const Forest f = sample();
  const Targets targets(f);
  EXPECT_EQ(targets.find("first"), where(f, [&](auto i) { return f.types()[i] == 0; }));
  EXPECT_EQ(targets.find("inhibitory"), where(f, [&](auto i) { return f.types()[i] == 1; }));
  EXPECT_EQ(targets.find("layer:upper"), where(f, [&](auto i) { return f.layers()[i] == 0; }));
  EXPECT_EQ(targets.find("lower and not second"),
            where(f, [&](auto i) { return f.layers()[i] == 1 && f.types()[i] == 0; }));
  EXPECT_EQ(targets.find("b").size(), 10u);
  EXPECT_EQ(targets.find("all").size(), 40u);
  EXPECT_THAT(refused([&] { targets.find("third"); }), HasSubstr("no target 'third'"));
  std::set<std::string> names;
  for (const TargetFacts& t : targets.list()) {
    EXPECT_EQ(targets.find(t.name).size(), t.count) << t.name;
    names.insert(t.origin + ":" + t.name);
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"type:first", "type:second", "layer:upper", "layer:lower", "population:a",
                                   "population:b", "sign:excitatory", "sign:inhibitory", "all:all"}));
}

TEST(Targets, NodeSetsAskForAttributes) {
  const Forest f = sample();
  circuit::NodeSets sets{.source = "sets.json", .sets = {}};
  sets.put({.name = "some",
            .clauses = {{"population", Clause::Test::any_of, {"b"}, {}},
                        {"node_id", Clause::Test::any_of, {}, {12, 15, 3}}},
            .of = {}});
  sets.put({.name = "high", .clauses = {{"y", Clause::Test::greater, {}, {300}}}, .of = {}});
  sets.put({.name = "first", .clauses = {{"mtype", Clause::Test::any_of, {"second"}, {}}}, .of = {}});
  sets.put({.name = "both", .clauses = {}, .of = {"some", "high"}, .compound = true});
  sets.put({.name = "odd", .clauses = {{"etype", Clause::Test::any_of, {"x"}, {}}}, .of = {}});
  sets.put({.name = "all", .clauses = {}, .of = {"some", "high"}, .compound = true});
  const Targets targets(f, sets);
  EXPECT_EQ(targets.find("some"), (Members{2, 5}));
  EXPECT_EQ(targets.find("high"), where(f, [&](auto i) { return f.instances()[i].y > 300.f; }));
  EXPECT_EQ(targets.find("first"), targets.find("type:second"));  // a node set comes first
  EXPECT_EQ(targets.find("all"), targets.find("both"));
  EXPECT_EQ(targets.find("all:all").size(), 40u);
  EXPECT_EQ(targets.find("both and not high").size(),
            2 - (f.instances()[2].y > 300.f) - (f.instances()[5].y > 300.f));
  EXPECT_THAT(refused([&] { targets.find("odd"); }),
              HasSubstr("sets.json: the node set 'odd' asks for 'etype'"));
  EXPECT_THAT(targets.list()[4].problem, HasSubstr("etype"));  // told, and the others can be used
}

TEST(Targets, NodesOfAForestThatNamesNoneAreCounted) {
  const Forest f = Forest::from_bytes(pack(testing::sample_circuit(40), testing::sample_neurons()));
  EXPECT_EQ(f.nodes().runs, (std::vector<circuit::NodeRun>{{0, 0, 0, 40}}));
  EXPECT_EQ(f.nodes().populations, std::vector<std::string>{"column"});
}

View with(const std::string& targets) {
  return parse_view(R"({"eye":[0,300,900],"target":[0,300,0],"targets":)" + targets + "}");
}

TEST(Appearance, TextComesBackAndSlipsAreNoticed) {
  const std::string text =
      R"([{"name":"first","visible":false,"colour":"#ff8800","kind":"lines","opacity":0.4,"simulated":false},)"
      R"({"name":"upper or second","colour":"depth","opacity":{"all":0.5,"soma":1.0,"axon":0.0}},{"neuron":3},)"
      R"({"neuron":2,"section":1,"opacity":{"axon":0.25}}])";
  const View view = with(text);
  ASSERT_EQ(view.targets.size(), 4u);
  EXPECT_EQ(view.targets[0].colour, 0xff8800u);
  EXPECT_EQ(view.targets[1].colour_by, ColourBy::depth);
  EXPECT_EQ(view.targets[1].opacity, .5f);
  EXPECT_EQ(view.targets[1].opacity_of[1], 1.f);
  EXPECT_EQ(view.targets[3].branch, (Branch{2, 1}));
  EXPECT_EQ(parse_view(to_json(view)).targets, view.targets);
  EXPECT_THAT(to_json(view), HasSubstr(text));
  const std::pair<const char*, const char*> wrong[] = {
      {"{}", "must be a list"},
      {"[3]", "must hold objects"},
      {"[{}]", "must have a 'name'"},
      {R"([{"name":""}])", "'name' must be"},
      {R"([{"name":"a","neuron":3}])", "and not both"},
      {R"([{"section":3}])", "must have a 'name'"},
      {R"([{"neuron":-3}])", "whole number"},
      {R"([{"name":"a","visible":1}])", "true or false"},
      {R"([{"name":"a","colour":"#ff88"}])", "#ff8800"},
      {R"([{"name":"a","colour":"#ff88zz"}])", "#ff8800"},
      {R"([{"name":"a","colour":"red"}])", "one of: type"},
      {R"([{"name":"a","kind":"tubes"}])", "capsules"},
      {R"([{"name":"a","opacity":1.5}])", "from 0 to 1"},
      {R"([{"name":"a","opacity":{"tail":1}}])", "no kind of section"},
      {R"([{"name":"a","opacty":1}])", "'opacty' is no key"},
  };
  for (const auto& [targets, words] : wrong)
    EXPECT_THAT(refused([&, list = targets] { with(list); }), HasSubstr(words)) << targets;
}

TEST(Appearance, LaterOnesWinAndWhatIsNotSaidStays) {
  const Forest f = sample();
  const Targets targets(f);
  const View view = with(
      R"([{"name":"all","visible":false,"opacity":0.5,"kind":"lines"},{"name":"first","visible":true,"simulated":false},)"
      R"({"name":"upper","kind":"dots","colour":"#00ff00"}])");
  const Colouring c = colour(targets, view);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const State& s = c.states[i];
    EXPECT_EQ(s.is(State::visible), f.types()[i] == 0);
    EXPECT_EQ(s.is(State::simulated), f.types()[i] != 0);
    EXPECT_EQ(s.opacity, 128);
    EXPECT_EQ(s.kind, f.layers()[i] == 0 ? frame::Kind::dots : frame::Kind::lines);
    if (!s.is(State::visible)) continue;  // no class is spent on it
    const Vec3 apical = c.palette[8 * s.colour_class + 4];
    EXPECT_EQ(apical == Vec3(0, 1, 0), f.layers()[i] == 0) << i;
  }
  EXPECT_EQ(c.legend.size(), 2u);  // of what is seen: "first, lower", "upper"
  EXPECT_EQ(c.legend.back().name, "upper");
}

TEST(Appearance, TheLegendNamesTheKindsThatThereAre) {
  const Forest f = sample();  // without axons
  View view;
  view.colour_by = ColourBy::kind;
  std::vector<std::string> names;
  for (const LegendEntry& entry : colour(Targets(f), view).legend) names.push_back(entry.name);
  EXPECT_THAT(names, ::testing::ElementsAre("soma", "basal", "apical"));
}

TEST(Appearance, ColoursThatAreSharedSayByHowMany) {
  circuit::Circuit c = testing::sample_circuit(60);
  c.types.clear();
  for (int i = 0; i < 30; ++i) c.types.push_back({"type " + std::to_string(i), "p", true});
  for (std::size_t i = 0; i < c.instances.size(); ++i) c.instances[i].type = std::uint32_t(i % 30);
  const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons()));
  View view;
  view.colour_by = ColourBy::type;
  const Colouring by_type = colour(Targets(f), view);
  std::size_t told = 0;
  for (std::size_t i = 0; i < by_type.legend.size(); ++i) {
    const LegendEntry& entry = by_type.legend[i];
    const auto at = entry.name.find(" and ");
    told += 1 + (at == std::string::npos ? 0 : std::stoul(entry.name.substr(at + 5))) +
            (entry.name.find(" to ") != std::string::npos);  // of two layers
    ASSERT_EQ(entry.colours.size(), 1u);
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(entry.colours, by_type.legend[k].colours);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;  // type and layer
  for (std::size_t i = 0; i < f.instances().size(); ++i) seen.insert({f.types()[i], f.layers()[i]});
  EXPECT_EQ(told, seen.size());
  EXPECT_LE(by_type.legend.size(), 16u);
}

TEST(Appearance, TypesThatDifferInTheirLayerAloneAreOneFamily) {
  circuit::Circuit c = testing::sample_circuit(60);
  c.types = {{"L2/3 pyramidal cell", "p", true},
             {"L23_BC", "p", false},
             {"L4 pyramidal cell", "p", true},
             {"L4_BC", "p", false},
             {"L5", "p", true},
             {"Lugaro cell", "p", false}};
  c.layers = {{"upper", 50.f, 100.f}, {"lower", 0.f, 50.f}};
  for (std::size_t i = 0; i < c.instances.size(); ++i) {
    c.instances[i].type = std::uint32_t(i % 6);
    c.instances[i].layer = i % 6 == 2 || i % 6 == 3;
  }
  View view;
  view.colour_by = ColourBy::type;
  const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons()));
  const auto legend = colour(Targets(f), view).legend;
  std::vector<std::string> names;
  for (const LegendEntry& entry : legend) names.push_back(entry.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("pyramidal cell, upper", "pyramidal cell, lower",
                                                     "BC, upper", "BC, lower", "L5", "Lugaro cell"));
}

TEST(Appearance, NoTwoLayersHaveOneColour) {
  circuit::Circuit c = testing::sample_circuit(48);
  c.layers.clear();
  for (int i = 0; i < 12; ++i)
    c.layers.push_back({"L" + std::to_string(i), 100.f - float(i), 101.f - float(i)});
  for (std::size_t i = 0; i < c.instances.size(); ++i) c.instances[i].layer = std::uint32_t(i % 12);
  const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons()));
  View view;
  view.colour_by = ColourBy::layer;
  const Colouring by_layer = colour(Targets(f), view);
  ASSERT_EQ(by_layer.legend.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(by_layer.legend[i].name, "L" + std::to_string(i));
}

TEST(Appearance, ThereMayBeMoreHuesThanThereIsRoomFor) {
  circuit::Circuit c = testing::sample_circuit(48);
  c.layers.clear();
  for (int i = 0; i < 61'000; ++i) c.layers.push_back({"L" + std::to_string(i), -float(i), 1.f - float(i)});
  for (std::size_t i = 0; i < c.instances.size(); ++i)
    c.instances[i].layer = std::uint32_t(i % 2 ? 60'999 : i);
  const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons()));
  for (const ColourBy by : {ColourBy::type, ColourBy::layer, ColourBy::kind, ColourBy::neuron,
                            ColourBy::target, ColourBy::depth, ColourBy::order}) {
    View view;
    view.colour_by = ColourBy::layer;
    view.targets.emplace_back().name = "first";
    view.targets.back().colour_by = by;
    const Colouring seen = colour(Targets(f), view);
    ASSERT_EQ(seen.states.size(), 48u);
    for (const frame::State& state : seen.states) EXPECT_LT(state.colour_class, colour_classes);
  }
}

TEST(Appearance, LayersOfATypeAreOneEntryOfTheLegend) {
  circuit::Circuit c = testing::sample_circuit(80);
  c.layers.clear();
  for (int i = 0; i < 8; ++i)
    c.layers.push_back({"L" + std::to_string(i), 100.f - float(i), 101.f - float(i)});
  for (std::size_t i = 0; i < c.instances.size(); ++i)
    c.instances[i].type = i % 2, c.instances[i].layer = std::uint32_t(i % 2 ? 1 + i / 2 % 6 : 2);
  const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons()));
  View view;
  view.colour_by = ColourBy::type;
  const Colouring by_type = colour(Targets(f), view);
  ASSERT_EQ(by_type.legend.size(), 2u);
  EXPECT_EQ(by_type.legend[0].name, "first");  // in one layer alone
  EXPECT_EQ(by_type.legend[0].colours.size(), 1u);
  EXPECT_EQ(by_type.legend[1].name, "second, L1 to L6");
  EXPECT_EQ(by_type.legend[1].colours.size(), 6u);
}

TEST(Appearance, EveryWayOfColouringKeepsTheContract) {
  const Forest f = sample();
  const Targets targets(f);
  for (const std::string_view word : colour_by_words) {
    View view =
        with(fmt::format(R"([{{"name":"first","opacity":0.5}},{{"name":"second","colour":"{}"}}])", word));
    view.colour_by =
        parse_view(fmt::format(R"({{"eye":[0,0,1],"target":[0,0,0],"colour_by":"{}"}})", word)).colour_by;
    const Colouring c = colour(targets, view);
    const Cut cut = choose(f, Eye(view.camera, {320, 200}, view.detail), c.shown());
    EXPECT_NO_THROW(frame::check(compose(f, view, c, cut, 320, 200), f.geometry())) << word;
    EXPECT_GT(cut.segments, 100u);
  }
}

// In curved tissue y says nothing about depth: what the circuit tells of it does.
TEST(Appearance, DepthInElementsIsWhatTheCircuitTells) {
  circuit::Circuit c = testing::sample_circuit(40);
  circuit::NodeNames nodes;
  nodes.attributes = {{"depth", {}}, {"element", {}}};
  for (std::size_t i = 0; i < c.instances.size(); ++i) {
    nodes.attributes[0].of.numbers.push_back(i % 2 ? 10. : 1990.);
    nodes.attributes[1].of.numbers.push_back(0.);
  }
  View view;
  view.colour_by = ColourBy::depth;
  const auto colours = [&](const circuit::NodeNames& names) {
    const Forest f = Forest::from_bytes(pack(c, testing::sample_neurons(), Progress::none(), names));
    const Colouring colouring = colour(Targets(f), view);
    std::set<std::uint32_t> shallow, deep;
    for (std::size_t i = 0; i < colouring.states.size(); ++i)
      (i % 2 ? shallow : deep).insert(colouring.states[i].colour_class);
    return std::pair(shallow, deep);
  };
  const auto [shallow, deep] = colours(nodes);
  EXPECT_EQ(shallow.size(), 1u);
  EXPECT_EQ(deep.size(), 1u);
  EXPECT_NE(shallow, deep);
  nodes.attributes.pop_back();  // whatever another's `depth` is
  EXPECT_GT(colours(nodes).first.size(), 1u);
}

TEST(Appearance, MoreColoursThanClassesBecomeTheMostSimilarOnes) {
  const Forest f = sample();
  const Targets targets(f);
  View view = with("[]");
  view.colour_by = ColourBy::layer;
  for (std::uint32_t i = 0; i < 30; ++i)
    view.targets.push_back({.name = "",
                            .branch = Branch{i},
                            .visible = {},
                            .colour = i < 14 ? i << 4 : 0xff0000 + i,
                            .colour_by = {},
                            .kind = {},
                            .opacity = {},
                            .opacity_of = {},
                            .simulated = {}});
  const Colouring c = colour(targets, view);
  for (std::uint32_t i = 0; i < 30; ++i) {
    const Vec3 shown = c.palette[8 * c.states[i].colour_class + 4];
    EXPECT_EQ(shown.x() > .5f, i >= 14) << i;
  }
}

TEST(Appearance, WhatIsNotVisibleCostsNothingAndIsNotPicked) {
  const Forest f = sample();
  const Targets targets(f);
  View view = overview(f);
  const Eye eye(view.camera, {320, 200}, view.detail);
  const Cut whole = choose(f, eye);
  view.targets = with(R"([{"name":"first","visible":false}])").targets;
  const Colouring c = colour(targets, view);
  const Cut half = choose(f, eye, c.shown());
  EXPECT_LT(half.segments, whole.segments);
  for (const auto& list : {half.dots, half.lines, half.capsules})
    for (const frame::Item& item : list) EXPECT_EQ(f.types()[item.instance], 1u);
  int hidden = 0;
  for (float x = 100; x < 220; x += 3)
    for (float y = 20; y < 180; y += 5) {
      const auto any = pick(f, view.camera, {320, 200}, {x, y}),
                 seen = pick(f, view.camera, {320, 200}, {x, y}, .5f, c.shown());
      hidden += any && f.types()[any->instance] == 0;
      if (any && f.types()[any->instance] == 1) {
        EXPECT_EQ(seen->segment, any->segment);
      }
      EXPECT_TRUE(!seen || f.types()[seen->instance] == 1);
    }
  EXPECT_GT(hidden, 5);
  view.targets = with(R"([{"name":"all","visible":false}])").targets;
  const Colouring nothing = colour(targets, view);
  const Cut empty = choose(f, eye, nothing.shown());
  EXPECT_EQ(empty.segments, 0u);
  EXPECT_TRUE(empty.left_out.empty());
}

TEST(Appearance, AKindIsDrawnWithItsOwnPrimitives) {
  const Forest f = sample();
  const Targets targets(f);
  View view = overview(f);
  const Eye eye(view.camera, {320, 200}, view.detail);
  const auto cut_of = [&](const std::string& kind) {
    view.targets = with(R"([{"name":"all","kind":")" + kind + "\"}]").targets;
    const Colouring c = colour(targets, view);
    return choose(f, eye, c.shown());
  };
  const Cut lines = cut_of("lines"), capsules = cut_of("capsules"), dots = cut_of("dots"),
            somata = cut_of("somata");
  const auto somata_in = [&](const std::vector<frame::Item>& list) {
    return std::ranges::count_if(
        list, [&](const frame::Item& i) { return (f.segments()[i.first_segment].meta & 7) == 1; });
  };
  EXPECT_EQ(somata_in(lines.capsules), std::ptrdiff_t(lines.capsules.size()));
  EXPECT_TRUE(capsules.lines.empty());
  EXPECT_TRUE(dots.lines.empty());
  EXPECT_GT(dots.dots.size(), 5 * lines.dots.size());
  EXPECT_EQ(somata.segments, 40u);
  EXPECT_EQ(lines.segments, capsules.segments);
  EXPECT_EQ(lines.segments, dots.segments);
}

TEST(Appearance, ABranchIsShownByItself) {
  const Forest f = sample();
  const Targets targets(f);
  View view = overview(f);
  const Neuron& neuron = f.neurons()[f.instances()[4].morphology];
  std::uint32_t section = 0;  // with daughters
  while (f.sections()[neuron.first_section + section].daughters == 0) ++section;
  view.targets = with(R"([{"name":"all","visible":false},{"neuron":4,"section":)" + std::to_string(section) +
                      R"(,"visible":true,"colour":"#00ff00","opacity":0.5}])")
                     .targets;
  Colouring c = colour(targets, view);
  const Cut cut = choose(f, Eye(view.camera, {320, 200}, view.detail), c.shown());
  std::multiset<std::uint32_t> drawn, expected;
  for (const auto& list : {cut.dots, cut.lines, cut.capsules})
    for (const frame::Item& item : list) {
      EXPECT_EQ(item.instance, 4u);
      const State state = frame::unpacked(item.state);
      EXPECT_EQ(state.opacity, 128);
      EXPECT_EQ(c.palette[8 * state.colour_class + 4], Vec3(0, 1, 0));
      for (std::uint32_t i = 0; i < frame::cluster_size; ++i)
        if (item.drawn >> i & 1u) drawn.insert(item.first_segment + i);
    }
  for (const std::uint32_t s : subarbor(f, 4, section)) expected.insert(s);
  EXPECT_EQ(drawn, expected);
  EXPECT_NO_THROW(frame::check(compose(f, view, c, cut, 320, 200), f.geometry()));
  // A target that is named later shows the whole neuron again.
  view.targets.push_back(with(R"([{"name":"all","visible":true,"opacity":1}])").targets[0]);
  c = colour(targets, view);
  const Cut again = choose(f, Eye(view.camera, {320, 200}, view.detail), c.shown());
  NeuronsInSight in_sight;
  in_sight.clear(f.instances().size());
  in_sight.add(again);
  EXPECT_EQ(in_sight.count(), 40u);
  EXPECT_EQ(c.parts[0].state.opacity, 255);
  EXPECT_THAT(refused([&] {
                view.targets[1].branch = Branch{40};
                colour(targets, view);
              }),
              HasSubstr("no neuron 40"));
  EXPECT_THAT(refused([&] {
                view.targets[1].branch = Branch{4, 5000};
                colour(targets, view);
              }),
              HasSubstr("no section 5000"));
}

TEST(Appearance, OpacityOfAKindOfBranchGoesToThePalette) {
  const Forest f = sample();
  const Targets targets(f);
  const View view =
      with(R"([{"name":"first","opacity":{"apical":0.2,"soma":1}},{"name":"upper","opacity":{"basal":0}}])");
  const Colouring c = colour(targets, view);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const std::size_t at = 8 * c.states[i].colour_class;
    EXPECT_EQ(c.opacities[at + 4], f.types()[i] == 0 ? 51 : 255);
    EXPECT_EQ(c.opacities[at + 3], f.layers()[i] == 0 ? 0 : 255);
    EXPECT_EQ(c.opacities[at + 1], 255);
  }
}

}  // namespace
}  // namespace forest::scene
