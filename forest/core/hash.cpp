// SPDX-License-Identifier: Apache-2.0
#include "forest/core/hash.h"

#include <algorithm>
#include <new>
#if defined(__x86_64__)
#include <xxh_x86dispatch.h>  // the same sums, by the processor's widest vectors
#else
#include <xxhash.h>
#endif

#include <fmt/format.h>

#include "forest/core/parallel.h"

namespace forest {

std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

BlockHash::BlockHash()
    : state_(XXH3_createState(), [](void* s) { XXH3_freeState(static_cast<XXH3_state_t*>(s)); }) {
  if (!state_) throw std::bad_alloc();
  XXH3_64bits_reset(static_cast<XXH3_state_t*>(state_.get()));
}

void BlockHash::add(std::span<const std::byte> bytes) {
  auto* const state = static_cast<XXH3_state_t*>(state_.get());
  while (!bytes.empty()) {
    const std::size_t take = std::min(bytes.size(), block - filled_);
    XXH3_64bits_update(state, bytes.data(), take);
    bytes = bytes.subspan(take);
    filled_ += take;
    if (filled_ < block) return;
    blocks_.push_back(XXH3_64bits_digest(state));
    XXH3_64bits_reset(state);
    filled_ = 0;
  }
}

std::uint64_t BlockHash::value() const {
  std::vector<std::uint64_t> all = blocks_;
  if (filled_) all.push_back(XXH3_64bits_digest(static_cast<const XXH3_state_t*>(state_.get())));
  return hash64(std::as_bytes(std::span(all)));
}

std::uint64_t block_hash(std::span<const std::byte> bytes) {
  constexpr std::size_t block = BlockHash::block;
  std::vector<std::uint64_t> all((bytes.size() + block - 1) / block);
  parallel_for(all.size(), 1, [&](std::size_t i) {
    all[i] = hash64(bytes.subspan(i * block, std::min(block, bytes.size() - i * block)));
  });
  return hash64(std::as_bytes(std::span(all)));
}

std::string hash_hex(std::span<const std::byte> bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace forest
