// SPDX-License-Identifier: Apache-2.0
// The bytes of a file of cells (cells.h): numbers little-endian, structures as they lie here.
#pragma once

#include <array>
#include <cstdint>

namespace forest::io::cells_layout {

inline constexpr std::array<char, 8> magic{'B', 'F', 'C', 'E', 'L', 'L', 'S', '\n'};
inline constexpr std::uint32_t version = 1;
inline constexpr std::uint32_t block_mark = 0x4b4c4342;  // "BCLK"

struct Head {
  std::array<char, 8> magic;
  std::uint32_t version, per_block;
  std::uint64_t cells;
  std::uint64_t about_size;  // bytes behind this structure
  std::uint64_t hash;        // of the 32 bytes above, then of those bytes
};

struct Block {
  std::uint32_t mark, cells;
  std::uint64_t first;     // number of its first cell
  std::uint64_t size;      // bytes behind this structure
  std::uint64_t segments;  // of all its cells
  double length;           // of all their segments, µm
  std::uint64_t hash;      // of the 40 bytes above, then of those bytes
};

struct Foot {
  std::uint64_t index, blocks;  // where the index begins, how many entries of 8 bytes it has
  std::uint64_t segments;       // of all cells
  double length;                // of all their segments, µm: the blocks' added up in their order
  std::uint64_t hash;           // of the 32 bytes above, then of the index
  std::array<char, 8> magic;
};

static_assert(sizeof(Head) == 40 && sizeof(Block) == 48 && sizeof(Foot) == 48);

}  // namespace forest::io::cells_layout
