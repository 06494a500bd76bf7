// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/target_list.h"

#include <gtest/gtest.h>

#include "tests/sample_forest.h"

namespace forest::studio {
namespace {

using scene::Appearance;
using Seen = TargetRow::Seen;

struct Fixture {
  scene::Forest forest = scene::Forest::from_bytes(
      scene::pack(forest::testing::sample_circuit(40), forest::testing::sample_neurons()));
  scene::Targets targets{forest};
  scene::View view = scene::overview(forest);

  std::vector<TargetRow> rows(std::optional<scene::Branch> selected = {}) {
    return target_rows(targets, view, scene::colour(targets, view), selected);
  }
  TargetRow row(const std::string& title) {
    for (const TargetRow& row : rows())
      if (row.title == title) return row;
    ADD_FAILURE() << "no row " << title;
    return {};
  }
  void set(const std::string& name, const Appearance& what, bool own_colour = true) {
    Appearance who;
    who.name = name;
    change_target(view, who, what, own_colour);
  }
};

Appearance visible(bool on) {
  Appearance a;
  a.visible = on;
  return a;
}

TEST(TargetList, WhatIsSaidLastWins) {
  Fixture f;
  EXPECT_EQ(f.row("upper").seen, Seen::all);
  f.set("all", visible(false));
  EXPECT_EQ(f.row("upper").seen, Seen::none);
  f.set("first", visible(true));
  EXPECT_EQ(f.row("first").seen, Seen::all);
  EXPECT_EQ(f.row("second").seen, Seen::none);
  EXPECT_EQ(f.row("upper").seen, Seen::some);
  Appearance clear;
  clear.opacity = .5f;
  f.set("all", clear);  // does not say again that all are hidden
  EXPECT_EQ(f.row("first").seen, Seen::all);
  EXPECT_NEAR(f.row("first").opacity, .5f, .01f);
  f.set("all", visible(true));
  EXPECT_EQ(f.row("second").seen, Seen::all);
  EXPECT_EQ(f.view.targets.size(), 2u);  // nothing is left of what was taken back
}

TEST(TargetList, ANodeSetMayBeNamedAsAllAre) {
  Fixture f;
  circuit::NodeSets sets;
  sets.put({.name = "all", .clauses = {{"mtype", circuit::Clause::Test::any_of, {"first"}, {}}}, .of = {}});
  f.targets.use(sets);
  const auto rows = f.rows();
  EXPECT_EQ(rows.front().title, "all");
  EXPECT_EQ(rows.back().title, "all");
  EXPECT_LT(rows.front().count, 40u);
  EXPECT_EQ(rows.back().count, 40u);
  for (const TargetRow& row : rows) EXPECT_EQ(row.problem, "");
}

TEST(TargetList, ColoursAreForgottenWhenTheViewsOwnIsWanted) {
  Fixture f;
  const auto before = f.row("second").colours;
  Appearance orange;
  orange.colour = 0xE69F00;
  f.set("second", orange);
  EXPECT_EQ(f.row("second").colours, std::vector{scene::light_of(0xE69F00)});
  f.set("second", {}, false);
  EXPECT_EQ(f.row("second").colours, before);
  EXPECT_TRUE(f.view.targets.empty());
}

TEST(TargetList, SeveralColoursAreAllTold) {
  Fixture f;
  f.view.colour_by = scene::ColourBy::layer;
  const auto upper = f.row("upper").colours, lower = f.row("lower").colours;
  ASSERT_EQ(upper.size(), 1u);
  ASSERT_EQ(lower.size(), 1u);
  const auto all = f.row("all").colours;
  ASSERT_EQ(all.size(), 2u);
  EXPECT_NE(std::ranges::find(all, upper[0]), all.end());
  EXPECT_NE(std::ranges::find(all, lower[0]), all.end());
  f.set("lower", visible(false));
  EXPECT_EQ(f.row("all").colours, upper);  // of those that are seen
  EXPECT_TRUE(f.row("lower").colours.empty());
  f.view.colour_by = scene::ColourBy::radius;
  EXPECT_TRUE(f.row("upper").colours.empty());  // they change along its branches
}

TEST(TargetList, OneIsShownAloneAndThenAllAreAgain) {
  Fixture f;
  Appearance clear;
  clear.opacity = .5f;
  f.set("second", clear);
  f.set("first", visible(false));
  Appearance all, who;
  all.name = "all", who.name = "first";
  show_only(f.view, all, who);
  EXPECT_EQ(f.row("first").seen, Seen::all);
  EXPECT_EQ(f.row("second").seen, Seen::none);
  who = {}, who.branch = scene::Branch{3, scene::soma_section};
  show_only(f.view, all, who);
  EXPECT_EQ(f.row("all").seen, Seen::some);
  show_all(f.view);
  EXPECT_EQ(f.row("all").seen, Seen::all);
  EXPECT_NEAR(f.row("second").opacity, .5f, .01f);  // what else was said stays
}

TEST(TargetList, ShowsTheSelectionExpressionsAndWhatIsWrong) {
  Fixture f;
  f.set("first or lower", visible(false));
  circuit::NodeSets sets;
  sets.put({.name = "odd", .clauses = {{"etype", circuit::Clause::Test::any_of, {"x"}, {}}}, .of = {}});
  f.targets.use(sets);
  const auto rows = f.rows(scene::Branch{3, 1});
  EXPECT_EQ(rows[0].who.branch, (scene::Branch{3, 1}));
  EXPECT_EQ(rows[1].title, "first or lower");
  EXPECT_EQ(rows[1].seen, Seen::none);
  EXPECT_EQ(rows[2].title, "odd");
  EXPECT_FALSE(rows[2].problem.empty());
  EXPECT_EQ(rows.back().title, "all");
  Appearance who;
  who.branch = scene::Branch{3, 1};
  Appearance what;
  what.opacity = .25f;
  change_target(f.view, who, what);
  EXPECT_NEAR(f.rows(scene::Branch{3, 1})[0].opacity, .25f, .01f);
}

}  // namespace
}  // namespace forest::studio
