// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/bench.h"

#include <array>
#include <memory>

#include <CLI/App.hpp>

#include "apps/cli/console.h"
#include "apps/cli/options.h"

namespace forest::cli {

// One declaration and one row a benchmark.
std::function<void()> bench_activity(CLI::App&, Console&);
std::function<void()> bench_column(CLI::App&, Console&);
std::function<void()> bench_gaze(CLI::App&, Console&);
std::function<void()> bench_grid(CLI::App&, Console&);
std::function<void()> bench_grow(CLI::App&, Console&);
std::function<void()> bench_io(CLI::App&, Console&);
std::function<void()> bench_measure(CLI::App&, Console&);
std::function<void()> bench_pack(CLI::App&, Console&);
std::function<void()> bench_peers(CLI::App&, Console&);
std::function<void()> bench_pick(CLI::App&, Console&);
std::function<void()> bench_planting(CLI::App&, Console&);
std::function<void()> bench_repository(CLI::App&, Console&);
std::function<void()> bench_seam(CLI::App&, Console&);
std::function<void()> bench_sections(CLI::App&, Console&);
std::function<void()> bench_targets(CLI::App&, Console&);

std::span<const Benchmark> benchmarks() {
  static constexpr auto table = std::to_array<Benchmark>({
      {"activity", "How fast a simulation's values are packed, sought and clamped", bench_activity},
      {"column", "How fast the column is drawn with a moving camera, and in how much memory", bench_column},
      {"gaze", "How much less is drawn for an eye that looks at one place, and how fast", bench_gaze},
      {"grid", "How many curved elements are certified in a second, and places found in them", bench_grid},
      {"grow", "How many neurons a second grow from the built-in grammars, on all cores", bench_grow},
      {"io", "How many megabytes of neuron files are read in a second, on one core", bench_io},
      {"measure", "How many neurons a second have all their metrics measured, on one core", bench_measure},
      {"pack", "How many segments a second are packed into a forest file, and in how much memory",
       bench_pack},
      {"peers", "How fast, small and true the column is drawn beside VTK's lines, tube impostors and tubes",
       bench_peers},
      {"pick", "How many picks a second, and whether each is what a plain loop over all segments finds",
       bench_pick},
      {"planting", "How many seconds a million somata take to find places in a curved element of 1 mm³",
       bench_planting},
      {"repository", "How many neurons are stored in a repository in a second, and read back",
       bench_repository},
      {"seam", "How much quick pictures of a dolly differ from those of a slow and exact renderer",
       bench_seam},
      {"sections", "How near a hemisphere comes back from its sections, and by how few curves they are drawn",
       bench_sections},
      {"targets", "How long it takes to show thousands of neurons otherwise", bench_targets},
  });
  return table;
}

std::function<void()> bench(CLI::App& command, Console& console) {
  command.require_subcommand(1);
  const auto chosen = std::make_shared<std::function<void()>>();
  for (const Benchmark& benchmark : benchmarks()) {
    CLI::App* sub = command.add_subcommand(benchmark.name, benchmark.summary);
    add_common(*sub, console);
    sub->callback([chosen, job = benchmark.setup(*sub, console)] { *chosen = job; });
  }
  return [chosen] { (*chosen)(); };
}

}  // namespace forest::cli
