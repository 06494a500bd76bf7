// SPDX-License-Identifier: Apache-2.0
// brainforest pack: a circuit becomes a forest file.
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/file.h"
#include "forest/io/sonata.h"
#include "forest/scene/forest.h"

#include "apps/cli/console.h"
#include "apps/cli/verb.h"

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

}  // namespace

std::function<void()> pack(CLI::App& command, Console& console) {
  struct Options {
    std::filesystem::path circuit, out;
    bool verbose = false;
  };
  const auto options = std::make_shared<Options>();
  command.add_option("circuit", options->circuit, "Folder of a SONATA circuit, or its configuration file")
      ->required();
  command.add_option("-o,--out", options->out, "The forest file")->required();
  command.add_flag("--verbose", options->verbose, "Say every oddity of the circuit's files");
  return [options, &console] {
    const io::SonataCircuit read = io::read_sonata(options->circuit, console.progress());
    if (options->verbose)
      for (const io::Warning& w : read.warnings) console.warn(w.sentence);
    else if (!read.warnings.empty())
      console.warn(fmt::format("{} oddities in {}; see them with --verbose", read.warnings.size(),
                               options->circuit.string()));
    const auto bytes = scene::pack(read.circuit, read.morphologies, console.progress(), names_of(read.nodes));
    write_file(options->out, bytes);
    const scene::Forest forest = scene::Forest::open(options->out);
    console.print({{"file", options->out.string()},
                   {"neurons", forest.instances().size()},
                   {"distinct", forest.neurons().size()},
                   {"segments", forest.segment_total()},
                   {"bytes", forest.bytes()}});
    console.table({"file", "neurons", "distinct", "segments", "bytes"},
                  {{options->out.string(), fmt::format("{}", forest.instances().size()),
                    fmt::format("{}", forest.neurons().size()), fmt::format("{}", forest.segment_total()),
                    fmt::format("{}", forest.bytes())}});
  };
}

}  // namespace forest::cli
