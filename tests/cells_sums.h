// SPDX-License-Identifier: Apache-2.0
// Puts the checksums of a file of cells right after somebody changed it, so that what lies behind them is reached.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>

#include "forest/core/hash.h"
#include "forest/io/cells_layout.h"

namespace forest::testing {

namespace detail {
template <class T>
void put_cells_part_right(std::string& bytes, std::size_t at, std::size_t body, std::size_t size) {
  T head;
  std::memcpy(&head, bytes.data() + at, sizeof head);
  const auto hash = [](const void* data, std::size_t count, std::uint64_t seed) {
    return hash64({static_cast<const std::byte*>(data), count}, seed);
  };
  head.hash = hash(bytes.data() + body, size, hash(&head, offsetof(T, hash), 0));
  std::memcpy(bytes.data() + at, &head, sizeof head);
}
}  // namespace detail

/// As far as its sizes lie within the bytes.
inline void put_cells_right(std::string& bytes) {
  using namespace io::cells_layout;
  if (bytes.size() < sizeof(Head) + sizeof(Foot)) return;
  Head head;
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.about_size > bytes.size() - sizeof head - sizeof(Foot)) return;
  detail::put_cells_part_right<Head>(bytes, 0, sizeof head, std::size_t(head.about_size));
  std::size_t at = sizeof head + std::size_t(head.about_size);
  const std::size_t end = bytes.size() - sizeof(Foot);
  for (Block block; end - at >= sizeof block; at += sizeof block + std::size_t(block.size)) {
    std::memcpy(&block, bytes.data() + at, sizeof block);
    if (block.mark != block_mark || block.size > end - at - sizeof block) break;
    detail::put_cells_part_right<Block>(bytes, at, at + sizeof block, std::size_t(block.size));
  }
  Foot foot;
  std::memcpy(&foot, bytes.data() + end, sizeof foot);
  if (foot.index <= end)
    detail::put_cells_part_right<Foot>(bytes, end, std::size_t(foot.index), end - std::size_t(foot.index));
}

}  // namespace forest::testing
