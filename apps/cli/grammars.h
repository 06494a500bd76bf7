// SPDX-License-Identifier: Apache-2.0
// Grammars by name: those that come with the project lie in the folder grammars of data_folder().
#pragma once

#include <string>
#include <vector>

#include "forest/lsystem/grammar.h"

namespace forest::cli {

/// The names of the built-in grammars, in alphabetical order.
std::vector<std::string> built_in_grammars();

/// A built-in grammar by its name, any other by the path of its file. Throws InputError when there is none.
lsystem::Grammar find_grammar(const std::string& name_or_path);

}  // namespace forest::cli
