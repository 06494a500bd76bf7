// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/replaced.h"

namespace forest::circuit {
namespace {

using testing::HasSubstr;

const std::string good = R"(name = "a piece of cortex"

[[layer]]
name = "L1"
thickness = 100

[[layer]]
name = "L2/3"
thickness = 250.5

[[soma]]
at = [10, 20.5, -30]
radius = 8

[[attractor]]
at = [0, 100, 0]
strength = -2
reach = 40

[[attractor]]
at = [1, 2, 3]
)";

std::string with(const std::string& from, const std::string& to) { return replaced(good, from, to); }

TEST(EnvironmentFile, IsReadKeyByKey) {
  const cortex::Environment e = parse_environment(good, "good.toml");
  ASSERT_EQ(e.layers().size(), 2u);
  EXPECT_EQ(e.layers()[0], (cortex::Slab{"L1", 250.5f, 350.5f}));
  EXPECT_EQ(e.pia(), 350.5);
  ASSERT_EQ(e.somata().size(), 1u);
  EXPECT_EQ(e.somata()[0].centre, Vec3(10.f, 20.5f, -30.f));
  EXPECT_EQ(e.somata()[0].radius, 8.f);
  ASSERT_EQ(e.attractors().size(), 2u);
  EXPECT_EQ(e.attractors()[0], (cortex::Attractor{{0, 100, 0}, -2.f, 40.f}));
  EXPECT_EQ(e.attractors()[1], (cortex::Attractor{{1, 2, 3}, 1.f, 100.f}));
}

TEST(EnvironmentFile, ARecipeIsOneToo) {
  const auto e = read_environment(std::string(FOREST_SOURCE_DIR) + "/data/recipes/column-1000.toml");
  EXPECT_EQ(e.layers().size(), 6u);
  EXPECT_EQ(e.pia(), 2500.);
  EXPECT_EQ(e.stratum({0, 2400, 0}).layer, 1);
}

TEST(EnvironmentFile, WhatIsWrongIsNamedWithItsLine) {
  struct Case {
    std::string text;
    std::size_t line;
    const char* says;
  };
  const Case cases[] = {
      {with("thickness = 100", "thickness = 0"), 5, "must be a number from"},
      {with("thickness = 100", "thickness = nan"), 5, "must be a number from"},
      {with("thickness = 100", "depth = 100"), 5, "has no key \"depth\""},
      {with("name = \"L1\"\n", ""), 3, "lacks \"name\""},
      {with("[10, 20.5, -30]", "[10, 20.5]"), 12, "three numbers"},
      {with("[10, 20.5, -30]", "[10, inf, -30]"), 12, "must be a number from"},
      {with("[10, 20.5, -30]", "\"there\""), 12, "three numbers"},
      {with("radius = 8", "radius = -8"), 13, "must be a number from"},
      {with("radius = 8", "radius = 1e300"), 13, "must be a number from"},
      {with("reach = 40", "reach = 0"), 18, "must be a number from"},
      {with("[[soma]]", "[[some]]"), 11, "has no key \"some\""},
      {with("[[soma]]", "[soma]"), 11, "headed [[soma]]"},
      {with("[[soma]]", "[[soma"), 11, "not TOML"},
      {"", 0, "nothing in this environment"},
      {"name = \"x\"", 0, "nothing in this environment"},
      {std::string(10000, '['), 1, "not TOML"},
      {std::string(10, '\0'), 1, ""},
  };
  for (const Case& c : cases) try {
      parse_environment(c.text, "e.toml");
      ADD_FAILURE() << c.says;
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "e.toml");
      EXPECT_NEAR(double(error.line()), double(c.line), 1.) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(c.says));
    }
  for (std::size_t length = 0; length < good.size(); ++length) try {
      parse_environment(good.substr(0, length), "cut.toml");
    } catch (const InputError&) {
    }
}

TEST(EnvironmentFile, ACircuitIsItsLayersAndSomata) {
  const Circuit circuit{.name = "c",
                        .layers = {{"L1", 50.f, 100.f}, {"L2", 0.f, 50.f}},
                        .types = {{"t", "t"}},
                        .morphologies = {"a", "b"},
                        .instances = {{.position = {1, 2, 3}, .morphology = 1}, {.position = {40, 5, 6}}},
                        .radius = 100.f};
  const auto e = environment(circuit, std::vector{7.f, 9.f});
  EXPECT_EQ(e.pia(), 100.);
  ASSERT_EQ(e.somata().size(), 2u);
  EXPECT_EQ(e.somata()[0].radius, 9.f);
  EXPECT_EQ(e.somata()[1].centre, Vec3(40, 5, 6));
}

}  // namespace
}  // namespace forest::circuit
