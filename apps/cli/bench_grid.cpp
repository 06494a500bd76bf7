// SPDX-License-Identifier: Apache-2.0
// brainforest bench grid: elements of a made-up folded sheet of cortex. How many are certified in a second, how many places
// find their (element, u, v, w), and how near to it does one come back?
#include <algorithm>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/curved_elements.h"
#include "forest/cortex/hexahedron.h"
#include "forest/cortex/locate.h"

#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"

namespace forest::cli {
namespace {

struct Options {
  std::size_t elements = 160000, places = 1000000;
  std::uint64_t seed = 1;
};

void run(const Options& options, Console& console) {
  const std::size_t along = 100, across = std::max<std::size_t>(1, options.elements / along);
  const std::vector<cortex::Hexahedron> elements = cortex::folded_sheet(across, along);

  auto start = Clock::now();
  std::vector<cortex::Certificate> certificates(elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t n) { certificates[n] = cortex::certify(elements[n]); });
  const double certifying = seconds_since(start);
  for (std::size_t n = 0; n < elements.size(); ++n)
    if (!certificates[n].positive()) throw Error(fmt::format("element {} of the sheet is not valid", n));

  start = Clock::now();
  const cortex::Locator locator(elements);
  const double building = seconds_since(start);
  std::vector<Eigen::Vector3d> places(options.places);
  parallel_for(places.size(), 1024, [&](std::size_t n) {
    Random random(options.seed, n);
    const cortex::Hexahedron& h = elements[random.below(std::uint32_t(elements.size()))];
    const double u = random.uniform(), v = random.uniform();
    places[n] = h.at(u, v, random.uniform());
  });
  start = Clock::now();
  const std::vector<cortex::Location> found = locator.find(places);
  const double finding = seconds_since(start);
  std::size_t missed = 0;
  double worst = 0.;
  for (std::size_t n = 0; n < places.size(); ++n)
    if (found[n].found())
      worst = std::max(worst, (elements[found[n].element].at(found[n].uvw) - places[n]).norm());
    else
      ++missed;
  console.print({{"elements", elements.size()},
                 {"certified_per_second", double(elements.size()) / certifying},
                 {"index_seconds", building},
                 {"places", places.size()},
                 {"found", places.size() - missed},
                 {"round_trip_micrometres", worst},
                 {"found_per_second", double(places.size()) / finding},
                 {"peak_bytes", peak_bytes()}});
  console.table(
      {"elements", "certified/s", "index, s", "places", "found", "round trip, µm", "found/s"},
      {{fmt::format("{}", elements.size()), fmt::format("{:.0f}", double(elements.size()) / certifying),
        fmt::format("{:.2f}", building), fmt::format("{}", places.size()),
        fmt::format("{}", places.size() - missed), fmt::format("{:.1e}", worst),
        fmt::format("{:.0f}", double(places.size()) / finding)}});
}

}  // namespace

std::function<void()> bench_grid(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("--elements", options->elements, "Elements of the sheet, about")
      ->check(CLI::Range(100, 10'000'000))
      ->capture_default_str();
  command.add_option("--places", options->places, "Random places in them")
      ->check(CLI::Range(1, 1'000'000'000))
      ->capture_default_str();
  command.add_option("--seed", options->seed, "Seed of the places")->capture_default_str();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
