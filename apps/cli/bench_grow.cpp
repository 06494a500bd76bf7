// SPDX-License-Identifier: Apache-2.0
// brainforest bench grow: how fast neurons grow, from grammar to Morphology in memory, on all cores.
#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/measure.h"

#include "apps/cli/console.h"
#include "apps/cli/grammars.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

constexpr std::size_t batch = 200;

struct Result {
  std::string name;
  std::size_t neurons = 0, segments = 0;
  double seconds = 0.;  // of growing alone
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
  using Clock = std::chrono::steady_clock;
  Result result{.name = grammar.name};
  lsystem::grow_population(grammar, batch / 4, 0);  // the machine warms up
  while (result.seconds < seconds) {
    const auto begin = Clock::now();
    const auto neurons = lsystem::grow_population(grammar, batch, 1, progress, result.neurons);
    result.seconds += std::chrono::duration<double>(Clock::now() - begin).count();
    check(neurons, grammar);
    result.neurons += neurons.size();
    for (const Morphology& m : neurons) result.segments += m.segment_count();
  }
  return result;
}

}  // namespace

std::function<void()> bench_grow(CLI::App& command, Console& console) {
  struct Options {
    std::vector<std::string> grammars;
    double seconds = 2.;
  };
  const auto options = std::make_shared<Options>();
  command.add_option("--grammar", options->grammars, "Names or files; by default all that are built in");
  command.add_option("--seconds", options->seconds, "To grow by each grammar")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.footer("Example:\n  brainforest bench grow --grammar pyramidal --json");
  return [options, &console] {
    std::vector<Result> results;
    for (const std::string& name : options->grammars.empty() ? built_in_grammars() : options->grammars)
      results.push_back(measure(find_grammar(name), options->seconds, console.progress()));

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
                         {"segments_per_second", double(r.segments) / r.seconds}};
      rows.push_back({r.name, fmt::format("{}", r.neurons),
                      fmt::format("{:.0f}", double(r.segments) / neurons),
                      fmt::format("{:.0f}", neurons / r.seconds),
                      fmt::format("{:.0f}", double(r.segments) / r.seconds)});
    }
    console.table({"grammar", "neurons", "segments each", "neurons/s", "segments/s"}, rows);
    console.print({{"neurons_per_second", double(results.size()) / seconds_each},
                   {"segments_per_second", segments / seconds_each},
                   {"growing", details}});
  };
}

}  // namespace forest::cli
