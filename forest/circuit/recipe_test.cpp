// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/recipe.h"

#include <cmath>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/refused.h"
#include "tests/replaced.h"

namespace forest::circuit {
namespace {

using testing::HasSubstr;

const std::string good = R"(name = "two layers"
neurons = 10
rotate = false

[column]
radius = 100      # µm

[soma]
gap = 1.5

[[type]]
name = "tall"
population = "pyramidal"

[[type]]
name = "small"
excitatory = false

[[layer]]
name = "upper"
thickness = 100
density = 3000
mix = { tall = 0.25, small = 0.75 }

[[layer]]
name = "lower"
thickness = 200.0
density = 1000
mix = { tall = 1 }
)";

std::string with(const std::string& from, const std::string& to) { return replaced(good, from, to); }

TEST(Recipe, IsReadKeyByKey) {
  const Recipe recipe = parse_recipe(good, "good.toml");
  EXPECT_EQ(recipe.name, "two layers");
  EXPECT_EQ(recipe.neurons, 10u);
  EXPECT_FALSE(recipe.rotate);
  EXPECT_EQ(recipe.radius, 100.f);
  EXPECT_EQ(recipe.soma_gap, 1.5f);
  ASSERT_EQ(recipe.types.size(), 2u);
  EXPECT_EQ(recipe.types[0], (CellType{"tall", "pyramidal", true}));
  EXPECT_EQ(recipe.types[1], (CellType{"small", "small", false}));
  ASSERT_EQ(recipe.layers.size(), 2u);
  EXPECT_EQ(recipe.layers[1].thickness, 200.f);
  EXPECT_THAT(recipe.layers[0].mix, testing::ElementsAre(.25, .75));
  EXPECT_THAT(recipe.layers[1].mix, testing::ElementsAre(1., 0.));
}

TEST(Recipe, SaysOfWhichTypesTheSliceIsCorrected) {
  const auto slices = [](const std::string& text) {
    const Recipe recipe = parse_recipe(text, "slices.toml");
    return std::pair(source_of(recipe, 0).slice, source_of(recipe, 1).slice);
  };
  using Both = std::pair<std::optional<SliceCorrection>, std::optional<SliceCorrection>>;
  EXPECT_EQ(slices(good), Both());
  const std::string tall = "name = \"tall\"", small = "name = \"small\"";
  EXPECT_EQ(slices(with(tall, tall + "\nslice-correction = 1.5")), Both(SliceCorrection{.factor = 1.5f}, {}));
  EXPECT_EQ(slices(with(small, small + "\nslice-correction = \"measured\"")),
            Both({}, SliceCorrection{.measured = true}));
  Recipe shorter = parse_recipe(good, "good.toml");
  shorter.sources.clear();
  EXPECT_EQ(source_of(shorter, 1).slice, std::nullopt);
}

TEST(Recipe, DensitiesGiveTheNumbersWhenNoTotalIsGiven) {
  Recipe recipe = parse_recipe(with("neurons = 10\n", ""), "x.toml");
  recipe.layers[0].density = 1e6;
  const auto count = counts(recipe);
  const double volume = column(recipe).volume(0) * 1e-9;
  EXPECT_NEAR(count[0][0] + count[0][1], 1e6 * volume, 1.);
}

TEST(Recipe, TheTotalIsSharedByDensityTimesVolume) {
  const auto count = counts(parse_recipe(good, "x.toml"));  // weights 3 : 2
  EXPECT_EQ(count[0][0] + count[0][1], 6u);
  EXPECT_EQ(count[1][0], 4u);
}

TEST(Recipe, AnExplicitCountIsKeptAndTheRestShared) {
  const auto count = counts(parse_recipe(with("density = 3000", "count = 9"), "x.toml"));
  EXPECT_EQ(count[0][0] + count[0][1], 9u);
  EXPECT_EQ(count[1][0], 1u);
}

RC_GTEST_PROP(Apportion, IsExactAndNoShareIsAWholeUnitOff, ()) {
  const auto whole = *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 1000)));
  const std::vector<double> weights(whole.begin(), whole.end());
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.);
  RC_PRE(sum > 0.);
  const auto total = *rc::gen::inRange(0u, 100000u);
  const auto shares = apportion(total, weights);
  RC_ASSERT(std::accumulate(shares.begin(), shares.end(), 0u) == total);
  for (std::size_t i = 0; i < weights.size(); ++i)
    RC_ASSERT(std::abs(shares[i] - total * weights[i] / sum) < 1. + 1e-9);
}

