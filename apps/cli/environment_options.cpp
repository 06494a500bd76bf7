// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/environment_options.h"

#include <array>
#include <charconv>
#include <filesystem>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/circuit/environment.h"
#include "forest/core/error.h"
#include "forest/io/sonata.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/cli/planting.h"

namespace forest::cli {
namespace {

constexpr double furthest = 1e6;  // µm

std::optional<Vec3> place_of(const std::string& text) {
  Vec3 place;
  const char *at = text.data(), *const end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [rest, error] = std::from_chars(at, end, place[axis]);
    const bool last = axis == 2;
    if (error != std::errc() || !(std::abs(place[axis]) <= float(furthest)) ||
        (last ? rest != end : rest == end || *rest != ','))
      return {};
    at = rest + !last;
  }
  return place;
}

cortex::Environment read(const std::string& file, Console& console) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (fs::is_directory(file, none) || fs::path(file).extension() == ".json") {
    const io::SonataCircuit circuit = io::read_sonata(file, console.progress());
    for (const auto& warning : circuit.warnings) console.warn(warning.sentence);
    std::vector<float> radii;
    for (const Morphology& m : circuit.morphologies) radii.push_back(m.soma().sphere().radius);
    return circuit::environment(circuit.circuit, radii);
  }
  if (fs::exists(file, none)) return circuit::read_environment(file);
  return cortex::Environment(circuit::slabs(find_recipe(file)));
}

}  // namespace

void add_environment(CLI::App& command, EnvironmentOptions& options) {
  CLI::Option* file = command
                          .add_option("--environment", options.file,
                                      "What grows asks what is around it: an environment "
                                      "(docs/lsystem/environment.md), a recipe, or the "
                                      "folder of a circuit")
                          ->type_name("FILE");
  CLI::Option* at =
      command
          .add_option("--at", options.at,
                      "Where it grows: the place of its soma in µm, as the environment counts them")
          ->type_name("X,Y,Z")
          ->needs(file)
          ->check([](const std::string& text) {
            return place_of(text) ? std::string() : text + " is no place; write three numbers, X,Y,Z";
          });
  CLI::Option* depth =
      command
          .add_option("--depth", options.depth, "… or so many µm below the pia, in the middle of the column")
          ->type_name("UM")
          ->needs(file)
          ->excludes(at);
  must_be_within(*depth, -furthest, furthest);
}

Surroundings::Surroundings(const EnvironmentOptions& options, Console& console) {
  if (options.file.empty()) return;
  environment_ = read(options.file, console);
  if (options.at.empty() && !options.depth)
    throw InputError(options.file, 0,
                     "where in it the neurons grow is not said; give --at X,Y,Z or --depth UM");
  site_.environment = &environment_;
  site_.name = repository::escaped(options.file);
  if (!options.at.empty()) {
    site_.at = *place_of(options.at);
  } else {
    const auto pia = environment_.pia();
    if (!pia)
      throw InputError(options.file, 0,
                       "there is no layer, hence no pia to count a depth from; say where with --at");
    site_.at.y() = float(*pia - *options.depth);
  }
  if (environment_.pia() && !environment_.stratum(site_.at.cast<double>()).layer)
    console.warn(fmt::format("the soma at {:g} {:g} {:g} µm lies in no layer of {}", site_.at.x(),
                             site_.at.y(), site_.at.z(), options.file));
}

}  // namespace forest::cli
