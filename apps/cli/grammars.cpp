// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/grammars.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "forest/core/error.h"

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
  return lsystem::parse_file(name_or_path);
}

}  // namespace forest::cli
