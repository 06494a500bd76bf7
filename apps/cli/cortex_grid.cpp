// SPDX-License-Identifier: Apache-2.0
// brainforest cortex grid: fills a block by a generator, tells how good its cells are, draws it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/grid.h"
#include "forest/cortex/grid_domains.h"
#include "forest/cortex/grid_picture.h"
#include "forest/cortex/grid_quality.h"
#include "forest/io/elements_file.h"

#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  CLI::App* command = nullptr;
  std::string domain, generator = "best";
  std::filesystem::path elements;
  std::size_t element = 0;
  int steps = 0;       // 0: 20 in the plane, 10 in space
  int dimensions = 0;  // of the domains that are compared; 0: all
  std::filesystem::path out;
  bool force = false;
  cortex::GridPicture picture;
};

std::array<int, 3> steps_of(const Options& options, bool plane) {
  constexpr int most_in_space = 200;  // eight million cells, some of which are smoothed a thousand times
  if (!plane && options.steps > most_in_space)
    throw Error(fmt::format("--steps {0} in space would be {0} x {0} x {0} cells; give {1} at most",
                            options.steps, most_in_space));
  const int n = options.steps ? options.steps : plane ? 20 : 10;
  return {n, n, n};
}

struct Filled {
  cortex::Grid grid;
  std::string generator;
};
Filled fill(const std::string& name, const cortex::Grid& boundary) {
  if (name != "best") return {cortex::generate(boundary, name), name};
  cortex::Best best = cortex::best_grid(boundary);
  return {std::move(best.grid), std::move(best.generator)};
}

double least_scaled_jacobian(const cortex::Grid& grid) {
  double least = INFINITY;
  for (const double v : cortex::measure(grid, cortex::cell_measure("scaled-jacobian")))
    least = std::min(least, v);
  return least;
}

void write(const Options& options, std::span<const cortex::GridPanel> panels) {
  write_unless_there(options.out,
                     extension_of(options.out) == ".svg" ? cortex::to_svg(panels, options.picture)
                                                         : cortex::to_obj(*panels.front().grid),
                     options.force);
}

// Every domain by every generator.
void compare(const Options& options, Console& console) {
  std::vector<std::string> header{"domain"};
  for (const cortex::Generator& row : cortex::generators()) header.push_back(row.name);
  header.push_back("best");
  std::vector<std::vector<std::string>> table;
  std::vector<std::pair<std::string, cortex::Grid>> chosen;
  auto all = nlohmann::ordered_json::array();
  console.progress().begin("filling", cortex::domains().size());
  for (const cortex::Domain& domain : cortex::domains()) {
    console.progress().advance();
    if (options.dimensions && options.dimensions != (domain.plane ? 2 : 3)) continue;
    const cortex::Grid boundary = cortex::boundary(domain, steps_of(options, domain.plane));
    std::vector<std::string> line{domain.name};
    nlohmann::ordered_json told{{"domain", domain.name}, {"dimensions", boundary.dimensions()}};
    for (const cortex::Generator& row : cortex::generators()) {
      const cortex::Grid grid = cortex::generate(boundary, row.name);
      const double least = least_scaled_jacobian(grid);
      const std::size_t bad = cortex::validity(grid).bad;
      line.push_back(bad ? fmt::format("{} folded", bad) : fmt::format("{:.3f}", least));
      told[row.name] = {{"scaled_jacobian", least}, {"folded", bad}};
      if (std::string_view(row.name) == "transfinite")
        chosen.emplace_back(fmt::format("{}: transfinite", domain.name), grid);
    }
    Filled best = fill("best", boundary);
    line.push_back(best.generator);
    told["best"] = best.generator;
    if (best.generator != "transfinite")
      chosen.emplace_back(fmt::format("{}: {}", domain.name, best.generator), std::move(best.grid));
    all.push_back(std::move(told));
    table.push_back(std::move(line));
  }
  console.progress().end();
  if (!options.out.empty()) {
    std::vector<cortex::GridPanel> panels;
    for (const auto& [caption, grid] : chosen) panels.push_back({&grid, caption});
    write(options, panels);
  }
  console.print(all);
  console.table(header, table);
}

struct Block {
  std::string name;
  cortex::Grid boundary;
};
Block block(const Options& options) {
  if (options.elements.empty()) {
    const cortex::Domain& domain = cortex::domain(options.domain);
    return {domain.name, cortex::boundary(domain, steps_of(options, domain.plane))};
  }
  if (!options.domain.empty())
    throw Error(fmt::format("the block is to be '{}' and an element; give one of them", options.domain));
  const cortex::Elements elements = io::read_elements(options.elements).cortex.elements;
  if (options.element >= elements.size())
    throw Error(fmt::format("{} has elements 0 to {}, and no {}", options.elements.string(),
                            elements.size() - 1, options.element));
  const auto [u, v, w] = steps_of(options, false);
  return {fmt::format("element {}", options.element),
          cortex::sample(elements.hexahedron(options.element), {u + 1, v + 1, w + 1})};
}

