// SPDX-License-Identifier: Apache-2.0
// brainforest pack: a circuit becomes a forest file. Its morphologies are read when their turn comes, so that they need not
// fit into memory.
#include <atomic>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/node_sets.h"
#include "forest/io/sonata.h"
#include "forest/io/sonata_edges.h"
#include "forest/scene/forest.h"
#include "forest/scene/synapses.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/verb.h"
#include "apps/forest_files.h"

namespace forest::cli {

namespace {

// Nodes that follow one another, as runs.
circuit::NodeNames names_of(const reports::Nodes& nodes) {
  circuit::NodeNames names{nodes.populations, {}};
  for (std::uint32_t i = 0; i < nodes.of_instance.size(); ++i) {
    const auto& [population, id] = nodes.of_instance[i];
    if (names.runs.empty() || names.runs.back().population != population ||
        names.runs.back().first_node + names.runs.back().count != id)
      names.runs.push_back({population, i, id, 0});
    ++names.runs.back().count;
  }
  return names;
}

// The circuit's own node sets, so that the forest file knows them; a file of them that cannot be read stops nobody.
std::string sets_of(const std::filesystem::path& file, Console& console) {
  if (file.empty()) return {};
  try {
    return io::to_json(io::read_node_sets(file));
  } catch (const InputError& error) {
    console.warn(fmt::format("{}; the forest file has none of these node sets", error.what()));
    return {};
  }
}

// Packs the synapses of a circuit beside its forest file; returns how many. Without any there is no file.
std::size_t pack_synapses(const std::filesystem::path& circuit, const io::SonataOutline& outline,
                          const std::filesystem::path& out, std::vector<io::Warning>& warnings,
                          Console& console) {
  io::SonataEdges edges = io::read_edges(circuit, outline.circuit, outline.nodes);
  std::ranges::move(edges.warnings, std::back_inserter(warnings));
  for (const std::string& sentence : edges.damaged)
    console.warn(sentence + ", --no-synapses leaves all out without this");
  std::size_t count = 0;
  for (const auto& projection : edges.projections) count += projection.synapses.size();
  if (count)
    write_file(scene::Synapses::beside(out),
               scene::Synapses::make(scene::Forest::open(out), edges.projections, console.progress()));
  return count;
}

}  // namespace

std::function<void()> pack(CLI::App& command, Console& console) {
  struct Options {
    std::filesystem::path circuit, out;
    bool verbose = false, no_synapses = false;
  };
  const auto options = std::make_shared<Options>();
  command.add_option("circuit", options->circuit, "Folder of a SONATA circuit, or its configuration file")
      ->required();
  command.add_option("-o,--out", options->out, "The forest file")->required();
  command.add_flag("--verbose", options->verbose, "Say every oddity of the circuit's files");
  command.add_flag("--no-synapses", options->no_synapses,
                   "Leave out the synapses, which are packed beside the forest: column.synapses");
  return [options, &console] {
    if (holds_cells(options->circuit))
      throw InputError(
          options->circuit.string(), 0,
          "holds neurons and no circuit; 'brainforest render' draws them as they are, and 'plant' makes "
          "a circuit of a population");
    must_take(options->out, forest_file);
    const std::filesystem::path beside = scene::Synapses::beside(options->out);
    must_take(beside, synapses_file);
    const auto begin = Clock::now();
    io::SonataOutline outline = io::outline_sonata(options->circuit);
    std::vector<std::vector<io::Warning>> oddities(outline.files.size());  // of their files
    std::atomic<std::size_t> count = 0;
    const auto read = [&](std::size_t index) {
      io::ReadResult one = outline.morphology(index);
      count += one.warnings.size();
      if (options->verbose) oddities[index] = std::move(one.warnings);
      return std::move(one.morphology);
    };
    circuit::NodeNames names = names_of(outline.nodes);
    names.sets = sets_of(outline.node_sets, console);
    names.attributes = std::move(outline.attributes);
    const scene::PackFigures figures =
        scene::pack(outline.circuit, read, options->out, console.progress(), names);
    const double seconds = seconds_since(begin);
    std::size_t synapses = 0;
    if (!options->no_synapses) try {
        synapses = pack_synapses(options->circuit, outline, options->out, outline.warnings, console);
      } catch (const Error& e) {  // the forest is whole without them
        console.warn(fmt::format("{}; the forest has no synapses, --no-synapses leaves them out without this",
                                 e.what()));
      }
    if (!synapses && std::filesystem::is_regular_file(beside))
      std::filesystem::remove(beside);  // of the forest that was here before
    count += outline.warnings.size();
    if (options->verbose) {
      for (const io::Warning& w : outline.warnings) console.warn(w.sentence);
      for (const auto& list : oddities)
        for (const io::Warning& w : list) console.warn(w.sentence);
    } else if (count) {
      console.warn(fmt::format("{} in {}; see them with --verbose",
                               counted(count.load(), "oddity", "oddities"), options->circuit.string()));
    }
    console.print({{"file", options->out.string()},
                   {"neurons", outline.circuit.instances.size()},
                   {"distinct", outline.files.size()},
                   {"segments", figures.segments},
                   {"planted_segments", figures.segment_total},
                   {"synapses", synapses},
                   {"bytes", figures.bytes},
                   {"seconds", seconds},
                   {"segments_per_second", double(figures.segments) / seconds},
                   {"peak_bytes", peak_bytes()}});
    console.table({"file", "neurons", "distinct", "segments", "planted", "bytes", "seconds"},
                  {{options->out.string(), fmt::format("{}", outline.circuit.instances.size()),
                    fmt::format("{}", outline.files.size()), fmt::format("{}", figures.segments),
                    fmt::format("{}", figures.segment_total), fmt::format("{}", figures.bytes),
                    fmt::format("{:.2f}", seconds)}});
  };
}

}  // namespace forest::cli
