// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/measured_layers.h"

#include <array>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::circuit {
namespace {

// The longest ones first, so that IV is not I.
constexpr std::array<std::pair<std::string_view, std::size_t>, 9> roman{
    {{"VIII", 8}, {"VII", 7}, {"III", 3}, {"VI", 6}, {"IV", 4}, {"IX", 9}, {"II", 2}, {"V", 5}, {"I", 1}}};

// A number at the beginning of the text, which loses it; 0: none.
std::size_t take_number(std::string_view& text) {
  if (!text.empty() && text[0] >= '1' && text[0] <= '9') {
    const auto number = std::size_t(text[0] - '0');
    text.remove_prefix(1);
    return number;
  }
  for (const auto& [letters, number] : roman)
    if (text.starts_with(letters)) {
      text.remove_prefix(letters.size());
      return number;
    }
  return 0;
}

struct Named {
  std::vector<LayerNumbers> numbers;  // of the recipe's layers
  std::vector<double> thickness;      // of each map: of all layers that share it
  std::string fault;                  // a sentence; empty: names say it all
  bool unknown = false;               // … because a name says nothing
};
Named by_name(const Recipe& recipe, std::size_t maps) {
  Named named{{}, std::vector<double>(maps, 0.), {}};
  for (const Recipe::Layer& layer : recipe.layers) {
    const auto found = layer_numbers(layer.name);
    if (found && found->last > maps) {
      named.fault = fmt::format("layer {} of the recipe needs a measured layer {}, and {} {} given; give all",
                                layer.name, found->last, maps, maps == 1 ? "is" : "are");
      return named;
    }
    if (!found) {
      named.unknown = true;
      named.fault = fmt::format(
          "layer {} of the recipe is none of the {} measured ones by its name; call it L1, L2/3 or Va, or "
          "give one map for each of its {} layers",
          layer.name, maps, recipe.layers.size());
      return named;
    }
    if (!named.numbers.empty() && found->first < named.numbers.back().last) {
      named.fault =
          fmt::format("layer {} of the recipe lies under {}; layers must be in the order of their numbers",
                      layer.name, recipe.layers[named.numbers.size() - 1].name);
      return named;
    }
    named.numbers.push_back(*found);
    for (std::size_t m = found->first; m <= found->last; ++m)
      named.thickness[m - 1] += double(layer.thickness);
  }
  for (std::size_t m = 0; m < maps; ++m)
    if (named.thickness[m] == 0.) {
      named.fault = fmt::format(
          "no layer of the recipe is the measured layer {}; add one, of density 0 if nothing stands in it",
          m + 1);
      return named;
    }
  return named;
}

}  // namespace

std::optional<LayerNumbers> layer_numbers(std::string_view name) {
  for (const std::string_view word : {"Layer", "layer", "L"})
    if (name.starts_with(word)) {
      name.remove_prefix(word.size());
      break;
    }
  while (name.starts_with(' ')) name.remove_prefix(1);
  LayerNumbers numbers;
  numbers.first = numbers.last = take_number(name);
  if (!numbers.first) return std::nullopt;
  while (!name.empty()) {
    std::string_view rest = name;
    if (rest.starts_with('/') || rest.starts_with('-')) rest.remove_prefix(1);
    const std::size_t next = take_number(rest);
    if (next != numbers.last + 1) break;
    numbers.last = next, name = rest;
  }
  return numbers;
}

std::string doubt_of_maps(const Recipe& recipe, std::size_t maps) {
  const Named named = by_name(recipe, maps);
  if (named.fault.empty() || named.unknown || recipe.layers.size() != maps) return {};
  return fmt::format("the {} maps are taken for the {} layers of the recipe in their order, though {}", maps,
                     recipe.layers.size(), named.fault);
}

std::vector<std::vector<float>> maps_of_layers(const Recipe& recipe,
                                               const std::vector<std::vector<float>>& maps) {
  const Named named = by_name(recipe, maps.size());
  if (!named.fault.empty()) {
    if (recipe.layers.size() == maps.size()) return maps;
    throw Error(named.fault);
  }
  std::vector<std::vector<float>> result;
  for (std::size_t l = 0; l < recipe.layers.size(); ++l) {
    std::vector<float> sum(maps[0].size(), 0.f);
    for (std::size_t m = named.numbers[l].first - 1; m < named.numbers[l].last; ++m) {
      const auto share = float(double(recipe.layers[l].thickness) / named.thickness[m]);
      for (std::size_t v = 0; v < sum.size(); ++v) sum[v] += share * maps[m][v];
    }
    result.push_back(std::move(sum));
  }
  return result;
}

}  // namespace forest::circuit
