// SPDX-License-Identifier: Apache-2.0
// brainforest query: a question in SQL to a repository, which nothing can be written by.
#include <iterator>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using repository::Answer;

struct Options {
  std::string question, repo;
  std::filesystem::path csv;
};

struct ToText {
  std::string operator()(std::monostate) const { return ""; }
  std::string operator()(std::int64_t value) const { return fmt::format("{}", value); }
  std::string operator()(double value) const { return fmt::format("{}", value); }
  std::string operator()(const std::string& value) const { return repository::escaped(value); }
};

struct ToJson {
  nlohmann::ordered_json operator()(std::monostate) const { return nullptr; }
  nlohmann::ordered_json operator()(std::int64_t value) const { return value; }
  nlohmann::ordered_json operator()(double value) const { return value; }
  nlohmann::ordered_json operator()(const std::string& value) const { return repository::escaped(value); }
};

/// As RFC 4180 has it.
std::string csv_of(const Answer& answer) {
  std::string csv;
  const auto line = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i) csv += ',';
      if (cells[i].find_first_of(",\"\r\n") == std::string::npos) {
        csv += cells[i];
        continue;
      }
      csv += '"';
      for (const char c : cells[i]) csv.append(c == '"' ? 2 : 1, c);
      csv += '"';
    }
    csv += "\r\n";
  };
  line(answer.columns);
  for (const auto& row : answer.rows) {
    std::vector<std::string> cells;
    for (const Answer::Value& value : row) cells.push_back(std::visit(ToText{}, value));
    line(cells);
  }
  return csv;
}

void run(const Options& options, Console& console) {
  auto repository = repository::Repository::open(options.repo, repository::Access::read);
  const Answer answer = repository.query(options.question);
  if (!options.csv.empty()) {
    write_file(options.csv, std::string_view(csv_of(answer)));
    console.say(fmt::format("{} rows are written to {}", answer.rows.size(), options.csv.string()));
  } else {
    std::vector<std::vector<std::string>> lines;
    for (const auto& row : answer.rows) {
      auto& line = lines.emplace_back();
      for (const Answer::Value& value : row) line.push_back(std::visit(ToText{}, value));
    }
    console.table(answer.columns, lines);
    console.say(fmt::format("{} rows", answer.rows.size()));
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
      .add_option("question", options->question,
                  "A select on the views neuron, section, junction and metric, or on the tables")
      ->required()
      ->type_name("SQL");
  command.add_option("--repo", options->repo, "The repository: a file, or postgresql://role@host/database")
      ->required()
      ->type_name("REPO");
  command.add_option("--csv", options->csv, "Write the answer into this file");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
