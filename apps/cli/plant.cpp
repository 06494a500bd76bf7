// SPDX-License-Identifier: Apache-2.0
// brainforest plant: neurons of a repository into a column, or into curved elements of a cortex, as a SONATA circuit.
#include <cmath>
#include <filesystem>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/io/sonata.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/planting.h"
#include "apps/cli/planting_elements.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::string recipe, repo;
  std::filesystem::path out;
  std::uint64_t seed = 0;
  std::uint32_t synapses = 0;
  std::string slice;
  ElementOptions elements;
};

nlohmann::ordered_json json_of(const circuit::Spread& s) {
  return {{"min", s.least}, {"p1", s.p1}, {"median", s.median}, {"p99", s.p99}, {"max", s.most}};
}

nlohmann::ordered_json json_of(const PlantedElements& all) {
  nlohmann::ordered_json elements = nlohmann::ordered_json::array();
  for (std::size_t e = 0; e < all.elements.size(); ++e)
    elements.push_back({{"element", all.elements[e]},
                        {"first", all.first[e]},
                        {"neurons", all.first[e + 1] - all.first[e]}});
  nlohmann::ordered_json json{{"elements", elements},
                              {"volume", all.volume * 1e-9},
                              {"layers", all.measured ? "measured" : "by volume"},
                              {"seconds", all.seconds},
                              {"bending", nullptr}};
  if (all.bending) {
    const circuit::Bending& b = *all.bending;
    json["bending"] = {{"length", b.length},
                       {"length_ratio", b.length_ratio},
                       {"neuron_length_ratio", json_of(b.ratio)},
                       {"mean_turn", json_of(b.turn)},
                       {"beyond_pia", b.beyond_pia},
                       {"shortened", b.shortened},
                       {"pressed_to_pia", b.pressed},
                       {"beyond_white", b.beyond_white},
                       {"beside", b.beside}};
  }
  return json;
}

std::string sentence_of(const circuit::Bending& b) {
  const auto change = [](double ratio) { return fmt::format("{:+.1f}", 100. * (ratio - 1.)); };
  const double longer = 100. * (b.length_ratio - 1.);
  return fmt::format(
      "bent; {} were taller than the tissue above them and made shorter; {:.3g} m of branches became {:.1f} "
      "% {}, "
      "single neurons {} to {} % (98 of 100: {} to {} %), and the angles between segments changed by {:.2g}° "
      "in the median; "
      "{:.2g} % of the length lies beyond the pia, {:.2g} % would have and lies on it, {:.2g} % lies in the "
      "white matter, "
      "{:.2g} % left the elements at their rim",
      counted(b.shortened, "neuron"), b.length * 1e-6, std::abs(longer), longer < 0. ? "shorter" : "longer",
      change(b.ratio.least), change(b.ratio.most), change(b.ratio.p1), change(b.ratio.p99), b.turn.median,
      100. * b.beyond_pia, 100. * b.pressed, 100. * b.beyond_white, 100. * b.beside);
}

/// What the command line says of slices, for all types of which the recipe says nothing.
void correct_slices(circuit::Recipe& recipe, const std::string& words) {
  recipe.sources.resize(recipe.types.size());
  const circuit::SliceCorrection given = circuit::parse_slice_correction(words);
  for (circuit::Recipe::Source& source : recipe.sources)
    if (!source.slice) source.slice = given;
}

std::string sentence_of(const Unflattened& u) {
  return fmt::format("neurons of {} are stretched {:.2f} times along z{}", u.name, u.factor,
                     !u.error               ? ""
                     : std::isnan(*u.error) ? ", as their dendrites say"
                                            : fmt::format(", as their dendrites say (± {:.2f})", *u.error));
}

