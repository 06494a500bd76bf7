// SPDX-License-Identifier: Apache-2.0
#include "forest/core/file.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"

namespace forest {
namespace {

TEST(File, WrittenTextIsReadBackAndNothingElseIsLeft) {
  const auto folder = std::filesystem::temp_directory_path() / "forest_file_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  write_file(folder / "a.txt", "one");
  write_file(folder / "a.txt", "two words");
  EXPECT_EQ(MappedFile(folder / "a.txt").text(), "two words");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
}

TEST(File, AMissingFileOrFolderIsAnErrorThatNamesIt) {
  EXPECT_THROW(MappedFile("/nowhere/at/all"), InputError);
  EXPECT_THROW(MappedFile("/tmp"), InputError);
  EXPECT_THROW(write_file("/nowhere/at/all", "x"), Error);
}

TEST(File, HashTellsOneByte) {
  const std::string a = "abc", b = "abd";
  EXPECT_NE(hash_hex(std::as_bytes(std::span(a))), hash_hex(std::as_bytes(std::span(b))));
  EXPECT_EQ(hash_hex(std::as_bytes(std::span(a))).size(), 32u);
}

}  // namespace
}  // namespace forest
