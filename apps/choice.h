// SPDX-License-Identifier: Apache-2.0
// An option that is one of some words.
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

}  // namespace forest
