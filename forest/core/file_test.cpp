// SPDX-License-Identifier: Apache-2.0
#include "forest/core/file.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"

#include "tests/refused.h"

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
  EXPECT_NE(refused<InputError>([&] { MappedFile(folder_ / "pipe"); }).find("a pipe"), std::string::npos);
}

TEST(File, ADeviceIsWrittenIntoAndNotReplaced) {
  write_file("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THROW(write_file("/dev/full", "x"), Error);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

std::ptrdiff_t entries(const std::filesystem::path& folder) {
  return std::distance(std::filesystem::directory_iterator(folder), {});
}

TEST_F(FileInAFolder, UntilItIsThereNothingIsToBeSeen) {
  const auto place = folder_ / "later";
  {
    NewFile file(place);
    file.write(std::as_bytes(std::span("lost", 4)));
    EXPECT_EQ(entries(folder_), 0);
  }
  EXPECT_EQ(entries(folder_), 0);
  for (const char* text : {"first", "and again"}) {
    NewFile file(place);
    file.write(std::as_bytes(std::span("????? ", 6)));
    file.write(std::as_bytes(std::span(std::string_view(text))));
    file.overwrite(0, std::as_bytes(std::span("hello", 5)));
    file.commit();
    EXPECT_EQ(MappedFile(place).text(), std::string("hello ") + text);
    EXPECT_EQ(entries(folder_), 1);
  }
}

TEST_F(FileInAFolder, WhatIsWrittenBeyondTheEndStaysThere) {
  const auto place = folder_ / "pieces";
  const std::string large(3 << 20, 'x');
  const auto bytes_of = [](std::string_view text) { return std::as_bytes(std::span(text)); };
  NewFile file(place);
  file.write(bytes_of(large));
  file.overwrite(large.size() + 5, bytes_of(large));
  file.overwrite(large.size() + 2, bytes_of("yy"));
  file.write(bytes_of("z"));
  file.commit();
  const std::string whole = large + "z" + std::string(1, '\0') + "yy" + std::string(1, '\0') + large;
  EXPECT_TRUE(MappedFile(place).text() == whole);
}

TEST_F(FileInAFolder, ALibraryThatAsksForANameGetsOne) {
  const auto place = folder_ / "film";
  {
    NewFile file(place);
    std::ofstream(file.path()) << "moving";
    EXPECT_EQ(entries(folder_), 1);
    EXPECT_FALSE(std::filesystem::exists(place));
    file.commit();
  }
  EXPECT_EQ(MappedFile(place).text(), "moving");
  {
    NewFile file(folder_ / "other");
    EXPECT_TRUE(std::filesystem::exists(file.path()));
  }
  EXPECT_EQ(entries(folder_), 1);
}

TEST_F(FileInAFolder, AnInterruptionTakesThePassingNameAway) {
  const pid_t child = ::fork();
  if (child == 0) {
    NewFile file(folder_ / "film");
    std::ofstream(file.path()) << "half";
    ::kill(::getpid(), SIGINT);
    ::sleep(20);
    std::_Exit(7);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);
  EXPECT_EQ(entries(folder_), 0);
}

TEST_F(FileInAFolder, OfTwoThatMayReplaceNothingTheFirstWins) {
  for (const bool named : {false, true}) {
    const auto place = folder_ / (named ? "named" : "nameless");
    {
      NewFile first(place), second(place);
      first.write(std::as_bytes(std::span("first", 5)));
      if (named) (void)first.path(), (void)second.path();
      EXPECT_TRUE(first.commit_new());
      EXPECT_FALSE(second.commit_new());
    }
    EXPECT_EQ(MappedFile(place).text(), "first");
  }
  EXPECT_EQ(entries(folder_), 2);
}

// Who writes "-" means standard output, and would find a file of that name instead.
TEST_F(FileInAFolder, ADashIsNoPlace) {
  EXPECT_NE(refused([] { NewFile("-"); }).find("/dev/stdout"), std::string::npos);
  NewFile(folder_ / "-").commit();
  EXPECT_TRUE(std::filesystem::exists(folder_ / "-"));
}

TEST_F(FileInAFolder, AScratchFileHasNoNameAndGivesBackWhatWasWritten) {
  const NewFile file(folder_ / "x");
  ScratchFile scratch(file);
  const auto text = [&](std::uint64_t at, std::size_t count) {
    const auto bytes = scratch.take(at, count);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  EXPECT_EQ(text(0, 0), "");
  scratch.write(std::as_bytes(std::span("one two ", 8)));
  scratch.write(std::as_bytes(std::span("three", 5)));
  EXPECT_EQ(entries(folder_), 0);
  EXPECT_EQ(text(0, 13), "one two three");
  scratch.write(std::vector<std::byte>((1 << 20) - 13));
  scratch.write(std::as_bytes(std::span("four", 4)));
  EXPECT_EQ(text(1 << 20, 4), "four");
}

TEST(File, TheHashOfBlocksIsTheSameHoweverTheyCome) {
  std::string bytes(2 * BlockHash::block + 77, 'x');
  for (std::size_t i = 0; i < bytes.size(); i += 61) bytes[i] = char(i);
  const auto all = std::as_bytes(std::span(bytes));
  for (const std::size_t size :
       {std::size_t(0), std::size_t(5), BlockHash::block, BlockHash::block + 1, all.size()})
    for (const std::size_t step : {std::size_t(99'991), BlockHash::block, all.size()}) {
      BlockHash hash;
      for (std::size_t at = 0; at < size; at += step) hash.add(all.subspan(at, std::min(step, size - at)));
      EXPECT_EQ(hash.value(), block_hash(all.first(size))) << size << " in steps of " << step;
    }
  const auto before = block_hash(all);
  bytes.back() ^= 1;
  EXPECT_NE(block_hash(all), before);
}

TEST(File, HashTellsOneByte) {
  const std::string a = "abc", b = "abd";
  EXPECT_NE(hash_hex(std::as_bytes(std::span(a))), hash_hex(std::as_bytes(std::span(b))));
  EXPECT_EQ(hash_hex(std::as_bytes(std::span(a))).size(), 32u);
}

}  // namespace
}  // namespace forest