void run(const Options& options, Console& console) {
  must_have_folder(options.out);
  io::must_take_sonata(options.out);
  const bool curved = !options.elements.file.empty();
  circuit::Recipe recipe = find_recipe(options.recipe, curved ? Tissue::elements : Tissue::column);
  if (!options.slice.empty()) correct_slices(recipe, options.slice);
  PlantedElements all;
  if (curved)
    all = plant_in_elements(options.elements, recipe, options.repo, options.seed, console.progress());
  else
    all.planted = plant_from_repository(recipe, options.repo, options.seed, console.progress());
  for (const std::string& sentence : all.left_out) console.warn(sentence);
  const Planted& planted = all.planted;
  const circuit::Circuit& circuit = planted.circuit;
  for (const circuit::TooTall& t : planted.too_tall)
    if (2 * t.count > t.of)
      console.warn(
          fmt::format("{} of the {} neurons of type {} are taller than the tissue in which it is planted; {} "
                      "there: give layers the thickness of the tissue that the neurons come from",
                      t.count, t.of, circuit.types[t.type].name,
                      t.count < t.of ? "only the others stand" : "the lowest stands for all"));
  std::vector<circuit::Projection> projections;
  if (options.synapses)
    projections.push_back(circuit::made_up_synapses(circuit, planted.morphologies,
                                                    io::sonata_population(circuit), options.synapses,
                                                    options.seed, console.progress()));
  io::write_sonata(options.out, circuit, planted.morphologies, console.progress(), projections);
  const std::size_t synapses = projections.empty() ? 0 : projections.front().synapses.size();

  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  for (const circuit::Tally& row : circuit::tally(circuit)) {
    const std::string &layer = circuit.layers[row.layer].name, &type = circuit.types[row.type].name;
    const double density = curved ? double(row.count) / (all.layer_volumes[row.layer] * 1e-9) : row.density;
    list.push_back({{"layer", layer}, {"type", type}, {"count", row.count}, {"density", density}});
    lines.push_back({layer, type, std::to_string(row.count),
                     density < 10. ? fmt::format("{:.3g}", density) : fmt::format("{:.0f}", density)});
  }
  nlohmann::ordered_json json{{"circuit", options.out.string()},
                              {"name", circuit.name},
                              {"seed", options.seed},
                              {"radius", circuit.radius},
                              {"neurons", circuit.instances.size()},
                              {"morphologies", circuit.morphologies.size()},
                              {"made_up_synapses", synapses},
                              {"slice_correction", nlohmann::ordered_json::array()},
                              {"planted", list}};
  for (const Unflattened& u : planted.unflattened)
    json["slice_correction"].push_back(
        {{"name", u.name}, {"factor", u.factor}, {"measured", u.error.has_value()}});
  if (curved) json["tissue"] = json_of(all);
  if (circuit.instances.empty())
    console.warn("nothing is planted: the densities leave less than one neuron; raise them, or --scale");
  console.print(json);
  console.table({"layer", "type", "neurons", "neurons/mm³"}, lines);
  console.say(fmt::format("\n{} neurons of {} shapes are planted in {}", circuit.instances.size(),
                          circuit.morphologies.size(), options.out.string()));
  if (curved)
    console.say(fmt::format("{} of {:.3f} mm³, layers {}; places in {:.2f} s",
                            counted(all.elements.size(), "element"), all.volume * 1e-9,
                            all.measured ? "as measured" : "by volume", all.seconds));
  if (all.bending) console.say(sentence_of(*all.bending));
  for (const Unflattened& u : planted.unflattened) console.say(sentence_of(u));
  if (synapses)
    console.say(fmt::format("{} synapses are made up: nobody measured them, they are there to be looked at",
                            synapses));
}

}  // namespace

std::function<void()> plant(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command
      .add_option(
          "--recipe", options->recipe,
          "A recipe (TOML), or the name of one that ships: column-1000, column-10000, human-frontal, "
          "human-visual, rat-barrel-column, rodent-types, and in a column cortex-1000, too, which needs no "
          "--repo")
      ->required()
      ->type_name("FILE|NAME");
  command
      .add_option(
          "--repo", options->repo,
          "The repository the neurons come from; not needed where all types of the recipe have a grammar")
      ->type_name("REPO");
  command
      .add_option("--out", options->out,
                  "Folder of the SONATA circuit; a circuit of Brain Forest there is replaced")
      ->required()
      ->type_name("DIR");
  command
      .add_option("--slice-correction", options->slice,
                  "Neurons lie flat as in the slice in which they were traced: stretch them along z so many "
                  "times (1 to "
                  "5), or `measured`, until dendrites go as far along z as along x; types of which the "
                  "recipe says it keep "
                  "to that")
      ->type_name("FACTOR|measured");
  add_elements(command, options->elements);
  add_whole(command, "--synapses", options->synapses,
            "Make up so many synapses on each neuron, from others drawn by lot (docs/scene/synapses.md)", 0,
            100'000);
  add_seed(command, options->seed, "The same seed plants the same circuit");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
