// SPDX-License-Identifier: Apache-2.0
#include "forest/io/new_folder.h"

#include <chrono>
#include <fstream>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/file.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;

class Folder : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(above_);
    fs::create_directories(above_);
  }
  void TearDown() override { fs::remove_all(above_); }
  // As a program that was killed some minutes ago leaves it.
  void leave(const std::string& name, int minutes = 5) const {
    fs::create_directories(above_ / name);
    std::ofstream(above_ / name / "nodes.h5") << "half";
    fs::last_write_time(above_ / name, fs::file_time_type::clock::now() - std::chrono::minutes(minutes));
  }
  std::set<std::string> entries() const {
    std::set<std::string> names;
    for (const auto& e : fs::directory_iterator(above_)) names.insert(e.path().filename().string());
    return names;
  }

  fs::path above_ = fs::temp_directory_path() / "new_folder_test";
};

TEST_F(Folder, IsThereWholeOrNotAtAll) {
  {
    const NewFolder none(above_ / "circuit");
    none.write("a", "1");
  }
  EXPECT_TRUE(entries().empty());
  for (const char* text : {"1", "2"}) {
    NewFolder files(above_ / "circuit/");
    files.write("a", text);
    files.commit();
  }
  EXPECT_EQ(entries(), std::set<std::string>{"circuit"});
  EXPECT_EQ(MappedFile(above_ / "circuit/a").text(), "2");
}

TEST_F(Folder, WhatAKilledProgramLeftIsSweptAwayAndNothingElse) {
  leave(".circuit.unfinished-a1B2c3");
  leave(".circuit.unfinished-Fresh0", 0);
  leave(".circuit.unfinished-notes");
  leave(".other.unfinished-a1B2c3");
  leave("circuit.backup");
  {
    NewFolder held(above_ / "circuit");
    fs::last_write_time(held.path(), fs::file_time_type::clock::now() - std::chrono::hours(1));
    NewFolder other(above_ / "circuit");
    other.write("a", "1");
    other.commit();
    EXPECT_TRUE(fs::exists(held.path()));
  }
  EXPECT_EQ(entries(), (std::set<std::string>{"circuit", "circuit.backup", ".circuit.unfinished-Fresh0",
                                              ".circuit.unfinished-notes", ".other.unfinished-a1B2c3"}));
}

}  // namespace
}  // namespace forest::io
