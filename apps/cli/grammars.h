// SPDX-License-Identifier: Apache-2.0
// Grammars by name: those that come with the project lie in the folder grammars of data_folder(), models in a repository.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "forest/lsystem/grammar.h"
#include "forest/repository/repository.h"

namespace forest::cli {

class Console;

/// The names of the built-in grammars, in alphabetical order.
std::vector<std::string> built_in_grammars();

/// A built-in grammar by its name, any other by the path of its file. Throws InputError when there is none.
lsystem::Grammar find_grammar(const std::string& name_or_path);

/// Warns of what is read otherwise than it looks.
void tell_doubts(const lsystem::Grammar& grammar, Console& console);

/// The distributions that a grammar names, each as a text that stands alone; where they would be more than 100 MB together, of some a line
/// that says so.
repository::TextsByName distributions_of(const lsystem::Grammar& grammar);

/// The name of a cell as it stands in a list: escaped, and commas that would end it are \x2C.
std::string listed(const std::string& cell);

/// The cells that a model was fitted to, as its first lines say (`# They are a, b,` and more such lines), each as listed() writes it;
/// none when they do not.
std::set<std::string> cells_fitted_to(std::string_view text);

/// What NAME or NAME@version names.
struct Reference {
  std::string name;
  int version = 0;  // 0: the newest
};
Reference reference_of(const std::string& text);

/// A model by its reference. Throws Error that says which there are.
repository::ModelRow find_model(const repository::Repository& repository, const std::string& reference);

/// The grammar of a model in the repository at `repo`, by the model's name.
lsystem::Grammar grammar_of_model(const std::string& repo, const std::string& reference);

}  // namespace forest::cli
