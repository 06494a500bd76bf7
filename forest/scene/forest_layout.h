// SPDX-License-Identifier: Apache-2.0
// How a forest file lies on the disk: what forest_pack.cpp writes and forest.cpp reads (docs/scene/forest_file.md).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "forest/scene/forest.h"

namespace forest::scene::layout {

static_assert(std::endian::native == std::endian::little,
              "the forest file is little-endian, as the graphics card is");

inline constexpr std::array<char, 8> magic{'B', 'F', 'O', 'R', 'E', 'S', 'T', '\n'};
inline constexpr std::uint32_t version = 7;
inline constexpr std::size_t alignment = 64;

// In the order of the file.
enum Part : std::uint32_t {
  segments,
  instances,
  clusters,
  neurons,
  section_of_segment,
  sections,
  types,
  layers,
  text,
  places,
  bricks,
  owners,
  attributes,
  part_count
};
inline constexpr std::array<std::uint32_t, part_count> element_sizes{sizeof(frame::Segment),
                                                                     sizeof(frame::Instance),
                                                                     sizeof(Cluster),
                                                                     sizeof(Neuron),
                                                                     4,
                                                                     sizeof(SectionFacts),
                                                                     4,
                                                                     4,
                                                                     1,
                                                                     sizeof(reports::Place),
                                                                     sizeof(Brick),
                                                                     sizeof(frame::Owner),
                                                                     4};

struct Entry {
  std::uint32_t part, element_size;
  std::uint64_t offset, count;
  std::uint64_t hash;  // BlockHash
};
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version, parts;
  std::uint64_t file_size, table_hash;
  std::array<Entry, part_count> table;
};
static_assert(sizeof(Entry) == 32 && sizeof(Header) == 32 + 32 * part_count);

}  // namespace forest::scene::layout
