// SPDX-License-Identifier: Apache-2.0
// brainforest bench repository: neurons in memory into a repository and back. What is read is compared with what was stored.
#include <chrono>
#include <filesystem>
#include <memory>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace repository;
using Clock = std::chrono::steady_clock;

struct Options {
  std::uint32_t neurons = 4000, sections = 300, points = 6;
  std::filesystem::path folder = std::filesystem::temp_directory_path();
};

/// Five binary trees of sections of `points` points each, as a grown cell has them.
Morphology synthetic_neuron(const Options& options, std::uint64_t index) {
  Random random(1, index, 10);
  MorphologyBuilder builder;
  builder.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 8}}, .parents = {}, .contour_starts = {}});
  std::vector<Point> ends;
  for (std::uint32_t i = 0; i < options.sections; ++i) {
    const std::uint32_t parent = i < 5 ? 0 : (i - 5) / 2;
    Point at = i < 5 ? Point{0, 0, 0, 2} : ends[parent];
    std::vector<Point> points;
    for (std::uint32_t p = 0; p < options.points; ++p) {
      points.push_back(at);
      at = {at.x + float(random.normal()), at.y + float(random.normal()), at.z + float(random.normal()),
            at.radius * .99f};
    }
    builder.add_section(i < 5 ? SectionId() : SectionId(parent), SectionKind::basal, points);
    ends.push_back(points.back());
  }
  return builder.build();
}

template <class Body>
double seconds(Body&& body) {
  const auto begin = Clock::now();
  body();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void run(const Options& options, Console& console) {
  std::vector<Morphology> cells;  // distinct ones; they are stored again and again under other indices
  for (std::uint64_t i = 0; i < 64; ++i) cells.push_back(synthetic_neuron(options, i));
  const auto path = options.folder / fmt::format("bench-{}.db", ::getpid());
  struct Remove {
    std::filesystem::path path;
    ~Remove() { std::filesystem::remove(path); }
  } const remove{path};

  Repository repository = Repository::open(path.string(), Access::write);
  const std::string hash = repository.add_grammar("bench", "bench");
  const auto add = [&](std::uint64_t i, std::uint64_t seed) {
    NewNeuron neuron;
    neuron.name = fmt::format("{}-{}", seed, i);
    neuron.provenance = Grown{"bench", hash, seed, i};
    repository.add(cells[i % cells.size()], neuron);
  };
  const std::uint32_t alone = options.neurons / 10;
  const double batch = seconds([&] {
    auto transaction = repository.begin();
    for (std::uint64_t i = 0; i < options.neurons; ++i) add(i, 1);
    transaction.commit();
  });
  const double parallel = seconds([&] {  // as grow does: made ready on all cores, some at a time
    std::optional<Repository::Transaction> transaction;
    parallel_in_order(
        options.neurons, [&](std::size_t i) { return Prepared(cells[i % cells.size()]); },
        [&](std::size_t i, Prepared&& ready) {
          if (!transaction) transaction.emplace(repository.begin());
          NewNeuron neuron;
          neuron.name = fmt::format("3-{}", i);
          neuron.provenance = Grown{"bench", hash, 3, i};
          repository.add(std::move(ready), neuron);
          if (i % 500 == 499 || i + 1 == options.neurons) transaction->commit(), transaction.reset();
        });
  });
  const double single = seconds([&] {
    for (std::uint64_t i = 0; i < alone; ++i) add(i, 2);
  });
  std::vector<NeuronRow> rows;
  const double list = seconds([&] { rows = repository.neurons(); });
  std::vector<Morphology> back;
  const double read = seconds([&] {
    for (const NeuronRow& row : rows) back.push_back(repository.morphology(row.id));
  });
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (back[i] != cells[std::get<Grown>(rows[i].provenance).index % cells.size()] ||
        rows.size() != 2 * options.neurons + alone)
      throw Error(
          "a neuron did not come back as it was stored; this is an error of the program, please report it");

  const double bytes = double(std::filesystem::file_size(path)) / double(rows.size());
  console.table({"neurons of " + std::to_string(options.sections) + " sections", "per second"},
                {{"stored, all in one transaction", fmt::format("{:.0f}", options.neurons / batch)},
                 {"the same, prepared on all cores", fmt::format("{:.0f}", options.neurons / parallel)},
                 {"stored, each in its own", fmt::format("{:.0f}", alone / single)},
                 {"read", fmt::format("{:.0f}", double(rows.size()) / read)},
                 {"listed", fmt::format("{:.0f}", double(rows.size()) / list)}});
  console.say(fmt::format("{:.0f} bytes a neuron of {} points", bytes, rows[0].points));
  console.print({{"sections_per_neuron", options.sections},
                 {"points_per_neuron", rows[0].points},
                 {"stored_per_second", options.neurons / batch},
                 {"stored_on_all_cores_per_second", options.neurons / parallel},
                 {"stored_singly_per_second", alone / single},
                 {"read_per_second", double(rows.size()) / read},
                 {"listed_per_second", double(rows.size()) / list},
                 {"bytes_per_neuron", bytes}});
}

}  // namespace

std::function<void()> bench_repository(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("--neurons", options->neurons, "Neurons to store")
      ->capture_default_str()
      ->check(CLI::Range(10u, 10'000'000u));
  command.add_option("--sections", options->sections, "Sections of each")
      ->capture_default_str()
      ->check(CLI::Range(5u, 1'000'000u));
  command.add_option("--folder", options->folder, "Where the repository is made, and removed again")
      ->check(CLI::ExistingDirectory);
  command.footer("Example:\n  brainforest bench repository --neurons 10000");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