RC_GTEST_PROP(ApportionByLot, IsWithinAUnitAndExactInTheMean, ()) {
  const auto parts = *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 4000)));
  std::vector<double> expected;
  for (const int part : parts) expected.push_back(part / 1000.);
  const double sum = std::accumulate(expected.begin(), expected.end(), 0.);
  constexpr int lots = 500;  // as many as there are different remainders of these sums, twice
  std::vector<double> mean(expected.size());
  for (int i = 0; i < lots; ++i) {
    const auto whole = apportion_by_lot(expected, (i + .5) / lots);
    RC_ASSERT(std::abs(std::accumulate(whole.begin(), whole.end(), 0.) - sum) < 1. + 1e-9);
    for (std::size_t k = 0; k < whole.size(); ++k) {
      RC_ASSERT(std::abs(whole[k] - expected[k]) < 1. + 1e-9);
      mean[k] += whole[k] / double(lots);
    }
  }
  for (std::size_t k = 0; k < mean.size(); ++k) RC_ASSERT(std::abs(mean[k] - expected[k]) < 2.1 / lots);
}

TEST(ApportionByLot, WholeNumbersStayWhatTheyAre) {
  std::vector<double> thousandths(1000, 1e6 / 1000.);
  thousandths[0] = .1 + .2 + .7;  // 1 by some roundings
  for (const double lot : {0., 1e-12, .5, std::nextafter(1., 0.)}) {
    const auto whole = apportion_by_lot(thousandths, lot);
    EXPECT_EQ(whole[0], 1u) << lot;
    EXPECT_EQ(std::accumulate(whole.begin(), whole.end(), 0u), 999'001u) << lot;
  }
}

TEST(Recipe, AnAddedTypeTakesItsFractionOfEveryLayer) {
  const Recipe recipe =
      with_type(parse_recipe(good, "x.toml"), {.name = "traced", .population = "traced"}, .2);
  check(recipe);
  for (const auto& layer : recipe.layers) EXPECT_DOUBLE_EQ(layer.mix[2], .2);
  EXPECT_DOUBLE_EQ(recipe.layers[0].mix[1], .6);
}

struct Mistake {
  const char* from;
  const char* to;
  std::size_t line;
  const char* says;
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.to; }

class RecipeMistake : public testing::TestWithParam<Mistake> {};

TEST_P(RecipeMistake, IsNamedWithItsLineAndRemedy) {
  const Mistake& mistake = GetParam();
  try {
    parse_recipe(with(mistake.from, mistake.to), "bad.toml");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "bad.toml");
    EXPECT_EQ(error.line(), mistake.line) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(mistake.says));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Every, RecipeMistake,
    testing::Values(Mistake{"radius = 100 ", "radius = ", 6, "not TOML"},
                    Mistake{"radius = 100 ", "radius = \"wide\"", 6, "must be a number"},
                    Mistake{"radius = 100 ", "radius = -100", 6, "must be a number"},
                    Mistake{"radius = 100 ", "radius = nan", 6, "must be a number"},
                    Mistake{"radius = 100 ", "diameter = 100", 6, "no key \"diameter\""},
                    Mistake{"name = \"two layers\"", "title = \"two layers\"", 1, "no key \"title\""},
                    Mistake{"neurons = 10", "neurons = -10", 2, "whole number"},
                    Mistake{"neurons = 10", "neurons = 10.5", 2, "whole number"},
                    Mistake{"rotate = false", "rotate = \"no\"", 3, "true or false"},
                    Mistake{"name = \"small\"", "name = \"tall\"", 15, "two types are called tall"},
                    Mistake{"name = \"lower\"", "name = \"upper\"", 25, "two layers are called upper"},
                    Mistake{"thickness = 100\n", "", 19, "lacks \"thickness\""},
                    Mistake{"density = 1000", "", 25, "lacks \"density\""},
                    Mistake{"density = 1000", "density = 1000\ncount = 3", 28, "give one of them"},
                    Mistake{"name = \"small\"", "name = \"small\"\nslice-correction = 0.9", 17,
                            "must be a number"},
                    Mistake{"name = \"small\"", "name = \"small\"\nslice-correction = \"6\"", 17, "1 to 5"},
                    Mistake{"name = \"small\"",
                            "name = \"small\"\npopulation = \"pyramidal\"\nslice-correction = \"measured\"",
                            15, "give both the same slice-correction"},
                    Mistake{"small = 0.75", "small = 0.5", 23, "sum to 0.75; make them sum to 1"},
                    Mistake{"small = 0.75", "giant = 0.75", 23, "add a [[type]]"},
                    Mistake{"density = 3000", "count = 11", 2, "raise \"neurons\""}));

