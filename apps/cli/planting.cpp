// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/planting.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "forest/circuit/plant.h"
#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/morphology/transform.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using repository::Access;
using repository::NeuronRow;
using repository::Repository;

/// The neurons of every population that the recipe plants from.
std::vector<NeuronRow> rows_for(const circuit::Recipe& recipe, const std::string& repo) {
  const auto wanted = circuit::counts(recipe);
  const Repository repository = Repository::open(repo, Access::read);
  std::vector<NeuronRow> rows;
  std::set<std::string> populations;
  for (std::size_t type = 0; type < recipe.types.size(); ++type) {
    const std::string& population = recipe.types[type].population;
    if (std::ranges::all_of(wanted, [&](const auto& layer) { return layer[type] == 0; }) ||
        !populations.insert(population).second)
      continue;
    const auto found = repository.neurons(population);
    if (found.empty())
      throw Error(fmt::format(
          "{0}: recipe {1} plants {2}s from population {3}, which is empty; grow neurons into it "
          "(brainforest grow --grammar NAME --count 30 --repo {0} --population {3}) or import them "
          "(brainforest import FILES --repo {0} --population {3})",
          repo, recipe.name, recipe.types[type].name, population));
    rows.insert(rows.end(), found.begin(), found.end());
  }
  return rows;
}

/// File names, all different: names in a repository are unique in their population only.
std::vector<std::string> names_of(const std::vector<NeuronRow>& rows) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const NeuronRow& row : rows) {
    std::string name = repository::file_name(row.name);
    if (taken.contains(name)) name = repository::file_name(row.population + "-" + row.name);
    for (int copy = 2; taken.contains(name); ++copy)
      name = repository::file_name(fmt::format("{}-{}-{}", row.population, row.name, copy));
    taken.insert(name);
    names.push_back(std::move(name));
  }
  return names;
}

/// A type all of whose cells have no other processes than those of glia is glia, also when the recipe does not say so.
void mark_glia(Planted& planted) {
  std::vector<char> glial(planted.morphologies.size());
  for (std::size_t i = 0; i < glial.size(); ++i) {
    const auto sections = planted.morphologies[i].sections();
    glial[i] = !sections.empty() &&
               std::ranges::all_of(sections, [](const Section& s) { return s.kind == SectionKind::glia; });
  }
  std::vector<std::size_t> cells(planted.circuit.types.size()), of_glia(cells);
  for (const circuit::Instance& i : planted.circuit.instances)
    ++cells[i.type], of_glia[i.type] += glial[i.morphology] != 0;
  for (std::size_t t = 0; t < cells.size(); ++t)
    if (cells[t] && cells[t] == of_glia[t]) planted.circuit.types[t].glia = true;
}

}  // namespace

circuit::Recipe find_recipe(const std::string& name_or_path) {
  const fs::path folder = data_folder() / "recipes";
  if (fs::exists(name_or_path)) return circuit::read_recipe(name_or_path);
  if (const fs::path shipped = folder / (name_or_path + ".toml"); fs::exists(shipped))
    return circuit::read_recipe(shipped);
  std::set<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".toml") names.insert(entry.path().stem().string());
  throw InputError(name_or_path, 0,
                   fmt::format("is neither a file nor a recipe that ships with Brain Forest; those are {}",
                               fmt::join(names, ", ")));
}

Planted plant_from_repository(const circuit::Recipe& recipe, const std::string& repo, std::uint64_t seed,
                              Progress& progress) {
  const auto rows = rows_for(recipe, repo);
  const auto names = names_of(rows);
  std::vector<Morphology> neurons(rows.size());
  std::vector<circuit::Candidate> candidates(rows.size());
  progress.begin("loading", rows.size());
  parallel_ranges(rows.size(), 64, [&](std::size_t begin, std::size_t end) {
    const Repository repository = Repository::open(repo, Access::read);  // an object belongs to one thread
    for (std::size_t i = begin; i < end; ++i) {
      neurons[i] = centred(repository.morphology(rows[i].id));
      candidates[i] = {names[i], rows[i].population, neurons[i].soma().sphere().radius,
                       neurons[i].bounds().empty() ? 0.f : neurons[i].bounds().high.y()};
      progress.advance();
    }
  });
  progress.end();

  Planted planted{circuit::plant(recipe, candidates, seed, progress), {}};
  for (std::size_t i = 0; i < names.size(); ++i)  // the circuit keeps the order of the candidates
    if (planted.morphologies.size() < planted.circuit.morphologies.size() &&
        planted.circuit.morphologies[planted.morphologies.size()] == names[i])
      planted.morphologies.push_back(neurons[i]);
  mark_glia(planted);
  return planted;
}

}  // namespace forest::cli
