// SPDX-License-Identifier: Apache-2.0
// Puts the checksums of a file right after somebody changed it, so that what lies behind them is reached.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "forest/core/hash.h"
#include "forest/scene/forest_layout.h"
#include "forest/scene/synapses_layout.h"

namespace forest::testing {

/// The file's size and those of its parts that lie within it; `seal(header)` puts that of the table right.
template <class Header>
void put_right(std::vector<std::byte>& bytes, std::span<const std::uint32_t> element_sizes, auto&& seal) {
  Header header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::span<const std::byte> all = bytes;
  for (std::size_t p = 0; p < header.table.size(); ++p) {
    auto& e = header.table[p];
    if (e.offset <= all.size() && e.count <= (all.size() - e.offset) / element_sizes[p])
      e.hash = block_hash(all.subspan(e.offset, e.count * element_sizes[p]));
  }
  header.file_size = bytes.size();
  seal(header);
  std::memcpy(bytes.data(), &header, sizeof header);
}

inline void put_forest_right(std::vector<std::byte>& bytes) {
  using scene::layout::Header;
  put_right<Header>(bytes, scene::layout::element_sizes, [](Header& header) {
    header.table_hash = hash64(std::as_bytes(std::span(header.table)), header.file_size);
  });
}

inline void put_synapses_right(std::vector<std::byte>& bytes) {
  using scene::synapses_layout::Header;
  put_right<Header>(bytes, scene::synapses_layout::element_sizes, [](Header& header) {
    header.hash = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, hash)));
  });
}

}  // namespace forest::testing
