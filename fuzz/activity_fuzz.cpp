// SPDX-License-Identifier: Apache-2.0
// Any bytes are refused with a sentence or are an activity file of which everything can be asked. Checksums of the parts are put
// right first, so that what lies behind them is reached; those of the values are not, but the words that say how they are packed
// are tried alone.
#include <cstdint>
#include <cstring>
#include <vector>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/reports/activity.h"

namespace {

// docs/reports/activity.md: at the end a table, size of the file, checksum of the table, magic.
constexpr std::size_t parts = 10, entry_bytes = 32, foot_bytes = parts * entry_bytes + 24;

void put_checksums_right(std::vector<std::byte>& bytes) {
  if (bytes.size() < foot_bytes) return;
  const std::size_t table = bytes.size() - foot_bytes;
  const std::span<const std::byte> all = bytes;
  const auto value_at = [&](std::size_t at) {
    std::uint64_t value;
    std::memcpy(&value, &bytes[at], sizeof value);
    return value;
  };
  const auto put = [&](std::size_t at, std::uint64_t value) {
    std::memcpy(&bytes[at], &value, sizeof value);
  };
  for (std::size_t p = 0; p < parts; ++p) {
    const std::size_t entry = table + p * entry_bytes;
    std::uint32_t element;
    std::memcpy(&element, &bytes[entry + 4], sizeof element);
    const std::uint64_t offset = value_at(entry + 8), count = value_at(entry + 16);
    if (element && offset <= bytes.size() && count <= (bytes.size() - offset) / element)
      put(entry + 24, forest::hash64(all.subspan(offset, count * element)));
  }
  put(table + parts * entry_bytes, bytes.size());
  put(table + parts * entry_bytes + 8, forest::hash64(all.subspan(table, parts * entry_bytes), bytes.size()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forest;
  using namespace forest::reports;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  if (size > 2) {
    const std::size_t count = std::size_t(data[0]) + 1;
    const auto row = std::span<const std::byte>(bytes).subspan(1);
    std::vector<Code> codes(count - count / 3);
    if (is_row(row, count)) unpack(row, count, count / 3, codes);
  }
  put_checksums_right(bytes);
  try {
    const Activity activity = Activity::from_bytes(std::move(bytes), "input");
    if (activity.facts().steps > 1000) return 0;
    (void)activity.row_of_instance(activity.rows().front().instance);
    (void)activity.spikes(0., 1.);
    for (std::uint32_t i = 0; i < activity.layout_count(); ++i)
      (void)activity.layout(i).at(soma_run, .5f), (void)activity.layout(i).runs(100);
    for (const Level level :
         {Level::compartment, Level::section, Level::branch, Level::neuron, Level::soma}) {
      std::vector<Code> codes(activity.count(0, level));
      try {
        activity.gather(std::vector<Wanted>{{0, level}}, 0, 0, codes);
        (void)activity.history(level, activity.width(level) - 1);
      } catch (const InputError&) {
      }
    }
    activity.verify();
    (void)activity.raster();
  } catch (const InputError&) {
  }
  return 0;
}
