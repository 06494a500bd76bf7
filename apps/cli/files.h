// SPDX-License-Identifier: Apache-2.0
// Which files a command line means.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace forest::cli {

/// Files as they were named; folders as the files of a known format anywhere below them, sorted. Throws InputError for a
/// folder without any.
std::vector<std::filesystem::path> neuron_files(const std::vector<std::string>& names);

}  // namespace forest::cli
