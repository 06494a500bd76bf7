// SPDX-License-Identifier: Apache-2.0
// brainforest bench grow: how fast neurons grow, from grammar to Morphology in memory and into a file of cells, on all cores.
// What is in the file is compared with what is grown again.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <unistd.h>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/measure.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grammars.h"
#include "apps/cli/grow_cells.h"
#include "apps/cli/options.h"
#include "apps/cli/ranks.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

constexpr std::size_t batch = 200;

struct Result {
  std::string name;
  std::size_t neurons = 0, segments = 0;
  double seconds = 0.;  // of growing alone

  std::size_t written = 0;      // neurons grown into a file
  double writing_seconds = 0.;  // of growing them and writing, until it has its name
  std::uint64_t bytes = 0;      // of the file
};

/// Every neuron must be one: a soma and drawn dendrites of some length, unlike the one before.
void check(const std::vector<Morphology>& neurons, const lsystem::Grammar& grammar) {
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const Morphology& m = neurons[i];
    if (m.soma().kind == SomaKind::none || m.segment_count() == 0 || !(total_length(m) > 0.) ||
        (i > 0 && m == neurons[i - 1]))
      throw Error(
          fmt::format("{}: neuron {} was not really grown; this is an error of the program or the grammar",
                      grammar.file, i));
  }
}

Result measure(const lsystem::Grammar& grammar, double seconds, Progress& progress) {
  Result result{.name = grammar.name};
  lsystem::grow_population(grammar, batch / 4, 0);  // the machine warms up
  while (result.seconds < seconds) {
    const auto begin = Clock::now();
    const auto neurons = lsystem::grow_population(grammar, batch, 1, progress, result.neurons);
    result.seconds += seconds_since(begin);
    check(neurons, grammar);
    result.neurons += neurons.size();
    for (const Morphology& m : neurons) result.segments += m.segment_count();
  }
  return result;
}

/// Neurons of the file must be those that are grown alone.
void check_file(const std::filesystem::path& path, const lsystem::Grammar& grammar, const Result& result) {
  const MappedFile mapped(path);
  const io::CellsFile file(mapped.text(), path.string());
  bool good = file.size() == result.written;
  constexpr std::size_t sample = 100;
  for (std::size_t i = 0; good && i < sample; ++i) {
    const std::size_t number = i * (file.size() - 1) / (sample - 1);
    const io::Cell cell = file.read(number);
    good = cell.name == grown_name(grammar, 1, number) &&
           cell.read.morphology == lsystem::grow(grammar, 1, number);
  }
  if (!good) throw Error(fmt::format("{}: the file of cells does not hold what was grown", grammar.file));
}

void measure_file(const lsystem::Grammar& grammar, double seconds, const std::filesystem::path& folder,
                  Result& result, Console& console) {
  const auto path = folder / fmt::format("brainforest-grow-{}.cells", ::getpid());
  result.written = std::max(batch, std::size_t(seconds * double(result.neurons) / result.seconds));
  const auto begin = Clock::now();
  const CellsGrown grown =
      grow_cells([&] { return grammar; }, {path, result.written, 1, false}, *join_ranks(), console);
  result.writing_seconds = seconds_since(begin);
  result.bytes = grown.bytes;
  check_file(path, grammar, result);
  std::filesystem::remove(path);
}

}  // namespace

std::function<void()> bench_grow(CLI::App& command, Console& console) {
  struct Options {
    std::vector<std::string> grammars;
    double seconds = 2.;
    std::filesystem::path folder = std::filesystem::temp_directory_path();
  };
  const auto options = std::make_shared<Options>();
  command.add_option("--grammar", options->grammars, "Names or files; by default all that are built in");
  must_be_within(
      *command.add_option("--seconds", options->seconds, "To grow by each grammar")->capture_default_str(),
      1e-3, 3600.);
  command.add_option("--folder", options->folder, "For the file of cells, which is removed again")
      ->capture_default_str();
  return [options, &console] {
    std::vector<Result> results;
    for (const std::string& name : options->grammars.empty() ? built_in_grammars() : options->grammars) {
      const lsystem::Grammar grammar = find_grammar(name);
      results.push_back(measure(grammar, options->seconds, console.progress()));
      measure_file(grammar, options->seconds, options->folder, results.back(), console);
    }

    nlohmann::ordered_json details = nlohmann::ordered_json::object();
    std::vector<std::vector<std::string>> rows;
    double seconds_each = 0., segments = 0.;  // seconds_each: of one neuron of every grammar
    for (const Result& r : results) {
      const double neurons = double(r.neurons);
      seconds_each += r.seconds / neurons;
      segments += double(r.segments) / neurons;
      details[r.name] = {{"neurons", r.neurons},
                         {"segments_each", double(r.segments) / neurons},
                         {"neurons_per_second", neurons / r.seconds},
                         {"segments_per_second", double(r.segments) / r.seconds},
                         {"neurons_per_second_into_a_file", double(r.written) / r.writing_seconds},
                         {"bytes_each_in_the_file", double(r.bytes) / double(r.written)}};
      rows.push_back(
          {r.name, fmt::format("{}", r.neurons), fmt::format("{:.0f}", double(r.segments) / neurons),
           fmt::format("{:.0f}", neurons / r.seconds), fmt::format("{:.0f}", double(r.segments) / r.seconds),
           fmt::format("{:.0f}", double(r.written) / r.writing_seconds),
           fmt::format("{:.0f}", double(r.bytes) / double(r.written))});
    }
    console.table({"grammar", "neurons", "segments each", "neurons/s", "segments/s", "neurons/s into a file",
                   "bytes each there"},
                  rows);
    console.print({{"neurons_per_second", double(results.size()) / seconds_each},
                   {"segments_per_second", segments / seconds_each},
                   {"growing", details}});
  };
}

}  // namespace forest::cli
