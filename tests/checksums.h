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

/// Those of the parts that lie within the file.
inline void put_parts_right(auto& table, auto& element_sizes, std::span<const std::byte> bytes) {
  for (std::size_t p = 0; p < table.size(); ++p) {
    auto& e = table[p];
    if (e.offset <= bytes.size() && e.count <= (bytes.size() - e.offset) / element_sizes[p])
      e.hash = block_hash(bytes.subspan(e.offset, e.count * element_sizes[p]));
  }
}

inline void put_forest_right(std::vector<std::byte>& bytes) {
  namespace layout = scene::layout;
  layout::Header header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  put_parts_right(header.table, layout::element_sizes, bytes);
  header.file_size = bytes.size();
  header.table_hash = hash64(std::as_bytes(std::span(header.table)), header.file_size);
  std::memcpy(bytes.data(), &header, sizeof header);
}

inline void put_synapses_right(std::vector<std::byte>& bytes) {
  namespace layout = scene::synapses_layout;
  layout::Header header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  put_parts_right(header.table, layout::element_sizes, bytes);
  header.file_size = bytes.size();
  header.hash = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(layout::Header, hash)));
  std::memcpy(bytes.data(), &header, sizeof header);
}

}  // namespace forest::testing
