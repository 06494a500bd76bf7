// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/measured_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/refused.h"

namespace forest::circuit {
namespace {

using testing::HasSubstr;

TEST(LayerNumbers, AreSaidInManyWays) {
  const auto is = [](std::size_t first, std::size_t last) {
    return std::optional(LayerNumbers{first, last});
  };
  for (const char* name : {"L5", "5", "V", "Va1", "L5A", "Vb", "layer 5", "Layer V", "L5 pyramidal", "5/4"})
    EXPECT_EQ(layer_numbers(name), is(5, 5)) << name;
  for (const char* name : {"L2/3", "L23", "II/III", "2-3", "layer 2/3"})
    EXPECT_EQ(layer_numbers(name), is(2, 3)) << name;
  EXPECT_EQ(layer_numbers("IV"), is(4, 4));
  EXPECT_EQ(layer_numbers("IVc"), is(4, 4));
  EXPECT_EQ(layer_numbers("VIb"), is(6, 6));
  EXPECT_EQ(layer_numbers("L1"), is(1, 1));
  for (const char* name : {"", "L", "pia", "upper", "0", "L0"})
    EXPECT_EQ(layer_numbers(name), std::nullopt) << name;
}

Recipe recipe_of(std::vector<std::pair<const char*, float>> layers) {
  Recipe recipe;
  for (const auto& [name, thickness] : layers) recipe.layers.push_back({name, thickness, 0., {}, {}});
  return recipe;
}
const std::vector<std::vector<float>> maps{{1.f, 0.f}, {2.f, 1.f}, {4.f, 8.f}, {3.f, 6.f}};

TEST(MapsOfLayers, ArePartsOfOneAndSumsOfSeveral) {
  const auto named =
      maps_of_layers(recipe_of({{"L1", 9.f}, {"L2/3", 9.f}, {"L4A", 100.f}, {"L4B", 300.f}}), maps);
  EXPECT_EQ(named, (std::vector<std::vector<float>>{{1.f, 0.f}, {6.f, 9.f}, {.75f, 1.5f}, {2.25f, 4.5f}}));
  const auto fewer = maps_of_layers(recipe_of({{"I", 1.f}, {"II/III", 1.f}, {"IV", 1.f}}), maps);
  EXPECT_EQ(fewer, (std::vector<std::vector<float>>{{1.f, 0.f}, {6.f, 9.f}, {3.f, 6.f}}));
}

TEST(MapsOfLayers, AreInTheirOrderWhereNamesDoNotSayItAndThereAreAsMany) {
  EXPECT_EQ(maps_of_layers(recipe_of({{"a", 1.f}, {"b", 1.f}, {"L1", 1.f}, {"d", 1.f}}), maps), maps);
  const Recipe merged = recipe_of({{"L1", 1.f}, {"L2/3", 1.f}, {"L4", 1.f}, {"L5", 1.f}});
  EXPECT_EQ(maps_of_layers(merged, maps), maps);
  EXPECT_THAT(doubt_of_maps(merged, 4),
              HasSubstr("in their order, though layer L5 of the recipe needs a measured layer 5"));
  EXPECT_EQ(doubt_of_maps(merged, 5), "");
  EXPECT_EQ(doubt_of_maps(recipe_of({{"a", 1.f}, {"b", 1.f}}), 2), "");
}

TEST(MapsOfLayers, AreRefusedWhereNamesDoNotFit) {
  EXPECT_THAT(refused([&] {
                maps_of_layers(recipe_of({{"L1", 1.f}, {"deep", 1.f}}), maps);
              }),
              HasSubstr("layer deep of the recipe is none of the 4 measured ones"));
  EXPECT_THAT(refused([&] {
                maps_of_layers(recipe_of({{"L1", 1.f}, {"L2/3", 1.f}, {"L5", 1.f}}), maps);
              }),
              HasSubstr("layer L5 of the recipe needs a measured layer 5, and 4 are given"));
  EXPECT_THAT(refused([&] {
                maps_of_layers(recipe_of({{"L1", 1.f}, {"L4", 1.f}, {"L2/3", 1.f}}), maps);
              }),
              HasSubstr("layer L2/3 of the recipe lies under L4"));
  EXPECT_THAT(refused([&] {
                maps_of_layers(recipe_of({{"L1", 1.f}, {"L3", 1.f}, {"L4", 1.f}}), maps);
              }),
              HasSubstr("no layer of the recipe is the measured layer 2"));
}

}  // namespace
}  // namespace forest::circuit
