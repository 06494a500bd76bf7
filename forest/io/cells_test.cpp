// SPDX-License-Identifier: Apache-2.0
#include "forest/io/cells.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/core/random.h"
#include "forest/io/cells_layout.h"
#include "forest/morphology/measure.h"

#include "tests/cells_sums.h"
#include "tests/refused.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;

/// The whole zoo again and again, each under a name of its own.
std::vector<NamedMorphology> some_cells(std::size_t count) {
  static const std::vector<Specimen> animals = zoo();
  std::vector<NamedMorphology> cells;
  for (std::size_t i = 0; i < count; ++i)
    cells.push_back({fmt::format("cell {}", i), animals[i % animals.size()].morphology});
  return cells;
}

void expect_same(const CellsFile& file, const std::vector<NamedMorphology>& cells) {
  ASSERT_EQ(file.size(), cells.size());
  for (std::size_t i = cells.size(); i-- > 0;) {  // at any place
    const Cell cell = file.read(i);
    EXPECT_EQ(cell.name, cells[i].name);
    EXPECT_EQ(cell.read.morphology, cells[i].morphology) << i;
    EXPECT_EQ(cell.read.morphology.annotations(), cells[i].morphology.annotations()) << i;
  }
}

TEST(Cells, EveryCellComesBackAtAnyPlace) {
  const Annotations about{{"grammar", "zoo"}, {"seed", "7"}};
  for (const std::size_t count : {1u, 63u, 64u, 65u, 200u}) {
    const auto cells = some_cells(count);
    const std::string bytes = write_cells(cells, about);
    const CellsFile file(bytes, "zoo.cells");
    EXPECT_EQ(file.head().about, about);
    EXPECT_EQ(file.head().blocks(), (count + 63) / 64);
    expect_same(file, cells);
    std::uint64_t segments = 0;
    double length = 0.;
    for (const NamedMorphology& cell : cells)
      segments += cell.morphology.segment_count(), length += total_length(cell.morphology);
    EXPECT_EQ(file.total().segments, segments);
    EXPECT_NEAR(file.total().length, length, 1e-9 * length);
  }
}

TEST(Cells, EveryBitOfAPointIsKept) {
  const Morphology m = zoo_parts::random_tree(5, 300);
  const Morphology back = read_cells(write_cells(m), "one").morphology;
  ASSERT_EQ(back.points().size(), m.points().size());
  EXPECT_EQ(std::memcmp(back.points().data(), m.points().data(), m.points().size_bytes()), 0);
}

TEST(Cells, OfSeveralTheFirstIsReadAndTold) {
  const std::string bytes = write_cells(some_cells(3));
  const ReadResult first = read_cells(bytes, "three");
  EXPECT_EQ(first.morphology, some_cells(1)[0].morphology);
  ASSERT_EQ(first.warnings.size(), 1u);
  EXPECT_EQ(first.warnings[0].code, "several-cells");
  EXPECT_EQ(read_all_cells(bytes, "three").size(), 3u);
  EXPECT_NE(refused<InputError>([] { read_cells(write_cells(std::span<const NamedMorphology>()), "none"); }),
            "");
}

/// Every cell is read or refused by a sentence; how many were read.
std::size_t read_what_can_be(std::string_view bytes) {
  std::size_t read = 0;
  try {
    const CellsFile file(bytes, "cells");
    for (std::size_t i = 0; i < file.size() && i < 1000; ++i) {
      try {
        read += total_length(file.read(i).read.morphology) >= 0.;
      } catch (const InputError& error) {
        EXPECT_EQ(error.file(), "cells");
      }
    }
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "cells");
    EXPECT_GT(error.sentence().size(), 10u);
  }
  return read;
}

TEST(Cells, CutAnywhereItIsNotWhole) {
  const std::string bytes = write_cells(some_cells(70), {{"seed", "1"}});
  for (std::size_t size = 0; size < bytes.size(); size += size < 300 || bytes.size() - size < 300 ? 1 : 97)
    EXPECT_EQ(read_what_can_be(std::string_view(bytes).substr(0, size)), 0u) << size;
  const std::string most = bytes.substr(0, bytes.size() - 1);
  EXPECT_NE(refused([&] { CellsFile(most, "x"); }).find("goes on where it stopped"), std::string::npos);
}

TEST(Cells, AChangedByteIsToldAndTheOtherBlocksAreRead) {
  const std::string bytes = write_cells(some_cells(200));
  for (std::size_t at = 0; at < bytes.size(); at += 1511) {
    std::string changed = bytes;
    changed[at] = char(changed[at] ^ 0x10);
    const std::size_t read = read_what_can_be(changed);
    EXPECT_TRUE(read == 0 || read == 200 - 64 || read == 200 - 8) << at << ": " << read;
  }
}

