// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/planting.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <span>

#include <fmt/format.h>

#include "forest/circuit/environment.h"
#include "forest/circuit/plant.h"
#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"
#include "forest/statistics/flattening.h"

#include "apps/cli/console.h"
#include "apps/cli/grammars.h"
#include "apps/cli/neurons.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using repository::Access;
using repository::NeuronRow;
using repository::Repository;

const std::string& grammar_of(const circuit::Recipe& recipe, std::size_t type) {
  return source_of(recipe, type).grammar;
}

/// Stretches neurons along z, as their slice is to be corrected. Throws Error where that cannot be measured.
Unflattened unflatten(const std::string& name, const circuit::SliceCorrection& slice,
                      std::span<Morphology> neurons) {
  Unflattened result{name, slice.factor};
  if (slice.measured) {
    const auto [ratio, error] = statistics::flattening(neurons);
    if (!(ratio <= circuit::SliceCorrection::most))
      throw Error(fmt::format(
          "neurons of {} go {}, so that they are flat themselves or were traced in a plane; give their "
          "slice-correction as a number (1: as they are)",
          name,
          std::isnan(ratio) ? "nowhere along z" : fmt::format("1/{:.2g} as far along z as along x", ratio)));
    result.factor = std::max(1., ratio), result.error = error;
  }
  const Vec3 factors(1.f, 1.f, float(result.factor));
  parallel_for(neurons.size(), 8, [&](std::size_t i) { neurons[i] = stretched(neurons[i], factors); });
  return result;
}

/// The neurons of a type that grow where they stand: as many somata at first, of which the largest decides how far all of
/// them are planted from one another.
struct Seedlings {
  lsystem::Grammar grammar;
  std::vector<float> radii;  // of their somata, by the index of the neuron
};

std::vector<std::optional<Seedlings>> seedlings_of(const circuit::Recipe& recipe, std::uint64_t seed) {
  const auto wanted = circuit::counts(recipe);
  std::vector<std::optional<Seedlings>> all(recipe.types.size());
  for (std::size_t type = 0; type < all.size(); ++type) {
    if (grammar_of(recipe, type).empty()) continue;
    std::size_t count = 0;
    for (const auto& layer : wanted) count += layer[type];
    Seedlings s{find_grammar(grammar_of(recipe, type)), std::vector<float>(count)};
    parallel_ranges(count, 64, [&](std::size_t begin, std::size_t end) {
      lsystem::Deriver deriver(s.grammar);
      for (std::size_t i = begin; i < end; ++i)
        s.radii[i] = lsystem::grow_to(deriver, s.grammar, seed, i, 0).soma().sphere().radius;
    });
    all[type] = std::move(s);
  }
  return all;
}

