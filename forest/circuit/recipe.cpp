// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/recipe.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include <fmt/format.h>

#include "forest/circuit/toml_node.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/number.h"

namespace forest::circuit {
namespace {

constexpr double most_neurons = Node::most;  // more do not fit the memory of any machine this runs on
constexpr double fraction_slack = 1e-3;      // people write 0.33 + 0.33 + 0.34

constexpr double longest = Node::longest;

CellType read_type(const Node& node) {
  node.allow({"name", "population", "grammar", "slice-correction", "excitatory", "glia"});
  CellType type;
  type.name = node.at("name").string();
  type.population = node.find("population") ? node.at("population").string() : type.name;
  if (const auto glia = node.find("glia")) type.glia = glia->boolean();
  if (const auto excitatory = node.find("excitatory")) {
    type.excitatory = excitatory->boolean();
    if (type.glia)
      excitatory->refuse(
          fmt::format("{} is glia, which neither excites nor inhibits; take this out", type.name));
  }
  return type;
}

std::vector<double> read_mix(const Node& node, std::span<const CellType> types, const std::string& layer) {
  std::vector<double> mix(types.size());
  for (const auto& [key, unused] : node.table()) {
    const std::string_view name = key.str();
    const auto type = std::ranges::find(types, name, &CellType::name);
    if (type == types.end())
      node.at(name).refuse(fmt::format(
          "layer {} holds neurons of type \"{}\", which is not declared; add a [[type]] of that name", layer,
          name));
    mix[std::size_t(type - types.begin())] = node.at(name).number(0., 1., "");
  }
  const double sum = std::accumulate(mix.begin(), mix.end(), 0.);
  if (std::abs(sum - 1.) > fraction_slack)
    node.refuse(
        fmt::format("the fractions of the types of layer {} sum to {:.6g}; make them sum to 1", layer, sum));
  for (double& fraction : mix) fraction /= sum;
  return mix;
}

Recipe::Layer read_layer(const Node& node, std::span<const CellType> types) {
  node.allow({"name", "thickness", "density", "count", "mix"});
  Recipe::Layer layer;
  layer.name = node.at("name").string();
  layer.thickness = float(node.at("thickness").number(1e-3, longest, "µm"));
  if (const auto count = node.find("count")) {
    layer.count = count->whole();
    if (const auto density = node.find("density"))
      density->refuse(fmt::format("layer {} has a count and a density; give one of them", layer.name));
  } else {
    layer.density = node.at("density").number(0., 1e9, "neurons/mm³");
  }
  layer.mix = read_mix(node.at("mix"), types, layer.name);
  return layer;
}

std::optional<SliceCorrection> read_correction(const Node& type) {
  const auto node = type.find("slice-correction");
  if (!node) return std::nullopt;
  if (!node->is_string()) return SliceCorrection{float(node->number(1., SliceCorrection::most, "times"))};
  try {
    return parse_slice_correction(node->string());
  } catch (const Error& error) {
    node->refuse(error.what());
  }
}

Recipe read_root(const Node& root) {
  root.allow({"name", "neurons", "rotate", "column", "soma", "type", "layer"});
  Recipe recipe;
  recipe.name = root.at("name").string();
  if (const auto neurons = root.find("neurons")) recipe.neurons = neurons->whole();
  if (const auto rotate = root.find("rotate")) recipe.rotate = rotate->boolean();
  const auto column = root.find("column");
  if (column) {
    column->allow({"radius"});
    recipe.radius = float(column->at("radius").number(1e-3, longest, "µm"));
  }
  if (const auto soma = root.find("soma")) {
    soma->allow({"gap"});
    recipe.soma_gap = float(soma->at("gap").number(0., 1e4, "µm"));
  }
  std::unordered_set<std::string> seen;
  for (const Node& node : root.tables("type")) {
    recipe.types.push_back(read_type(node));
    const auto grammar = node.find("grammar");
    recipe.sources.push_back({grammar ? grammar->string() : "", read_correction(node)});
    if (grammar && node.find("population"))
      grammar->refuse(
          fmt::format("type {} has a grammar and a population; give one of them", recipe.types.back().name));
    for (std::size_t other = 0; !grammar && other + 1 < recipe.types.size(); ++other)
      if (recipe.sources[other].grammar.empty() &&
          recipe.sources[other].slice != recipe.sources.back().slice &&
          recipe.types[other].population == recipe.types.back().population)
        node.refuse(
            fmt::format("types {} and {} come from population {}; give both the same slice-correction",
                        recipe.types[other].name, recipe.types.back().name, recipe.types[other].population));
    if (!seen.insert(recipe.types.back().name).second)
      node.refuse(fmt::format("two types are called {}; names must differ", recipe.types.back().name));
  }
  seen.clear();
  for (const Node& node : root.tables("layer")) {
    recipe.layers.push_back(read_layer(node, recipe.types));
    if (!seen.insert(recipe.layers.back().name).second)
      node.refuse(fmt::format("two layers are called {}; names must differ", recipe.layers.back().name));
  }
  try {
    check(recipe);
  } catch (const Error& error) {  // a sentence about the numbers as a whole
    (root.find("neurons") ? root.at("neurons") : column ? *column : root).refuse(error.what());
  }
  return recipe;
}

}  // namespace

Recipe parse_recipe(std::string_view text, const std::string& file) {
  const toml::table root = parse_toml(text, file);
  return read_root(Node(root, file, "the recipe"));
}

Recipe read_recipe(const std::filesystem::path& path) {
  return parse_recipe(MappedFile(path).text(), path.string());
}

SliceCorrection parse_slice_correction(std::string_view words) {
  if (words == "measured") return {.measured = true};
  const auto factor = number_of<float>(words);
  if (!factor || !(*factor >= 1.f && *factor <= SliceCorrection::most))
    throw Error(fmt::format(
        "'{}' corrects no slice; give \"measured\", or how many times neurons are stretched along z, 1 to "
        "{:g}",
        words, SliceCorrection::most));
  return {.factor = *factor};
}

const Recipe::Source& source_of(const Recipe& recipe, std::size_t type) {
  static const Recipe::Source none;
  return type < recipe.sources.size() ? recipe.sources[type] : none;
}

void check(const Recipe& recipe) {
  (void)slabs(recipe);  // throws when a length is none
  if (recipe.types.empty()) throw Error("a recipe needs at least one cell type");
  if (!(recipe.soma_gap >= 0.f)) throw Error("the gap between somata must not be negative");
  for (const Recipe::Layer& layer : recipe.layers) {
    const double sum = std::accumulate(layer.mix.begin(), layer.mix.end(), 0.);
    if (layer.mix.size() != recipe.types.size() || !(std::abs(sum - 1.) < 1e-6) ||
        std::ranges::any_of(layer.mix, [](double x) { return x < 0.; }))
      throw Error(fmt::format("layer {} needs a fraction for each of the {} types, and they must sum to 1",
                              layer.name, recipe.types.size()));
    if (!(layer.density >= 0.))
      throw Error(fmt::format("the density of layer {} must not be negative", layer.name));
  }
  const bool counted =
      recipe.neurons || std::ranges::any_of(recipe.layers, [](const auto& l) { return l.count.has_value(); });
  if (recipe.radius != 0.f || counted) counts(recipe);  // throws when they do not work out
}

namespace {

cortex::Column column_of(const Recipe& recipe, float radius) {
  std::vector<cortex::Column::Layer> layers;
  for (const Recipe::Layer& layer : recipe.layers) layers.push_back({layer.name, layer.thickness});
  return cortex::Column(radius, layers);
}

}  // namespace

cortex::Column column(const Recipe& recipe) {
  if (recipe.radius == 0.f)
    throw Error(
        "the recipe says how many neurons stand in a column (neurons, count), and speaks of no column; add "
        "[column] with its radius, or give densities alone and plant it in elements (--elements)");
  return column_of(recipe, recipe.radius);
}

std::vector<cortex::Slab> slabs(const Recipe& recipe) {
  const cortex::Column tissue = column_of(recipe, 1.f);  // whatever its radius
  return {tissue.layers().begin(), tissue.layers().end()};
}

std::vector<std::uint32_t> apportion(std::uint32_t total, std::span<const double> weights) {
  std::vector<std::uint32_t> shares(weights.size());
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.);
  if (!(sum > 0.)) return shares;

