// SPDX-License-Identifier: Apache-2.0
// brainforest bench targets: how long does it take to show thousands of neurons otherwise?
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/frame/similarity.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::uint32_t neurons = 10000, repeats = 20;
  std::uint64_t seed = 1;
  std::string size = "1280x720";
  Drawer drawer = Drawer::automatic;
};

struct Change {
  const char* name;
  const char* targets;  // of a view, JSON
};
constexpr Change changes[] = {
    {"somata alone", R"([{"name":"all","kind":"somata"}])"},
    {"one side invisible", R"([{"name":"one side","visible":false}])"},
    {"one colour", R"([{"name":"all","colour":"#ff8800"}])"},
    {"coloured by depth", R"([{"name":"all","colour":"depth"}])"},
    {"coloured by kind of branch", R"([{"name":"all","colour":"kind"}])"},
    {"drawn as lines", R"([{"name":"all","kind":"lines"}])"},
    {"drawn as dots", R"([{"name":"all","kind":"dots"}])"},
    {"half transparent", R"([{"name":"all","opacity":0.5}])"},
    {"axons and basal dendrites transparent", R"([{"name":"all","opacity":{"axon":0.1,"basal":0.3}}])"},
    {"inhibitory alone, in their own colour",
     R"([{"name":"all","visible":false},{"name":"inhibitory","visible":true,"colour":"#56b4e9"}])"},
};

void run(const Options& options, Console& console) {
  const auto [width, height] = parse_size(options.size);
  const scene::Forest forest = grown_column(options.neurons, options.seed, console);
  circuit::NodeSets sets;
  sets.put({.name = "one side", .clauses = {{"x", circuit::Clause::Test::less, {}, {0.}}}, .of = {}});
  Artist artist(forest, options.drawer, sets);
  scene::View view = scene::walk(forest).at(1.f);  // inside, where every kind differs from the others
  view.samples = 1;
  const frame::Image before = artist.draw(view, width, height).image;

  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> table;
  double worst = 0.;
  console.progress().begin("changing", std::size(changes));
  for (const Change& change : changes) {
    scene::View other = view;
    other.targets =
        scene::parse_view(fmt::format(R"({{"eye":[0,0,1],"target":[0,0,0],"targets":{}}})", change.targets))
            .targets;
    // The first time the names are looked up; a person who turns a knob asks for the same ones again.
    auto start = Clock::now();
    const scene::Targets targets(forest, sets);
    scene::colour(targets, other);
    const double first = milliseconds_since(start);
    start = Clock::now();
    for (std::uint32_t i = 0; i < options.repeats; ++i)
      if (scene::colour(targets, other).states.size() != forest.instances().size())
        throw Error("the neurons were not all given a state: nothing was measured");
    const double again = milliseconds_since(start) / options.repeats;
    const Drawn drawn = artist.draw(other, width, height);
    const double changed = frame::change(before, drawn.image);
    if (!(changed > .05))
      throw Error(fmt::format("'{}' changed nothing in the picture: nothing was measured", change.name));
    worst = std::max({worst, first, again});
    rows.push_back({{"change", change.name},
                    {"milliseconds", again},
                    {"milliseconds_first", first},
                    {"picture_changed", changed},
                    {"draw_milliseconds", drawn.cull + drawn.draw + drawn.resolve}});
    table.push_back({change.name, fmt::format("{:.2f}", first), fmt::format("{:.2f}", again),
                     fmt::format("{:.1f}", changed),
                     fmt::format("{:.1f}", drawn.cull + drawn.draw + drawn.resolve)});
    console.progress().advance();
  }
  console.progress().end();
  console.print({{"neurons", forest.instances().size()},
                 {"worst_milliseconds", worst},
                 {"changes", rows},
                 {"size", options.size},
                 {"renderer", artist.renderer()}});
  console.say(fmt::format("{} neurons, {}, {}", forest.instances().size(), options.size, artist.renderer()));
  console.table({"change of all neurons", "first ms", "again ms", "picture changed", "next picture ms"},
                table);
}

}  // namespace

std::function<void()> bench_targets(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--repeats", options->repeats, "Times each change is made", 1, 100'000);
  add_size(command, options->size);
  add_renderer(command, options->drawer);
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