/// Grows what stands for seedlings in the circuit, in place of their candidates.
void grow_in_place(Planted& planted, const circuit::Recipe& recipe,
                   const std::vector<std::optional<Seedlings>>& seedlings, std::uint64_t seed,
                   Progress& progress) {
  circuit::Circuit& circuit = planted.circuit;
  std::vector<std::size_t> index(circuit.instances.size());  // of its grammar
  std::vector<std::size_t> count(seedlings.size());
  std::vector<Sphere> somata;
  for (std::size_t i = 0; i < index.size(); ++i) {
    const circuit::Instance& instance = circuit.instances[i];
    index[i] = count[instance.type]++;
    const auto& own = seedlings[instance.type];
    somata.push_back(
        {instance.position,
         own ? own->radii[index[i]] : planted.morphologies[instance.morphology].soma().sphere().radius});
  }
  std::vector<cortex::Slab> layers;
  for (const circuit::Layer& layer : circuit.layers) layers.push_back({layer.name, layer.bottom, layer.top});
  const cortex::Environment environment(std::move(layers), std::move(somata));

  std::vector<Morphology> grown(index.size());
  progress.begin("growing", index.size());
  parallel_for(index.size(), 1, [&](std::size_t i) {
    const circuit::Instance& instance = circuit.instances[i];
    if (const auto& own = seedlings[instance.type])
      grown[i] = centred(
          lsystem::grow(own->grammar, seed, index[i], {&environment, instance.position, recipe.name}));
    progress.advance();
  });
  progress.end();
  for (std::size_t type = 0; type < seedlings.size(); ++type) {
    const auto& slice = source_of(recipe, type).slice;
    if (!seedlings[type] || !slice || !count[type]) continue;
    std::vector<Morphology> own;
    for (std::size_t i = 0; i < index.size(); ++i)
      if (circuit.instances[i].type == type) own.push_back(std::move(grown[i]));
    planted.unflattened.push_back(unflatten(circuit.types[type].name, *slice, own));
    for (std::size_t i = index.size(); i-- > 0;)
      if (circuit.instances[i].type == type) grown[i] = std::move(own.back()), own.pop_back();
  }

  // The morphologies that are still planted, then the grown ones.
  std::vector<std::string> names;
  std::vector<Morphology> morphologies;
  std::vector<std::uint32_t> number(planted.morphologies.size());
  std::vector<char> stays(number.size());
  for (const circuit::Instance& i : circuit.instances)
    if (!seedlings[i.type]) stays[i.morphology] = 1;
  std::set<std::string> taken;
  for (std::size_t m = 0; m < number.size(); ++m)
    if (stays[m]) {
      number[m] = std::uint32_t(names.size());
      taken.insert(circuit.morphologies[m]);
      names.push_back(circuit.morphologies[m]), morphologies.push_back(planted.morphologies[m]);
    }
  for (std::size_t i = 0; i < index.size(); ++i) {
    circuit::Instance& instance = circuit.instances[i];
    if (!seedlings[instance.type]) {
      instance.morphology = number[instance.morphology];
      continue;
    }
    std::string name = fmt::format("{}-{:05}", circuit.types[instance.type].name, index[i]);
    for (name = repository::file_name(name); !taken.insert(name).second;) name += "x";
    instance.morphology = std::uint32_t(names.size());
    instance.orientation = Quat::Identity();  // it has turned as it would
    names.push_back(std::move(name)), morphologies.push_back(std::move(grown[i]));
  }
  circuit.morphologies = std::move(names), planted.morphologies = std::move(morphologies);
}

/// The neurons of every population that the recipe plants from.
std::vector<NeuronRow> rows_for(const circuit::Recipe& recipe, const std::vector<bool>& wanted,
                                const std::string& repo) {
  std::vector<NeuronRow> rows;
  std::optional<Repository> repository;
  std::set<std::string> populations;
  std::vector<std::string> empty;
  for (std::size_t type = 0; type < recipe.types.size(); ++type) {
    const std::string& population = recipe.types[type].population;
    if (!wanted[type] || !grammar_of(recipe, type).empty() || !populations.insert(population).second)
      continue;
    if (repo.empty())
      throw Error(fmt::format("recipe {} plants {}s from population {}; name its repository with --repo",
                              recipe.name, recipe.types[type].name, population));
    if (!repository) repository.emplace(Repository::open(repo, Access::read));
    const auto found = repository->neurons(population);
    if (found.empty()) empty.push_back(population);
    rows.insert(rows.end(), found.begin(), found.end());
  }
  if (!empty.empty())
    throw Error(fmt::format(
        "{0}: recipe {1} plants from {2} {3}, which {4} empty; grow neurons into {5} (brainforest grow "
        "--grammar "
        "NAME --count 30 --repo {0} --population {6}) or import them (brainforest import FILES --repo {0} "
        "--population {6})",
        repo, recipe.name, empty.size() == 1 ? "population" : "populations", fmt::join(empty, ", "),
        empty.size() == 1 ? "is" : "are", empty.size() == 1 ? "it" : "each", empty.front()));
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

// Why it cannot be planted there, as what follows "recipe NAME"; empty where it can.
std::string unfit(const circuit::Recipe& recipe, Tissue tissue) {
  if (tissue == Tissue::column) return {};
  for (std::size_t t = 0; t < recipe.types.size(); ++t)
    if (const std::string& grammar = grammar_of(recipe, t); !grammar.empty())
      return fmt::format("grows its type {} by grammar {} where it stands, which is done in columns alone",
                         recipe.types[t].name, grammar);
  return {};
}

// Those that can be planted there.
std::vector<std::string> shipped_recipes(Tissue tissue) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(data_folder() / "recipes", ignored))
    if (entry.path().extension() == ".toml" && unfit(circuit::read_recipe(entry.path()), tissue).empty())
      names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace

