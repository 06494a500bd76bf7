// SPDX-License-Identifier: Apache-2.0
// What options may be given: one of some words, and never nothing.
#pragma once

#include <map>
#include <string>

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

/// For all named options of a command line and of what is below it, once they are there: '' is refused, for it is a variable of a script
/// that was never set.
inline void refuse_empty(CLI::App& command) {
  const auto empty = [](const std::string& text) {
    return text.empty() ? "what is given is empty; give a value, or leave the option out" : std::string();
  };
  for (CLI::Option* option : command.get_options())
    if (!option->get_positional() && option->get_expected_max() > 0) option->check(empty);
  for (CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; })) refuse_empty(*below);
}

}  // namespace forest
