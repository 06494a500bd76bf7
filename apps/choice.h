// SPDX-License-Identifier: Apache-2.0
// What options may be given, one of some words, and never nothing; and how a person is told.
#pragma once

#include <map>
#include <regex>
#include <string>
#include <utility>

#include <CLI/App.hpp>

namespace forest {

/// Such an option of a command line: the word becomes its value; another word is refused with all that there are.
template <class T>
CLI::Validator one_of(const std::map<std::string, T>& words) {
  std::string list;
  for (const auto& [word, value] : words) list += (list.empty() ? "" : ", ") + word;
  return CLI::Validator(
      [list, become = CLI::CheckedTransformer(words)](std::string& text) {
        const std::string word = text;
        return become(text).empty() ? std::string() : "'" + word + "' is none of " + list;
      },
      std::string());
}

/// For all that a command line and what is below it may be given, once it is there: '' is refused, for it is a variable of a script
/// that was never set.
inline void refuse_empty(CLI::App& command) {
  const auto empty = [](const std::string& text) {
    return text.empty() ? "what is given is empty; give a value, or leave the option out" : std::string();
  };
  for (CLI::Option* option : command.get_options())
    if (option->get_expected_max() > 0) option->check(empty);
  for (CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; })) refuse_empty(*below);
}

/// What is wrong with a command line, where the parser's own words are about itself and not about what was given.
inline std::string sentence_of(const CLI::Error& error) {
  static const std::pair<std::regex, const char*> better[] = {
      {std::regex("Could not convert: (\\S+) = (.*)"), "$1: '$2' is no number"},
      {std::regex("(\\S+): At least (\\d+) required but received (\\d+)"), "$1: takes $2 values and has $3"},
      {std::regex("(\\S+): Value (.+) not in range (.+) to (.+)"), "$1: '$2' is no number from $3 to $4"},
      {std::regex("(\\S+): (.+) not in \\{(.+)\\}"), "$1: '$2' is none of $3"}};
  const std::string words = error.what();
  for (const auto& [pattern, sentence] : better)
    if (std::regex_match(words, pattern)) return std::regex_replace(words, pattern, sentence);
  return words;
}

}  // namespace forest
