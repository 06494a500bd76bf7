// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/grown_column.h"

#include <cmath>
#include <map>

#include <fmt/format.h>

#include "forest/circuit/plant.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"

#include "apps/cli/console.h"
#include "apps/cli/grammars.h"
#include "apps/cli/options.h"
#include "apps/cli/planting.h"

namespace forest::cli {
namespace {

struct Share {
  const char* grammar;
  std::uint32_t of_five;
};
constexpr Share shares[] = {{"pyramidal", 3}, {"purkinje", 1}, {"motoneuron", 1}};

}  // namespace

void add_planted(CLI::App& command, std::uint32_t& neurons) {
  add_whole(command, "--neurons", neurons, "Neurons planted, at the density of the recipe column-10000", 10,
            10'000'000);
}

GrownColumn planted_column(std::uint32_t neurons_planted, std::uint64_t seed, Console& console,
                           std::uint32_t shapes) {
  std::vector<circuit::Candidate> candidates;
  std::vector<Morphology> neurons;
  for (const Share& share : shares)
    for (const Morphology& m : lsystem::grow_population(
             find_grammar(share.grammar), shapes * share.of_five / 5, seed, console.progress())) {
      candidates.push_back({fmt::format("{}-{}", share.grammar, candidates.size()), share.grammar,
                            m.soma().sphere().radius, centred(m).bounds().high.y()});
      neurons.push_back(centred(m));
    }
  circuit::Recipe recipe = find_recipe("column-10000");
  recipe.radius *= std::sqrt(float(neurons_planted) / 10000.f);  // the same density
  recipe.neurons = neurons_planted;
  circuit::Circuit circuit = circuit::plant(recipe, candidates, seed, console.progress());
  std::map<std::string, const Morphology*> by_name;
  for (std::size_t i = 0; i < candidates.size(); ++i) by_name[candidates[i].name] = &neurons[i];
  std::vector<Morphology> planted;
  for (const std::string& name : circuit.morphologies) planted.push_back(*by_name.at(name));
  return {std::move(circuit), std::move(planted)};
}

std::vector<std::byte> packed_column(std::uint32_t neurons, std::uint64_t seed, Console& console) {
  const GrownColumn column = planted_column(neurons, seed, console);
  return scene::pack(column.circuit, column.neurons, console.progress());
}

scene::Forest grown_column(std::uint32_t neurons, std::uint64_t seed, Console& console) {
  return scene::Forest::from_bytes(packed_column(neurons, seed, console));
}

}  // namespace forest::cli
