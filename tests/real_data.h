// SPDX-License-Identifier: Apache-2.0
// Where real data is: $BRAINFOREST_DATA, else the folder shared/data beside the project.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace forest {

inline std::optional<std::filesystem::path> real_data(const std::filesystem::path& sub) {
  const char* chosen = std::getenv("BRAINFOREST_DATA");
  const std::filesystem::path root = chosen ? chosen : FOREST_SOURCE_DIR "/../shared/data";
  if (std::filesystem::exists(root / sub)) return root / sub;
  return std::nullopt;
}

inline bool real_data_required() {
  const char* required = std::getenv("BRAINFOREST_REQUIRE_DATA");
  return required && std::string_view(required) == "1";
}

/// All files below `folder` with this extension, sorted.
inline std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder,
                                                      std::string_view extension) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == extension) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

}  // namespace forest

/// `name`, its path, for the rest of the test; without the data it is skipped, or fails where
/// BRAINFOREST_REQUIRE_DATA=1.
#define FOREST_REAL_DATA(name, sub)                                                               \
  const auto name##_found = forest::real_data(sub);                                               \
  if (!name##_found && forest::real_data_required()) FAIL() << "there is no real data " << (sub); \
  if (!name##_found) GTEST_SKIP() << "there is no real data " << (sub);                           \
  const std::filesystem::path name = *name##_found
