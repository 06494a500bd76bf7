// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/settings.h"

#include <string_view>

#include <gtest/gtest.h>

namespace forest::studio {
namespace {

const auto& named(const auto& rows, std::string_view name) {
  for (const auto& row : rows)
    if (row.name == name) return row;
  throw std::invalid_argument("no such row");
}

TEST(Settings, SynapsesComeBackInTheColoursThatTheyHad) {
  const Toggle& synapses = named(toggles(), "Synapses");
  const Choice& colour = named(choices(), "Synapse colour");
  Settings s;
  EXPECT_FALSE(synapses.value(s)) << "none are open";
  EXPECT_FALSE(synapses.usable(s));
  s.has_synapses = true;
  for (const int word : {1, 0}) {
    colour.set(s, word);
    EXPECT_TRUE(synapses.value(s));
    synapses.set(s, false);
    EXPECT_EQ(s.view.synapses, scene::SynapseColour::none);
    EXPECT_EQ(colour.value(s), word);
    synapses.set(s, true);
    EXPECT_EQ(colour.value(s), word);
    EXPECT_TRUE(synapses.value(s));
  }
}

TEST(Settings, WhatIsNotOpenIsNotTicked) {
  Settings s;
  const Toggle& surfaces = named(toggles(), "Surfaces");
  EXPECT_FALSE(surfaces.value(s) || surfaces.usable(s));
  s.has_surfaces = true;
  EXPECT_TRUE(surfaces.value(s) && surfaces.usable(s));
  EXPECT_TRUE(named(toggles(), "Outline").usable(s));
}

TEST(Settings, TheTextOfAViewHoldsItsSkin) {
  Settings s;
  const Toggle& skin = named(toggles(), "Skin");
  const auto said = [&] {
    return asks_for_skin([&](const scene::View& unless) {
      return scene::parse_view(text_of(s, Vec3::Zero()), "text", Vec3::UnitY(), &unless);
    });
  };
  EXPECT_FALSE(said());
  skin.set(s, true);
  EXPECT_TRUE(said());
  s.view.skin = false;  // a view that forbids it
  EXPECT_FALSE(said() || skin.value(s));
  skin.set(s, true);
  EXPECT_TRUE(said() && skin.value(s));
}

}  // namespace
}  // namespace forest::studio