  std::vector<std::pair<double, std::size_t>> remainders;
  std::uint32_t given = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double quota = double(total) * (weights[i] / sum);
    shares[i] = std::uint32_t(quota);
    given += shares[i];
    remainders.emplace_back(quota - double(shares[i]), i);
  }
  std::ranges::stable_sort(remainders, std::greater{}, &std::pair<double, std::size_t>::first);
  for (std::size_t k = 0; given < total; ++given, ++k) ++shares[remainders[k % remainders.size()].second];
  return shares;
}

std::vector<std::uint32_t> apportion_by_lot(std::span<const double> expected, double lot) {
  // Sums of numbers that should be whole are off by rounding: none is within it of a mark.
  constexpr double rounding = 1e-6;
  const double first = std::clamp(lot, rounding, 1. - rounding);
  std::vector<std::uint32_t> whole;
  double sum = 0., marks = 0.;
  for (const double next : expected) {
    sum += next;
    const double below = std::floor(sum + first);
    whole.push_back(std::uint32_t(below - marks));
    marks = below;
  }
  return whole;
}

std::vector<std::vector<std::uint32_t>> counts(const Recipe& recipe) {
  const cortex::Column tissue = column(recipe);
  std::vector<double> expected;  // of the layers whose number follows from a density
  double fixed = 0.;
  for (std::size_t i = 0; i < recipe.layers.size(); ++i) {
    const auto& layer = recipe.layers[i];
    if (layer.count) fixed += *layer.count;
    expected.push_back(layer.count ? 0. : layer.density * tissue.volume(i) * 1e-9);
  }
  const double sum = std::accumulate(expected.begin(), expected.end(), 0.);
  const double rest = recipe.neurons ? double(*recipe.neurons) - fixed : std::round(sum);
  if (rest + fixed > most_neurons)
    throw Error(
        fmt::format("the recipe asks for {:.3g} neurons, more than the {:.0f} that can be planted; lower its "
                    "densities or radius",
                    rest + fixed, most_neurons));
  if (rest < 0.)
    throw Error(
        fmt::format("the counts of the layers sum to {:.0f}, but the recipe has {} neurons; raise "
                    "\"neurons\" or lower the counts",
                    fixed, *recipe.neurons));
  if (rest > 0. && sum <= 0.)
    throw Error(
        fmt::format("{:.0f} neurons are left over, but no layer has a density to share them by; give one a "
                    "density, or make the counts sum to {}",
                    rest, *recipe.neurons));

  const auto by_density = apportion(std::uint32_t(rest), expected);
  std::vector<std::vector<std::uint32_t>> result;
  for (std::size_t i = 0; i < recipe.layers.size(); ++i)
    result.push_back(apportion(recipe.layers[i].count.value_or(by_density[i]), recipe.layers[i].mix));
  return result;
}

Recipe with_type(Recipe recipe, CellType type, double fraction, float height) {
  if (!(fraction >= 0. && fraction <= 1.)) throw Error("the fraction of an added type must be from 0 to 1");
  recipe.types.push_back(std::move(type));
  float depth = 0.f;
  for (Recipe::Layer& layer : recipe.layers) {
    depth += layer.thickness;
    const double taken = depth >= height ? fraction : 0.;
    for (double& share : layer.mix) share *= 1. - taken;
    layer.mix.push_back(taken);
  }
  return recipe;
}

}  // namespace forest::circuit
