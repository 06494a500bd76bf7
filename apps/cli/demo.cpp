// SPDX-License-Identifier: Apache-2.0
// brainforest demo: the main job, from nothing to a walk in the forest.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/circuit/plant.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/cortex/environment.h"
#include "forest/io/format.h"
#include "forest/io/png.h"
#include "forest/io/sonata.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"
#include "forest/repository/repository.h"

#include "apps/cli/artist.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/options.h"
#include "apps/cli/planting.h"
#include "apps/cli/studio.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
struct Options {
  fs::path out, traced;
  std::uint64_t seed = 1;
  bool view = false;
};

constexpr std::uint32_t neurons = 100;   // grown
constexpr double traced_fraction = .25;  // of every layer

struct Figures {
  std::size_t grown = 0, traced = 0, unread = 0;
  double growing = 0.;
  float lowest_traced = INFINITY;  // height of the lowest traced cell above its soma, µm
};

/// Grows a stock for the types that a recipe would grow where they stand, of each some at three depths of each of its layers, and
/// lets the recipe plant from it.
void grow_into(const std::string& repo, circuit::Recipe& recipe, const Options& options, Console& console,
               Figures& figures) {
  constexpr float depths[] = {.05f, .35f, .65f};  // of a layer; planted ones stand as deep or deeper
  struct Batch {
    std::size_t type, layer;
    float depth;
  };
  std::vector<Batch> batches;
  std::vector<double> weights;
  const auto wanted = circuit::counts(recipe);
  for (std::size_t type = 0; type < recipe.types.size(); ++type)
    for (std::size_t layer = 0; layer < wanted.size(); ++layer)
      for (const float depth : depths)
        if (wanted[layer][type])
          batches.push_back({type, layer, depth}), weights.push_back(std::sqrt(double(wanted[layer][type])));
  const auto counts = circuit::apportion(neurons, weights);

  const std::vector<cortex::Slab> layers = circuit::slabs(recipe);
  const cortex::Environment tissue(layers);
  std::map<std::string, std::uint64_t> grown;  // by each grammar
  auto repository = repository::Repository::open(repo, repository::Access::write);
  auto transaction = repository.begin();
  for (std::size_t b = 0; b < batches.size(); ++b) {
    const circuit::CellType& type = recipe.types[batches[b].type];
    const cortex::Slab& layer = layers[batches[b].layer];
    const lsystem::Grammar grammar = find_grammar(circuit::source_of(recipe, batches[b].type).grammar);
    const std::uint64_t first = grown[grammar.name];
    const cortex::Site site{&tissue, {0.f, std::lerp(layer.top, layer.bottom, batches[b].depth), 0.f}};
    const auto start = Clock::now();
    const auto cells =
        lsystem::grow_population(grammar, counts[b], options.seed, console.progress(), first, site);
    figures.growing += seconds_since(start);
    const std::string hash = repository.add_grammar(grammar.name, grammar.text, distributions_of(grammar));
    for (std::size_t i = 0; i < cells.size(); ++i)
      repository.add(cells[i],
                     {.name = fmt::format("{}-{}-{:05}", grammar.name, options.seed, first + i),
                      .population = type.name,
                      .layer = layer.name,
                      .type = grammar.title,
                      .provenance = repository::Grown{grammar.name, hash, options.seed, first + i}});
    grown[grammar.name] += cells.size(), figures.grown += cells.size();
  }
  transaction.commit();
  for (std::size_t type = 0; type < recipe.types.size(); ++type)
    recipe.types[type].population = recipe.types[type].name, recipe.sources[type].grammar.clear();
}

void import_into(const std::string& repo, const fs::path& folder, Console& console, Figures& figures) {
  struct File {
    Morphology morphology;
    std::string hash, error;
  };
  const std::vector<fs::path> paths = neuron_files({folder.string()}, console);
  std::vector<File> files(paths.size());
  console.progress().begin("reading", paths.size());
  parallel_for(paths.size(), 1, [&](std::size_t i) {
    try {
      const MappedFile bytes(paths[i]);
      files[i].hash = hash_hex(bytes.bytes());
      files[i].morphology =
          io::format_of(paths[i], bytes.text()).read(bytes.text(), paths[i].string()).morphology;
      if (files[i].morphology.sections().empty())
        files[i].error = paths[i].string() + ": has no neurite and is not planted";
    } catch (const Error& error) {
      files[i].error = error.what();
    }
    console.progress().advance();
  });
  auto repository = repository::Repository::open(repo, repository::Access::write);
  auto transaction = repository.begin();
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (!files[i].error.empty()) {
      console.warn(files[i].error);
      ++figures.unread;
      continue;
    }
    repository.add(files[i].morphology, {.name = paths[i].stem().string(),
                                         .population = "traced",
                                         .provenance = repository::Traced{paths[i].string(), files[i].hash},
                                         .number_if_taken = true});
    const Morphology& cell = files[i].morphology;
    figures.lowest_traced = std::min(figures.lowest_traced, cell.bounds().high.y() - centre(cell).y());
    ++figures.traced;
  }
  if (!figures.traced)
    throw Error(fmt::format("{}: no neuron could be read; the sentences above say why", folder.string()));
  transaction.commit();
}

