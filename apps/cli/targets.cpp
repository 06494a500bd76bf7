// SPDX-License-Identifier: Apache-2.0
// brainforest targets: which sets of neurons a forest has, and node sets read, combined and edited.
#include "forest/scene/targets.h"

#include <map>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/io/node_sets.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/target_options.h"
#include "apps/cli/verb.h"
#include "apps/forest_files.h"

namespace forest::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::filesystem::path forest, out;
  std::vector<std::filesystem::path> node_sets;
  std::vector<std::string> define, remove;
  std::string members;
  bool force = false;
};

// Of each population, the numbers that its members have there.
std::map<std::string, std::vector<double>> nodes_of(const scene::Forest& forest,
                                                    const circuit::Members& members) {
  std::map<std::string, std::vector<double>> nodes;
  auto run = forest.nodes().runs.begin();
  for (const std::uint32_t i : members) {
    while (i - run->first_instance >= run->count) ++run;
    nodes[forest.nodes().populations[run->population]].push_back(
        double(run->first_node + i - run->first_instance));
  }
  return nodes;
}

// SONATA knows unions and lists of nodes: whatever else was said becomes the nodes that it means in this forest.
std::vector<circuit::NodeSet> sets_of(const std::string& name, const std::string& expression,
                                      const scene::Targets& targets) {
  using circuit::Clause;
  if (expression.starts_with('{') || expression.starts_with('[')) {
    circuit::NodeSet set = io::parse_node_set(expression, name);
    set.name = name;
    return {set};
  }
  const circuit::Members& members = targets.find(expression);
  if (const auto names = circuit::union_of(expression);
      names &&
      std::ranges::all_of(*names, [&](const auto& n) { return n != name && targets.sets().find(n); }))
    return {{.name = name, .clauses = {}, .of = *names, .compound = true}};
  const auto nodes = nodes_of(targets.forest(), members);
  std::vector<circuit::NodeSet> sets;
  circuit::NodeSet whole{.name = name, .clauses = {}, .of = {}, .compound = true};
  for (const auto& [population, ids] : nodes) {
    const std::string part = nodes.size() == 1 ? name : fmt::format("{} of {}", name, population);
    sets.push_back({.name = part,
                    .clauses = {{"population", Clause::Test::any_of, {population}, {}},
                                {"node_id", Clause::Test::any_of, {}, ids}},
                    .of = {}});
    whole.of.push_back(part);
  }
  if (nodes.size() != 1) sets.push_back(whole);
  return sets;
}

void define(const std::string& said, scene::Targets& targets, Console& console) {
  const std::size_t equals = said.find('=');
  if (equals == 0 || equals == std::string::npos)
    throw Error(
        fmt::format("'{}' defines nothing; give NAME=EXPRESSION, for example \"deep=L5 or L6\"", said));
  const std::string name = said.substr(0, equals), expression = said.substr(equals + 1);
  circuit::NodeSets sets = targets.sets();
  for (circuit::NodeSet& set : sets_of(name, expression, targets)) sets.put(std::move(set));
  targets.use(std::move(sets));
  if (targets.find(name).empty()) console.warn(fmt::format("no neuron belongs to the target '{}'", name));
}

void remove(const std::string& name, scene::Targets& targets) {
  circuit::NodeSets sets = targets.sets();
  if (!sets.remove(name)) throw Error(fmt::format("there is no node set '{}' to remove", name));
  targets.use(std::move(sets));
}

void run(const Options& options, Console& console) {
  must_not_be_read("--out", options.out, {options.forest});
  const scene::Forest forest = open_forest(options.forest);
  scene::Targets targets(forest, read_node_sets(forest, options.node_sets, console));
  for (const std::string& name : options.remove) remove(name, targets);
  for (const std::string& said : options.define) define(said, targets, console);

  Json json{{"forest", options.forest.string()},
            {"neurons", forest.instances().size()},
            {"targets", Json::array()}};
  if (!options.members.empty()) {
    Json members = Json::object();
    std::vector<std::vector<std::string>> rows;
    for (const auto& [population, ids] : nodes_of(forest, targets.find(options.members)))
      for (const double id : ids) {
        members[population].push_back(std::uint64_t(id));
        rows.push_back({population, fmt::format("{:.0f}", id)});
      }
    console.print({{"forest", options.forest.string()}, {"target", options.members}, {"members", members}});
    console.table({"population", "node"}, rows);
  } else {
    std::vector<std::vector<std::string>> rows;
    for (const scene::TargetFacts& t : targets.list()) {
      if (!t.problem.empty()) console.warn(t.problem);
      json["targets"].push_back({{"name", t.name}, {"origin", t.origin}});
      if (t.problem.empty())
        json["targets"].back()["neurons"] = t.count;
      else
        json["targets"].back()["problem"] = t.problem;
      rows.push_back({t.name, t.origin, t.problem.empty() ? fmt::format("{}", t.count) : "?"});
    }
    console.print(json);
    console.table({"target", "is a", "neurons"}, rows);
  }
  if (!options.out.empty()) write_unless_there(options.out, io::to_json(targets.sets()), options.force);
}

}  // namespace

std::function<void()> targets(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("forest", options->forest, "Forest file")->required();
  add_node_sets(command, options->node_sets);
  command
      .add_option(
          "--define", options->define,
          "NAME=EXPRESSION: names joined by and, or, not and parentheses, or a rule of SONATA as JSON")
      ->type_name("NAME=EXPRESSION");
  command.add_option("--remove", options->remove, "Take a node set out, before any is defined")
      ->type_name("NAME");
  command
      .add_option("--members", options->members,
                  "Tell the nodes of this target instead of the list of targets")
      ->type_name("TARGET");
  command.add_option("-o,--out", options->out, "Write the node sets, those defined too, as a JSON file");
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