TEST(Recipe, WithoutAColumnSpeaksOfTissue) {
  std::string text(good);
  const auto cut = [&](const std::string& what) { text.erase(text.find(what), what.size()); };
  text.erase(text.find("[column]"), text.find('\n', text.find("radius")) - text.find("[column]"));
  EXPECT_THROW((void)parse_recipe(text, "tissue.toml"), InputError);  // ten neurons, but in what?
  cut("neurons = 10");
  const Recipe recipe = parse_recipe(text, "tissue.toml");
  EXPECT_EQ(recipe.radius, 0.f);
  EXPECT_EQ(slabs(recipe).size(), recipe.layers.size());
  try {
    (void)counts(recipe);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("speaks of no column"));
  }
}

TEST(Recipe, TruncatedAnywhereIsAnErrorOrAValueNeverACrash) {
  for (std::size_t length = 0; length < good.size(); ++length) {
    try {
      parse_recipe(good.substr(0, length), "short.toml");
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "short.toml");
    }
  }
}

TEST(Recipe, WhatIsNotUtf8IsRefusedWithItsLine) {
  using namespace std::string_literals;
  for (const std::string& bytes :
       {"\x80"s, "\xc1\x81"s, "\xc3("s, "\xe0\x9f\x80"s, "\xed\xa0\x80"s, "\xe2\x82"s, "\xf0\x8f\x80\x80"s,
        "\xf4\x90\x80\x80"s, "\xf5\x80\x80\x80"s, "\xff"s})
    for (const std::string& quote : {"'"s, "\""s, "'''"s, "#"s, ""s}) {
      const std::string error =
          refused([&] { parse_recipe("rotate = true\n" + quote + bytes + quote + " = 1\n", "r.toml"); });
      EXPECT_THAT(error, testing::HasSubstr("invalid utf-8"));
      EXPECT_THAT(error, testing::ContainsRegex(quote.empty() ? "^r.toml:[12]: this is not TOML: "
                                                              : "^r.toml:2: this is not TOML: "));
    }
  // What is, goes on to what the recipe says.
  for (const std::string& text : {"é"s, "\xef\xbf\xbf"s, "\xf4\x8f\xbf\xbf"s, "\xed\x9f\xbf"s})
    EXPECT_EQ(refused([&] { parse_recipe("name = '" + text + "'\n", "r.toml"); }).find("UTF-8"),
              std::string::npos);
}

TEST(Recipe, EndlessBracketsAreRefused) {
  EXPECT_THROW(parse_recipe("x = " + std::string(1000000, '['), "deep.toml"), InputError);
  EXPECT_THROW(parse_recipe("x = " + std::string(1000000, '{'), "deep.toml"), InputError);
  std::string dotted = "x";
  for (int i = 0; i < 1000000; ++i) dotted += ".x";
  EXPECT_THROW(parse_recipe(dotted + " = 1", "deep.toml"), InputError);
  EXPECT_THROW(parse_recipe("[" + dotted + "]", "deep.toml"), InputError);
}

TEST(Recipe, ShippedColumnsHoldTheirNumberOfNeurons) {
  const auto recipes = std::filesystem::path(FOREST_SOURCE_DIR) / "data" / "recipes";
  for (const std::uint32_t neurons : {1000u, 10000u}) {
    const Recipe recipe = read_recipe(recipes / ("column-" + std::to_string(neurons) + ".toml"));
    std::uint32_t sum = 0;
    for (const auto& layer : counts(recipe)) sum = std::accumulate(layer.begin(), layer.end(), sum);
    EXPECT_EQ(sum, neurons);
  }
  EXPECT_EQ(read_recipe(recipes / "column-1000.toml").radius, 250.f);
}

}  // namespace
}  // namespace forest::circuit
