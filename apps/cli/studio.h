// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace forest::cli {

bool has_display();

/// Becomes the studio: returns only by throwing Error.
[[noreturn]] void open_studio(const std::filesystem::path& forest, const std::string& view = "",
                              const std::vector<std::filesystem::path>& node_sets = {},
                              const std::filesystem::path& activity = {},
                              const std::vector<std::string>& more = {});  // words of its command line

}  // namespace forest::cli
