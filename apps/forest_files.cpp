// SPDX-License-Identifier: Apache-2.0
#include "apps/forest_files.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/io/format.h"

namespace forest {
namespace {

// Each beside the one before it.
scene::Forest side_by_side(const std::vector<Morphology>& neurons, std::vector<std::string> names) {
  constexpr float apart = 50.f;  // µm
  circuit::Circuit circuit;
  circuit.name = names.size() == 1 ? names[0] : "neurons";
  circuit.layers = {{"traced", -1.f, 1.f}};
  float right = 0.f;
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const Bounds box = neurons[i].bounds();
    const Vec3 soma = neurons[i].soma().sphere().position();
    const float left = box.empty() ? 0.f : box.low.x() - soma.x(),
                wide = box.empty() ? 0.f : box.extent().x();
    circuit::Instance instance;
    instance.position.x() = i == 0 ? 0.f : right + apart - left;
    right = instance.position.x() + left + wide;
    instance.morphology = instance.type = std::uint32_t(i);
    circuit.instances.push_back(instance);
    circuit.types.push_back({names[i], "traced"});
  }
  circuit.morphologies = std::move(names);
  return scene::Forest::from_bytes(scene::pack(circuit, neurons));
}

}  // namespace

bool holds_cells(const std::filesystem::path& file) {
  const std::string ending = lower(file.extension().string());
  return std::ranges::any_of(io::formats(), [&](const io::Format& format) {
    return format.read && std::ranges::find(format.extensions, ending) != format.extensions.end();
  });
}

scene::Forest open_forest(const std::filesystem::path& file) {
  if (!holds_cells(file)) return scene::Forest::open(file);
  constexpr std::size_t most = 100;
  const MappedFile bytes(file);
  const io::CellReader cells = io::read_each(io::format_of(file, bytes.text()), bytes.text(), file.string());
  if (cells.count > most)
    throw InputError(file.string(), 0,
                     fmt::format("holds {} neurons, and at most {} are shown side by side; plant them by a "
                                 "recipe and give the forest of 'brainforest pack'",
                                 cells.count, most));
  std::vector<Morphology> neurons;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < cells.count; ++i) {
    io::Cell cell = cells.read(i);
    std::string name = cell.name.empty() ? file.stem().string() : cell.name;
    if (std::ranges::find(names, name) != names.end()) name += fmt::format(" ({})", i + 1);
    names.push_back(std::move(name)), neurons.push_back(std::move(cell.read.morphology));
  }
  return side_by_side(neurons, std::move(names));
}

}  // namespace forest
