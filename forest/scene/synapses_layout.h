// SPDX-License-Identifier: Apache-2.0
// How a file of synapses lies on the disk: what synapses.cpp writes and reads (docs/scene/synapses.md).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "forest/scene/synapses.h"

namespace forest::scene::synapses_layout {

static_assert(std::endian::native == std::endian::little);

inline constexpr std::array<char, 8> magic{'B', 'F', 'S', 'Y', 'N', 'A', 'P', '\n'};
inline constexpr std::uint32_t version = 1;
inline constexpr std::size_t alignment = 64;

// In the order of the file.
enum FilePart : std::uint32_t { synapses, bundles, samples, text, part_count };
inline constexpr std::array<std::uint32_t, part_count> element_sizes{sizeof(Synapse), sizeof(Bundle), 4, 1};

struct Entry {
  std::uint64_t offset, count;
  std::uint64_t hash;  // BlockHash
};
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version, zero;
  std::uint64_t file_size, forest;  // forest: what it was made for
  std::array<Entry, part_count> table;
  std::uint64_t hash;  // of all before
};

}  // namespace forest::scene::synapses_layout
