// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/environment.h"

#include "forest/circuit/recipe.h"
#include "forest/circuit/toml_node.h"
#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest::circuit {
namespace {

cortex::Column::Layer read_layer(const Node& node) {
  node.allow({"name", "thickness"});
  return {node.at("name").string(), float(node.at("thickness").number(1e-3, Node::longest, "µm"))};
}

Sphere read_soma(const Node& node) {
  node.allow({"at", "radius"});
  return {node.at("at").place(), float(node.at("radius").number(0., 1e3, "µm"))};
}

cortex::Attractor read_attractor(const Node& node) {
  node.allow({"at", "strength", "reach"});
  cortex::Attractor attractor{.at = node.at("at").place()};
  if (const auto strength = node.find("strength"))
    attractor.strength = float(strength->number(-1e6, 1e6, ""));
  if (const auto reach = node.find("reach"))
    attractor.reach = float(reach->number(1e-3, Node::longest, "µm"));
  return attractor;
}

template <class Thing>
std::vector<Thing> read_all(const Node& root, const std::string& key, Thing (*read)(const Node&)) {
  std::vector<Thing> things;
  if (root.find(key))
    for (const Node& node : root.tables(key)) things.push_back(read(node));
  return things;
}

std::vector<cortex::Slab> slabs(std::span<const cortex::Column::Layer> layers) {
  if (layers.empty()) return {};
  const cortex::Column column(1.f, layers);
  return {column.layers().begin(), column.layers().end()};
}

}  // namespace

cortex::Environment parse_environment(std::string_view text, const std::string& file) {
  const toml::table value = parse_toml(text, file);
  const Node root(value, file, "the environment");
  if (root.find("type")) {
    return cortex::Environment(slabs(parse_recipe(text, file)));
  }
  root.allow({"name", "layer", "soma", "attractor"});
  auto layers = slabs(read_all(root, "layer", read_layer));
  auto somata = read_all(root, "soma", read_soma);
  auto attractors = read_all(root, "attractor", read_attractor);
  if (layers.empty() && somata.empty() && attractors.empty())
    throw InputError(file, 0,
                     "there is nothing in this environment; add a [[layer]], a [[soma]] or an [[attractor]]");
  return cortex::Environment(std::move(layers), std::move(somata), std::move(attractors));
}

cortex::Environment read_environment(const std::filesystem::path& path) {
  return parse_environment(MappedFile(path).text(), path.string());
}

cortex::Environment environment(const Circuit& circuit, std::span<const float> soma_radii) {
  std::vector<cortex::Slab> layers;
  for (const Layer& layer : circuit.layers) layers.push_back({layer.name, layer.bottom, layer.top});
  std::vector<Sphere> somata;
  for (const Instance& i : circuit.instances) somata.push_back({i.position, soma_radii[i.morphology]});
  return cortex::Environment(std::move(layers), std::move(somata));
}

}  // namespace forest::circuit