// Before the work.
void check_out(const Options& options) {
  if (options.out.empty()) return;
  const bool many = options.domain.empty() && options.elements.empty();
  const std::string ending = extension_of(options.out);
  if (ending != ".svg" && (many || ending != ".obj"))
    throw Error(fmt::format("'{}' has no ending that can be written; give {}", options.out.string(),
                            many ? ".svg" : ".svg or .obj"));
  must_have_folder(options.out);
}

// What says nothing of the block that was given was meant for another.
void refuse_unused(const Options& options, bool one, bool in_space) {
  const bool drawn = extension_of(options.out) == ".svg";
  must_be_used(*options.command, {{"--dimensions", "of all blocks together, and one is given", !one},
                                  {"--generator", "of one block, and none is given", one},
                                  {"--up", "of drawings (.svg) of blocks in space", drawn && in_space},
                                  {"--closed", "of drawings (.svg) of blocks in space", drawn && in_space}});
}

void run(const Options& options, Console& console) {
  check_out(options);
  const bool all = options.domain.empty() && options.elements.empty();
  if (all) refuse_unused(options, false, options.dimensions != 2);
  constexpr int most_of_all = 100;
  if ((all || options.generator == "best") && options.steps > most_of_all)
    throw Error(fmt::format("every generator is tried, which takes minutes for more than {} steps; name {}",
                            most_of_all, all ? "a block and a --generator" : "one by --generator"));
  if (all) return compare(options, console);
  const auto [name, boundary] = block(options);
  refuse_unused(options, true, boundary.dimensions() == 3);
  const Filled filled = fill(options.generator, boundary);
  const cortex::Validity validity = cortex::validity(filled.grid);
  if (!options.out.empty()) {
    const cortex::GridPanel panel{&filled.grid, fmt::format("{}: {}", name, filled.generator)};
    write(options, {&panel, 1});
  }
  nlohmann::ordered_json measures;
  std::vector<std::vector<std::string>> rows;
  for (const cortex::QualityRow& row : cortex::quality(filled.grid)) {
    measures[row.measure->name] = {{"min", row.least}, {"p1", row.p1},   {"median", row.median},
                                   {"mean", row.mean}, {"p99", row.p99}, {"max", row.most}};
    std::vector<std::string> line{row.measure->name};
    for (const double v : {row.least, row.p1, row.median, row.mean, row.p99, row.most})
      line.push_back(fmt::format("{:.4g}", v));
    line.push_back(row.measure->what);
    rows.push_back(std::move(line));
  }
  console.print({{"block", name},
                 {"generator", filled.generator},
                 {"cells", filled.grid.cells()},
                 {"folded", validity.bad},
                 {"measures", measures}});
  console.say(fmt::format("{} by {}: {}, {} folded", name, filled.generator,
                          counted(filled.grid.cells(), "cell"), validity.bad));
  console.table({"measure", "min", "p1", "median", "mean", "p99", "max", "what it is"}, rows);
}

}  // namespace

std::function<void()> cortex_grid(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  options->command = &command;
  std::string domains;
  std::vector<std::string> generators{"best"};
  for (const cortex::Domain& row : cortex::domains())
    domains += (domains.empty() ? "" : ", ") + std::string(row.name);
  for (const cortex::Generator& row : cortex::generators()) generators.emplace_back(row.name);
  command.add_option("domain", options->domain,
                     "The block: " + domains + "; by default all, by every generator");
  CLI::Option* const elements = command.add_option(
      "--elements", options->elements, "File of cortex build; then the block is one of its elements");
  must_be_whole(*command.add_option("--element", options->element, "Its number")
                     ->needs(elements)
                     ->capture_default_str(),
                0, 1'000'000'000);
  command
      .add_option("--generator", options->generator,
                  fmt::format("What fills it: {}", fmt::join(generators, ", ")))
      ->check(CLI::IsMember(generators))
      ->capture_default_str();
  command
      .add_option(
          "--steps", options->steps,
          "Cells along each direction; by default 20 in the plane, 10 in space, where 200 are the most")
      ->check(CLI::Range(1, 1000));
  command.add_option("--dimensions", options->dimensions, "Only the blocks of the plane (2) or of space (3)")
      ->check(CLI::IsMember({2, 3}));
  command.add_option("--up", options->picture.up, "The axis that points up in a picture of a block in space")
      ->check(CLI::IsMember({"x", "y", "z", "-x", "-y", "-z"}))
      ->capture_default_str();
  command.add_flag("!--closed", options->picture.opened, "Do not cut out the corner nearest to the eye");
  command.add_option("-o,--out", options->out, "A drawing (.svg), or of one block a mesh (.obj)");
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
