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
      {"activity", "How fast a simulation's values are packed, sought and clamped",
       "brainforest bench activity --neurons 1000 --json", bench_activity},
      {"column", "How fast the column is drawn with a moving camera, and in how much memory",
       "brainforest bench column --neurons 10000 --activity", bench_column},
      {"gaze", "How much less is drawn for an eye that looks at one place, and how fast",
       "brainforest bench gaze --neurons 10000 --size 1920x1080", bench_gaze},
      {"grid", "How many curved elements are certified in a second, and places found in them",
       "brainforest bench grid --elements 2000", bench_grid},
      {"grow", "How many neurons a second grow from the built-in grammars, on all cores",
       "brainforest bench grow --grammar pyramidal --json", bench_grow},
      {"io", "How many megabytes of neuron files are read in a second, on one core",
       "brainforest bench io --json traced/", bench_io},
      {"measure", "How many neurons a second have all their metrics measured, on one core",
       "brainforest bench measure traced/ --each", bench_measure},
      {"pack", "How many segments a second are packed into a forest file, and in how much memory",
       "brainforest bench pack --neurons 1000 --json", bench_pack},
      {"peers", "How fast, small and true the column is drawn beside VTK's lines, tube impostors and tubes",
       "brainforest bench peers --neurons 10000 --json", bench_peers},
      {"pick", "How many picks a second, and whether each is what a plain loop over all segments finds",
       "brainforest bench pick --neurons 1000", bench_pick},
      {"planting", "How many seconds a million somata take to find places in a curved element of 1 mm³",
       "brainforest bench planting --neurons 100000", bench_planting},
      {"repository", "How many neurons are stored in a repository in a second, and read back",
       "brainforest bench repository --neurons 10000", bench_repository},
      {"seam", "How much quick pictures of a dolly differ from those of a slow and exact renderer",
       "brainforest bench seam --neurons 10000 --frames 250 --size 1280x720 --json", bench_seam},
      {"sections", "How near a hemisphere comes back from its sections, and by how few curves they are drawn",
       "brainforest bench sections lh.pial lh.white", bench_sections},
      {"targets", "How long it takes to show thousands of neurons otherwise",
       "brainforest bench targets --neurons 10000 --json", bench_targets},
  });
  return table;
}

std::function<void()> bench(CLI::App& command, Console& console) {
  command.require_subcommand(1);
  const auto chosen = std::make_shared<std::function<void()>>();
  for (const Benchmark& benchmark : benchmarks()) {
    CLI::App* sub = command.add_subcommand(benchmark.name, benchmark.summary);
    sub->footer(fmt::format("Example:\n  {}", benchmark.example));
    add_common(*sub, console);
    sub->callback([chosen, job = benchmark.setup(*sub, console)] { *chosen = job; });
  }
  return [chosen] { (*chosen)(); };
}

}  // namespace forest::cli
