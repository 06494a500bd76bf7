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

}  // namespace
}  // namespace forest::studio
