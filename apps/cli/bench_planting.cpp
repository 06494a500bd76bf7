// SPDX-License-Identifier: Apache-2.0
// brainforest bench planting: somata into one curved element of 1 mm³. How many seconds until all of them have a place without
// overlap and an orientation?
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/circuit/plant_elements.h"
#include "forest/cortex/curved_elements.h"

#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::vector<std::size_t> neurons{250'000, 1'000'000};
  double radius = 4.5;
  std::uint64_t seed = 1;
};

void run(const Options& options, Console& console) {
  // The most curved element of the sheet, in three layers and made to be just 1 mm³.
  cortex::Hexahedron element = cortex::folded_sheet(8, 1)[5];
  const double grow = std::cbrt(1e9 / element.volume());
  for (auto& p : element.points) p *= grow;
  const std::vector<circuit::Candidate> candidates{{"cell", "cell", float(options.radius), 0.f}};
  auto all = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  for (const std::size_t neurons : options.neurons) {
    circuit::Recipe recipe;
    recipe.radius = 100.f, recipe.types = {{"cell", "cell"}};
    for (const char* name : {"L1", "L2", "L3"})
      recipe.layers.push_back({name, 1.f, double(neurons), {}, {1.}});
    const auto start = Clock::now();
    const circuit::ElementPlanter planter(recipe, candidates, options.seed);
    const double packing = seconds_since(start);
    const auto rooted = planter.plant(element, 0);
    const double seconds = seconds_since(start);
    const double filled =
        double(rooted.size()) * 4. / 3. * std::numbers::pi * std::pow(options.radius, 3.) / element.volume();
    all.push_back({{"neurons", rooted.size()},
                   {"radius", options.radius},
                   {"filled", filled},
                   {"packing_seconds", packing},
                   {"seconds", seconds},
                   {"peak_bytes", peak_bytes()}});
    lines.push_back({fmt::format("{}", rooted.size()), fmt::format("{:.2g}", options.radius),
                     fmt::format("{:.1f}", 100. * filled), fmt::format("{:.2f}", packing),
                     fmt::format("{:.2f}", seconds)});
  }
  console.print(all);
  console.table({"somata in 1 mm³", "radius, µm", "filled, %", "packing, s", "in all, s"}, lines);
}

}  // namespace

std::function<void()> bench_planting(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("--neurons", options->neurons, "How many, one run each")->capture_default_str();
  must_be_within(
      *command.add_option("--radius", options->radius, "Of their somata, µm")->capture_default_str(), .1,
      20.);
  command.add_option("--seed", options->seed, "Seed of their places")->capture_default_str();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
