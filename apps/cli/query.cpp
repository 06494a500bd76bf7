// SPDX-License-Identifier: Apache-2.0
// brainforest query: a question in SQL to a repository, which nothing can be written by.
#include <cmath>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/io/workbook.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using repository::Answer;

struct Options {
  std::string question, repo;
  std::filesystem::path csv;
  bool force = false;
};

struct ToText {
  std::string operator()(std::monostate) const { return ""; }
  std::string operator()(std::int64_t value) const { return fmt::format("{}", value); }
  std::string operator()(double value) const { return fmt::format("{}", value); }
  std::string operator()(const std::string& value) const { return repository::one_line(value); }
};

struct ToJson {
  nlohmann::ordered_json operator()(std::monostate) const { return nullptr; }
  nlohmann::ordered_json operator()(std::int64_t value) const { return value; }
  nlohmann::ordered_json operator()(double value) const {  // JSON has no infinite numbers
    return std::isinf(value) ? nlohmann::ordered_json(fmt::format("{}", value))
                             : nlohmann::ordered_json(value);
  }
  nlohmann::ordered_json operator()(const std::string& value) const { return value; }
};

std::string csv_of(Answer answer) {
  io::TableSheet sheet{"answer", {}, std::move(answer.rows)};
  for (std::string& column : answer.columns) sheet.columns.push_back({std::move(column), ""});
  return io::csv_of(sheet);
}

void run(const Options& options, Console& console) {
  auto repository = repository::Repository::open(options.repo, repository::Access::read);
  const Answer answer = repository.query(options.question);
  if (!options.csv.empty()) {
    const std::string csv = csv_of(answer);
    write_unless_there(options.csv, csv, options.force);
    console.say(fmt::format("{} written to {}", counted(answer.rows.size(), "row"), options.csv.string()));
  } else {
    std::vector<std::vector<std::string>> lines;
    for (const auto& row : answer.rows) {
      auto& line = lines.emplace_back();
      for (const Answer::Value& value : row) line.push_back(std::visit(ToText{}, value));
    }
    console.table(answer.columns, lines);
    console.say(counted(answer.rows.size(), "row"));
  }
  if (!console.json) return;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const auto& row : answer.rows) {
    auto& line = rows.emplace_back(nlohmann::ordered_json::array());
    for (const Answer::Value& value : row) line.push_back(std::visit(ToJson{}, value));
  }
  console.print({{"columns", answer.columns}, {"rows", rows}});
}

}  // namespace

std::function<void()> query(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command
      .add_option(
          "question", options->question,
          "A select on the views neuron, section, junction, metric, model and distribution, or on the tables")
      ->required()
      ->type_name("SQL");
  command.add_option("--repo", options->repo, "The repository: a file, or postgresql://role@host/database")
      ->required()
      ->type_name("REPO");
  command.add_option("--csv", options->csv, "Write the answer into this file");
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
