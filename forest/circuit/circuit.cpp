// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/circuit.h"

#include <cmath>
#include <numbers>
#include <unordered_set>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::circuit {
namespace {

void check_name(const std::string& name, const char* what, std::unordered_set<std::string>& seen) {
  if (name.empty()) throw Error(fmt::format("a {} of the circuit has no name; give it one", what));
  if (!seen.insert(name).second)
    throw Error(fmt::format("two {}s of the circuit are called {}; names must differ", what, name));
}

}  // namespace

void check(const Circuit& circuit) {
  std::unordered_set<std::string> layers, types, morphologies;
  for (const Layer& layer : circuit.layers) {
    check_name(layer.name, "layer", layers);
    if (!std::isfinite(layer.bottom) || !std::isfinite(layer.top) || layer.bottom > layer.top)
      throw Error(fmt::format("layer {} goes from y = {} to {} µm; its top must lie above its bottom",
                              layer.name, layer.bottom, layer.top));
  }
  for (const CellType& type : circuit.types) check_name(type.name, "cell type", types);
  for (const std::string& name : circuit.morphologies) check_name(name, "morphology", morphologies);
  if (!std::isfinite(circuit.radius) || circuit.radius < 0.f)
    throw Error(fmt::format(
        "the radius of the circuit is {} µm; it must be positive, or 0 for a tissue that is no column",
        circuit.radius));

  if (!circuit.up.allFinite() || !(circuit.up.norm() > 1e-3f))
    throw Error(fmt::format("the way up of the circuit is ({}, {}, {}); give a direction", circuit.up.x(),
                            circuit.up.y(), circuit.up.z()));
  for (const auto& line : circuit.outline)
    for (const Vec3& p : line)
      if (!p.allFinite()) throw Error("a line of the circuit's outline is not finite; plant it again");

  const auto& seats = circuit.in_elements;
  if (!seats.empty() && seats.size() != circuit.instances.size())
    throw Error(fmt::format(
        "the circuit says of {} neurons in which element they stand, and has {}; say it of all or none",
        seats.size(), circuit.instances.size()));
  for (std::size_t i = 0; i < seats.size(); ++i)
    if (!((seats[i].uvw.array() >= 0.f) && (seats[i].uvw.array() <= 1.f)).all())
      throw Error(
          fmt::format("neuron {} stands at (u, v, w) = ({}, {}, {}) of its element; they must lie in 0 to 1",
                      i, seats[i].uvw.x(), seats[i].uvw.y(), seats[i].uvw.z()));
  for (std::size_t i = 0; i < circuit.instances.size(); ++i) {
    const Instance& instance = circuit.instances[i];
    const auto within = [&](std::uint32_t index, std::size_t count, const char* what) {
      if (index >= count)
        throw Error(
            fmt::format("neuron {} has {} number {}, but the circuit has {} of them", i, what, index, count));
    };
    within(instance.layer, circuit.layers.size(), "layer");
    within(instance.type, circuit.types.size(), "cell type");
    within(instance.morphology, circuit.morphologies.size(), "morphology");
    if (!instance.position.allFinite())
      throw Error(fmt::format("the position of neuron {} is not finite", i));
    constexpr float farthest = 1e8f;  // µm, 100 m
    if (!(instance.position.cwiseAbs().maxCoeff() < farthest))
      throw Error(fmt::format(
          "neuron {} stands at ({:.3g}, {:.3g}, {:.3g}) µm, farther than any brain; mend its place", i,
          instance.position.x(), instance.position.y(), instance.position.z()));
    if (!(std::abs(instance.orientation.norm() - 1.f) < 1e-3f))
      throw Error(fmt::format("the orientation of neuron {} is not a unit quaternion", i));
  }
}

std::vector<Tally> tally(const Circuit& circuit) {
  const std::size_t types = circuit.types.size();
  std::vector<std::size_t> counts(circuit.layers.size() * types);
  for (const Instance& instance : circuit.instances) ++counts[instance.layer * types + instance.type];

  std::vector<Tally> rows;
  for (std::uint32_t layer = 0; layer < circuit.layers.size(); ++layer) {
    const double r = double(circuit.radius),
                 thickness = double(circuit.layers[layer].top - circuit.layers[layer].bottom);
    const double volume = std::numbers::pi * r * r * thickness * 1e-9;  // mm³
    for (std::uint32_t type = 0; type < types; ++type)
      if (const std::size_t count = counts[layer * types + type])
        rows.push_back({layer, type, count, volume > 0. ? double(count) / volume : 0.});
  }
  return rows;
}

}  // namespace forest::circuit