circuit::Recipe find_recipe(const std::string& name_or_path, Tissue tissue) {
  const fs::path shipped = data_folder() / "recipes" / (name_or_path + ".toml");
  const bool own = fs::exists(name_or_path);
  if (!own && !fs::exists(shipped))
    throw InputError(
        name_or_path, 0,
        fmt::format("is neither a file nor a recipe that ships with Brain Forest{}; those are {}",
                    tissue == Tissue::elements ? " and can be planted in elements" : "",
                    fmt::join(shipped_recipes(tissue), ", ")));
  circuit::Recipe recipe = circuit::read_recipe(own ? fs::path(name_or_path) : shipped);
  if (const std::string why = unfit(recipe, tissue); !why.empty())
    throw Error(
        fmt::format("recipe {} {}; grow such neurons into a repository (brainforest grow) and name their "
                    "population in the "
                    "recipe instead, or give {}",
                    name_or_path, why, fmt::join(shipped_recipes(tissue), ", ")));
  return recipe;
}

Stock stock_of(const circuit::Recipe& recipe, const std::vector<bool>& wanted, const std::string& repo,
               Progress& progress) {
  const auto rows = rows_for(recipe, wanted, repo);
  const auto names = names_of(rows);
  Stock stock{std::vector<circuit::Candidate>(rows.size()), std::vector<Morphology>(rows.size())};
  each_neuron(repo, rows, "loading", progress, [&](std::size_t i, const auto& read) {
    const Morphology& neuron = stock.neurons[i] = centred(read());
    stock.candidates[i] = {names[i], rows[i].population, neuron.soma().sphere().radius,
                           neuron.bounds().empty() ? 0.f : neuron.bounds().high.y()};
  });
  for (std::size_t begin = 0, end; begin < rows.size(); begin = end) {  // each population
    const std::string& population = rows[begin].population;
    for (end = begin + 1; end < rows.size() && rows[end].population == population;) ++end;
    for (std::size_t type = 0; type < recipe.types.size(); ++type)
      if (const auto& source = source_of(recipe, type);
          recipe.types[type].population == population && source.grammar.empty() && source.slice) {
        stock.unflattened.push_back(
            unflatten(population, *source.slice, std::span(stock.neurons).subspan(begin, end - begin)));
        break;  // what other types say of it is the same
      }
  }
  return stock;
}

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

std::vector<Morphology> planted_of(const Stock& stock, const circuit::Circuit& circuit) {
  std::vector<Morphology> planted;
  for (std::size_t i = 0; i < stock.candidates.size(); ++i)  // the circuit keeps their order
    if (planted.size() < circuit.morphologies.size() &&
        circuit.morphologies[planted.size()] == stock.candidates[i].name)
      planted.push_back(stock.neurons[i]);
  return planted;
}

Planted plant_from_repository(const circuit::Recipe& recipe, const std::string& repo, std::uint64_t seed,
                              Progress& progress) {
  const auto seedlings = seedlings_of(recipe, seed);
  std::vector<bool> wanted(recipe.types.size());
  for (const auto& layer : circuit::counts(recipe))
    for (std::size_t type = 0; type < wanted.size(); ++type)
      if (layer[type]) wanted[type] = true;
  Stock stock = stock_of(recipe, wanted, repo, progress);

  // A candidate for all seedlings of a type; its population is one that no repository has.
  circuit::Recipe planted_by = recipe;
  for (std::size_t type = 0; type < seedlings.size(); ++type)
    if (seedlings[type] && !seedlings[type]->radii.empty()) {
      planted_by.types[type].population = "\n" + recipe.types[type].name;
      stock.neurons.emplace_back();
      stock.candidates.push_back({planted_by.types[type].population, planted_by.types[type].population,
                                  std::ranges::max(seedlings[type]->radii), 0.f});
    }
  Planted planted{circuit::plant(planted_by, stock.candidates, seed, progress),
                  {},
                  circuit::too_tall(planted_by, stock.candidates),
                  std::move(stock.unflattened)};
  planted.circuit.types = recipe.types;
  planted.morphologies = planted_of(stock, planted.circuit);
  if (std::ranges::any_of(seedlings, [](const auto& s) { return s.has_value(); }))
    grow_in_place(planted, recipe, seedlings, seed, progress);
  mark_glia(planted);
  return planted;
}

}  // namespace forest::cli
