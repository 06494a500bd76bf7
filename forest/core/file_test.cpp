// SPDX-License-Identifier: Apache-2.0
#include "forest/core/file.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/stat.h>

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

class FileInAFolder : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("forest_file_test." + std::to_string(::getpid()));
};

TEST_F(FileInAFolder, ALinkStaysAndWhatItPointsToIsWritten) {
  namespace fs = std::filesystem;
  fs::create_directories(folder_ / "deep");
  write_file(folder_ / "deep/real", "old");
  fs::permissions(folder_ / "deep/real", fs::perms(0600));
  fs::create_symlink("deep/real", folder_ / "link");
  fs::create_symlink("link", folder_ / "second");
  fs::create_symlink("deep/later", folder_ / "dangling");
  write_file(folder_ / "second", "new");
  write_file(folder_ / "dangling", "made");
  EXPECT_TRUE(fs::is_symlink(folder_ / "second") && fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(MappedFile(folder_ / "deep/real").text(), "new");
  EXPECT_EQ(fs::status(folder_ / "deep/real").permissions(), fs::perms(0600));
  EXPECT_EQ(MappedFile(folder_ / "deep/later").text(), "made");

  fs::create_symlink("circle", folder_ / "circle");
  EXPECT_THROW(write_file(folder_ / "circle", "x"), Error);
  EXPECT_THROW(write_file(folder_ / "deep", "x"), Error);
}

TEST_F(FileInAFolder, APipeTakesTheBytesAndStaysAPipe) {
  const auto pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = (std::ostringstream() << std::ifstream(pipe).rdbuf()).str(); });
  write_file(pipe, "through");
  reader.join();
  EXPECT_EQ(read, "through");
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST_F(FileInAFolder, APipeIsNotReadAndNotWaitedFor) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  try {
    MappedFile(folder_ / "pipe");
    FAIL() << "a pipe was mapped";
  } catch (const InputError& error) {
    EXPECT_NE(error.sentence().find("a pipe"), std::string::npos) << error.what();
  }
}

TEST(File, ADeviceIsWrittenIntoAndNotReplaced) {
  write_file("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THROW(write_file("/dev/full", "x"), Error);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(File, HashTellsOneByte) {
  const std::string a = "abc", b = "abd";
  EXPECT_NE(hash_hex(std::as_bytes(std::span(a))), hash_hex(std::as_bytes(std::span(b))));
  EXPECT_EQ(hash_hex(std::as_bytes(std::span(a))).size(), 32u);
}

}  // namespace
}  // namespace forest
