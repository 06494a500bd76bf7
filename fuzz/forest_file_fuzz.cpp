// SPDX-License-Identifier: Apache-2.0
// Any bytes are refused with a sentence or are a forest that can be seen and picked. Checksums are put right first, so
// that what lies behind them is reached.
#include <cstdint>
#include <cstring>
#include <vector>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/scene/cut.h"
#include "forest/scene/pick.h"
#include "forest/scene/view.h"

namespace {

// docs/scene/forest_file.md: magic, version, parts, size, checksum of the table; then the table.
constexpr std::size_t table_at = 32, entry_bytes = 32;

void put(std::vector<std::byte>& bytes, std::size_t at, std::uint64_t value) {
  std::memcpy(&bytes[at], &value, sizeof value);
}
std::uint64_t value_at(const std::vector<std::byte>& bytes, std::size_t at) {
  std::uint64_t value;
  std::memcpy(&value, &bytes[at], sizeof value);
  return value;
}

void put_checksums_right(std::vector<std::byte>& bytes) {
  constexpr std::size_t parts = 9, table_bytes = parts * entry_bytes;
  if (bytes.size() < table_at + table_bytes) return;
  const std::span<const std::byte> all = bytes;
  for (std::size_t p = 0; p < parts; ++p) {
    const std::size_t entry = table_at + p * entry_bytes;
    std::uint32_t element;
    std::memcpy(&element, &bytes[entry + 4], sizeof element);
    const std::uint64_t offset = value_at(bytes, entry + 8), count = value_at(bytes, entry + 16);
    if (element && offset <= bytes.size() && count <= (bytes.size() - offset) / element)
      put(bytes, entry + 24, forest::hash64(all.subspan(offset, count * element)));
  }
  put(bytes, 16, bytes.size());
  put(bytes, 24, forest::hash64(all.subspan(table_at, table_bytes), bytes.size()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  put_checksums_right(bytes);
  try {
    const scene::Forest forest = scene::Forest::from_bytes(std::move(bytes), "input");
    scene::View view = scene::overview(forest);
    const frame::Viewport viewport{640.f, 360.f};
    for (const float error : {.1f, 1.f, 50.f}) {
      view.detail.error = error;
      (void)scene::choose(forest, scene::Eye(view.camera, viewport, view.detail), viewport);
    }
    const auto pick = scene::pick(forest, view.camera, viewport, {320.f, 180.f});
    if (pick) (void)scene::subarbor(forest, pick->instance, pick->section);
  } catch (const InputError&) {
  }
  return 0;
}