// Behind a right checksum anything may stand: it must be refused or be a neuron.
TEST(Cells, WhatIsSealedAndWrongIsRefusedOrANeuron) {
  const std::string bytes = write_cells(some_cells(20), {{"seed", "1"}});
  Random random(3, 1, 1);
  std::size_t read = 0;
  for (int turn = 0; turn < 4000; ++turn) {
    std::string changed = bytes;
    for (std::uint32_t k = 0, count = 1 + random.below(3); k < count; ++k)
      changed[random.below(std::uint32_t(changed.size()))] = char(random.below(256));
    testing::put_cells_right(changed);
    read += read_what_can_be(changed);
  }
  EXPECT_GT(read, 4000u) << "most bytes are those of points and do no harm";
}

class CellsInAFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string text(const fs::path& path) const { return std::string(MappedFile(path).text()); }
  /// Writes what is missing, in all or up to block `end`.
  void go_on(CellsWriter& writer, std::size_t end = 1000) const {
    for (std::size_t b = writer.blocks(); b < std::min(end, head_.blocks()); ++b) {
      const std::size_t first = b * cells_per_block;
      writer.add(pack_block(
          first, std::span(cells_).subspan(first, std::min(cells_per_block, cells_.size() - first))));
    }
  }

  const fs::path folder_ = fs::temp_directory_path() / ("forest_cells_test." + std::to_string(::getpid()));
  const fs::path place_ = folder_ / "a.cells", part_ = folder_ / "a.cells.part";
  const std::vector<NamedMorphology> cells_ = some_cells(200);
  const CellsHead head_{200, {{"grammar", "zoo"}, {"seed", "7"}}};
  const std::string whole_ = write_cells(cells_, head_.about);
};

TEST_F(CellsInAFolder, WrittenPieceByPieceItHasItsNameOnlyWhenWhole) {
  {
    CellsWriter writer(place_, head_);
    go_on(writer);
    EXPECT_FALSE(fs::exists(place_));
    EXPECT_EQ(writer.last_block(), CellsFile(whole_, "whole").block(3));
    writer.finish();
  }
  EXPECT_EQ(text(place_), whole_);
  EXPECT_FALSE(fs::exists(part_));
}

TEST_F(CellsInAFolder, CutOffAnywhereItGoesOnToTheSameBytes) {
  for (std::size_t size = 0; size < whole_.size();
       size += size < 20 || whole_.size() - size < 60 ? 1 : 16001) {
    write_file(part_, std::string_view(whole_).substr(0, size));
    CellsWriter writer(place_, head_);
    go_on(writer);
    writer.finish();
    ASSERT_EQ(text(place_), whole_) << size;
  }
}

TEST_F(CellsInAFolder, WhatIsDamagedIsGrownAnew) {
  for (std::size_t at = sizeof(cells_layout::Head) + 64; at < whole_.size(); at += 16001) {
    std::string changed = whole_;
    changed[at] = char(changed[at] ^ 4);
    write_file(part_, changed);
    CellsWriter writer(place_, head_);
    go_on(writer);
    writer.finish();
    ASSERT_EQ(text(place_), whole_) << at;
  }
}

TEST_F(CellsInAFolder, AnotherFilesBeginningIsLeftAlone) {
  { CellsWriter(place_, head_).add(CellsFile(whole_, "whole").block(0)); }
  const std::string before = text(part_);
  CellsHead seed = head_, more = head_;
  seed.about[1].second = "8", more.cells = 201;
  EXPECT_NE(refused([&] { CellsWriter(place_, seed); }).find("its seed is 7, not 8"), std::string::npos);
  EXPECT_NE(refused([&] { CellsWriter(place_, more); }).find("200 cells, not 201"), std::string::npos);
  EXPECT_EQ(text(part_), before);
  EXPECT_EQ(CellsWriter(place_, head_).blocks(), 1u);
  EXPECT_EQ(CellsWriter(place_, seed, true).blocks(), 0u);
  write_file(part_, "a letter to my aunt");
  EXPECT_NE(refused([&] { CellsWriter(place_, head_); }).find("holds something else"), std::string::npos);
  EXPECT_EQ(text(part_), "a letter to my aunt");
}

TEST_F(CellsInAFolder, OneProgramAtATimeWrites) {
  const CellsWriter first(place_, head_);
  EXPECT_NE(refused([&] { CellsWriter(place_, head_); }).find("another program"), std::string::npos);
}

TEST_F(CellsInAFolder, WhatCannotBeEndedIsTakenAway) {
  CellsWriter writer(place_, head_);
  go_on(writer, 2);
  writer.discard();
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace forest::io
