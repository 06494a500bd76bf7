// SPDX-License-Identifier: Apache-2.0
// The bytes of an activity file, for what packs one and what opens one (docs/reports/activity.md).
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/hash.h"
#include "forest/reports/activity.h"

namespace forest::reports::file {

static_assert(std::endian::native == std::endian::little, "the activity file is little-endian");

inline constexpr std::array<char, 8> magic{'B', 'F', 'A', 'C', 'T', 'I', 'V', '\n'};
inline constexpr std::uint32_t version = 1;
inline constexpr std::size_t alignment = 64;

// A tile holds some columns of 64 steps: their rows, then those of every coarser time level.
inline constexpr std::size_t tile_steps = 64;
inline constexpr std::array<std::size_t, time_level_count> level_rows{64, 16, 4, 1};
inline constexpr std::array<std::size_t, time_level_count> level_slot{0, 64, 80, 84};
inline constexpr std::size_t slots = 85;
static_assert(level_rows[0] == tile_steps && level_slot.back() + level_rows.back() == slots);

struct Head {
  std::array<char, 8> magic;
  std::uint32_t version, zero;
};

struct Tile {
  std::uint64_t offset, size;
};
struct Slot {
  std::uint32_t size, hash;  // of one packed row
};
struct FileRow {
  std::uint64_t node_id;
  std::uint32_t population, instance, layout, zero;
};
struct FileLayout {
  std::uint32_t morphology, soma;
  std::uint64_t compartments, sections, branches;  // how many
};
static_assert(sizeof(FileRow) == 24 && sizeof(FileLayout) == 32 && sizeof(Compartment) == 12 &&
              sizeof(SectionRun) == 12 && sizeof(Spike) == 16);

// In the order of the file, behind the tiles.
enum Part : std::uint32_t {
  tile_part,
  slot_part,
  column_part,  // the first neuron of every column of tiles, level after level
  row_part,
  layout_part,
  compartment_part,
  section_part,
  branch_part,
  spike_part,
  text_part,
  part_count
};
inline constexpr std::array<std::uint32_t, part_count> element_sizes{
    sizeof(Tile),        sizeof(Slot),       4, sizeof(FileRow), sizeof(FileLayout),
    sizeof(Compartment), sizeof(SectionRun), 4, sizeof(Spike),   1};

struct Entry {
  std::uint32_t part, element_size;
  std::uint64_t offset, count, hash;
};
struct Foot {  // the last bytes, as sizes are known only when all is packed
  std::array<Entry, part_count> table;
  std::uint64_t file_size, table_hash;
  std::array<char, 8> magic;
};
static_assert(sizeof(Foot) == 32 * part_count + 24);

inline std::uint64_t values_of(const FileLayout& layout, std::size_t level) {
  return level == 0 ? layout.compartments : level == 1 ? layout.sections : level == 2 ? layout.branches : 1;
}

/// The columns of tiles of one level: runs of neurons. Those of coarser levels are unions of the finest ones.
struct Columns {
  std::vector<std::uint32_t> first;  // neuron; one more than columns
  std::vector<std::uint64_t> value;  // the first value of each; one more, too
  std::size_t size() const { return first.size() - 1; }
};

inline std::size_t rows_in(std::size_t steps, std::size_t time_level) {
  const std::size_t factor = std::size_t(1) << (2 * time_level);
  return (steps + factor - 1) / factor;
}

inline std::uint32_t row_hash(std::span<const std::byte> row, std::uint64_t tile, std::size_t slot) {
  return std::uint32_t(hash64(row, tile * slots + slot));
}

}  // namespace forest::reports::file
