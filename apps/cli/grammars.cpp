// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/grammars.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"

namespace forest::cli {
namespace {

constexpr const char* extension = ".lsys";

std::filesystem::path folder() { return data_folder() / "grammars"; }

}  // namespace

std::vector<std::string> built_in_grammars() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder(), none))
    if (entry.path().extension() == extension) names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

lsystem::Grammar find_grammar(const std::string& name_or_path) {
  std::error_code none;
  if (std::ranges::count(built_in_grammars(), name_or_path))
    return lsystem::parse_file(folder() / (name_or_path + extension));
  if (!std::filesystem::exists(name_or_path, none))
    throw InputError(name_or_path, 0,
                     fmt::format("there is no such grammar; give a file or one of {}",
                                 fmt::join(built_in_grammars(), ", ")));
  lsystem::Grammar grammar = lsystem::parse_file(name_or_path);
  grammar.name = reference_of(grammar.name).name;  // NAME@version.lsys is what export writes
  return grammar;
}

void tell_doubts(const lsystem::Grammar& grammar, Console& console) {
  for (const std::string& doubt : grammar.doubts) console.warn(doubt);
}

repository::TextsByName distributions_of(const lsystem::Grammar& grammar) {
  constexpr std::size_t most = 100'000'000;
  repository::TextsByName distributions;
  std::size_t size = 0;
  for (const lsystem::Declaration& declaration : grammar.declarations) {
    if (!declaration.draws) continue;
    std::string text = text_of(declaration, grammar);
    if (size + text.size() > most)
      text = fmt::format(
          "# {:.0f} MB with all that it builds on, which the model has and is not repeated here\n",
          double(text.size()) / 1e6);
    size += text.size();
    distributions.emplace_back(declaration.name, std::move(text));
  }
  return distributions;
}

std::string listed(const std::string& cell) {
  std::string text;
  for (const char c : repository::escaped(cell) + ' ') {
    if (c == ' ' && text.ends_with(',')) text.replace(text.size() - 1, 1, "\\x2C");
    text += c;
  }
  text.pop_back();
  return text;
}

std::set<std::string> cells_fitted_to(std::string_view text) {
  constexpr std::string_view begin = "# They are";
  std::set<std::string> cells;
  for (bool listing = false; text.starts_with('#');) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!listing && !line.starts_with(begin)) continue;
    line.remove_prefix(listing ? 1 : begin.size());
    listing = line.ends_with(',');
    while (!line.empty()) {
      const std::size_t comma = std::min(line.find(", "), line.size() - listing);
      std::string_view cell = line.substr(0, comma);
      if (cell.starts_with(' ')) cell.remove_prefix(1);
      cells.emplace(cell);
      line.remove_prefix(std::min(comma + 1, line.size()));
    }
    if (!listing) break;
  }
  return cells;
}

Reference reference_of(const std::string& text) {
  const std::size_t at = text.rfind('@');
  if (at == text.npos || at == 0) return {text};
  const auto version = number_of<int>(std::string_view(text).substr(at + 1));
  return version && *version > 0 ? Reference{text.substr(0, at), *version} : Reference{text};
}

repository::ModelRow find_model(const repository::Repository& repository, const std::string& reference) {
  using repository::shown;
  const auto [name, version] = reference_of(reference);
  if (auto model = repository.model(name, version)) return *model;
  if (auto model = repository.model(reference)) return *model;  // a name that ends like a version
  if (const auto newest = repository.model(name))
    throw Error(
        fmt::format("model {} has no version {}; its newest is {}", shown(name), version, newest->version));
  std::vector<std::string> known;
  for (const repository::ModelRow& model : repository.models())
    if (known.empty() || known.back() != model.name) known.push_back(model.name);
  throw Error(fmt::format("there is no model {}; {}", shown(name),
                          known.empty() ? "store one with brainforest model import"
                                        : fmt::format("those that are there: {}", fmt::join(known, ", "))));
}

lsystem::Grammar grammar_of_model(const std::string& repo, const std::string& reference) {
  const auto model = find_model(repository::Repository::open(repo, repository::Access::read), reference);
  lsystem::Grammar grammar =
      lsystem::parse(model.text, fmt::format("{}@{} in {}", model.name, model.version, repo));
  grammar.name = model.name;
  return grammar;
}

}  // namespace forest::cli