void run(const Options& options, Console& console) {
  const auto begin = Clock::now();
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error)
    throw Error(fmt::format("{}: the folder cannot be made ({}); choose another --out", options.out.string(),
                            error.message()));
  const std::string repo = (options.out / "neurons.db").string();
  const fs::path circuit_folder = options.out / "circuit", forest_file = options.out / "forest.forest",
                 picture = options.out / "forest.png", walk = options.out / "walk.mp4";

  // Everything is made anew, so that the same command gives the same files; but only what a demo made is replaced.
  constexpr std::string_view told =
      "Made by 'brainforest demo', which replaces all of it when it is run again:\n"
      "neurons.db       neurons grown, and traced ones given to it, in a repository\n"
      "circuit/         a column of them, a SONATA circuit\n"
      "forest.forest    the column, packed for drawing\n"
      "forest.png       a picture of it\n"
      "walk.mp4         a film of a walk into it\n";
  const fs::path about = options.out / "about.txt";
  if (!fs::exists(about, error) || MappedFile(about).text() != told)
    for (const fs::path& file : {about, fs::path(repo), circuit_folder, forest_file, picture, walk})
      if (fs::exists(file, error))
        throw Error(fmt::format(
            "{} is there and no demo made it, so nothing was written; choose another --out", file.string()));
  write_file(about, told);
  for (const char* end : {"", "-wal", "-shm", "-journal"}) fs::remove(repo + end, error);
  Figures figures;
  circuit::Recipe recipe = find_recipe("cortex-1000");
  grow_into(repo, recipe, options, console, figures);
  if (!options.traced.empty()) import_into(repo, options.traced, console, figures);
  console.say(
      fmt::format("grown    {} neurons of {} types, stored in {}", figures.grown, recipe.types.size(), repo));

  if (figures.traced)
    recipe = circuit::with_type(recipe, {"traced cell", "traced", true}, traced_fraction,
                                figures.lowest_traced - circuit::pia_slack);
  const Planted planted = plant_from_repository(recipe, repo, options.seed, console.progress());
  io::write_sonata(circuit_folder, planted.circuit, planted.morphologies, console.progress());
  console.say(
      fmt::format("planted  {} neurons in {}", planted.circuit.instances.size(), circuit_folder.string()));

  write_file(forest_file, scene::pack(planted.circuit, planted.morphologies, console.progress()));
  const scene::Forest forest = scene::Forest::open(forest_file);
  console.say(fmt::format("packed   {} segments in {}", forest.segment_total(), forest_file.string()));

  Artist artist(forest);
  console.progress().begin("drawing", 0);
  const Drawn drawn = artist.draw(scene::portrait(forest), 1920, 1080);
  io::write_png(picture, 1920, 1080, drawn.image.pixels);
  const double first_picture = seconds_since(begin);
  if (drawn.image.covered <= 0.)
    throw Error(picture.string() + " shows nothing; the OpenGL driver may be at fault: " + artist.renderer());
  console.say(fmt::format("drawn    {}", picture.string()));

  const FilmFigures filmed = film(artist, scene::walk(forest), {}, walk, console.progress());
  console.say(fmt::format("filmed   {}\n", walk.string()));

  const double grown_per_second = double(figures.grown) / figures.growing;
  const double pictures_per_second = filmed.pictures / filmed.seconds;
  console.print(
      {{"neurons_per_second", grown_per_second},
       {"neurons", figures.grown},
       {"traced", figures.traced},
       {"planted", forest.instances().size()},
       {"segments", forest.segment_total()},
       {"bytes", forest.bytes()},
       {"first_picture_seconds", first_picture},
       {"frames_per_second", pictures_per_second},
       {"covered", {{"picture", drawn.image.covered}, {"film", filmed.covered}}},
       {"seconds", seconds_since(begin)},
       {"files", {repo, circuit_folder.string(), forest_file.string(), picture.string(), walk.string()}}});
  console.table({"", ""},
                {{"neurons grown a second", fmt::format("{:.0f}", grown_per_second)},
                 {"neurons grown / traced / planted",
                  fmt::format("{} / {} / {}", figures.grown, figures.traced, forest.instances().size())},
                 {"segments planted", fmt::format("{}", forest.segment_total())},
                 {"bytes of the forest file", fmt::format("{}", forest.bytes())},
                 {"first picture after", fmt::format("{:.1f} s", first_picture)},
                 {"film, pictures a second", fmt::format("{:.1f}", pictures_per_second)},
                 {"pixels covered, picture / film",
                  fmt::format("{:.0f} % / {:.0f} %", 100. * drawn.image.covered, 100. * filmed.covered)},
                 {"all together", fmt::format("{:.1f} s", seconds_since(begin))},
                 {"drawn by", artist.renderer()}});
  if (!options.view) return;
  if (has_display())
    open_studio(forest_file);
  else
    console.say(
        fmt::format("\nno display here; on one, open it with 'brainforest view {}'", forest_file.string()));
}

}  // namespace

std::function<void()> demo(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("--out", options->out, "Folder for everything that is made")->required();
  command
      .add_option("--traced", options->traced, "Plant the traced cells of this folder among the grown ones")
      ->check(CLI::ExistingDirectory);
  add_seed(command, options->seed, "The same seed gives the same forest");
  command.add_flag("--view", options->view, "Open the studio on it at the end, where there is a display");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
