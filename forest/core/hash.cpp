// SPDX-License-Identifier: Apache-2.0
#include "forest/core/hash.h"

#include <algorithm>
#include <new>
#if defined(__x86_64__)
#include <immintrin.h>
#include <xxh_x86dispatch.h>  // the same sums, by the processor's widest vectors
#else
#include <xxhash.h>
#endif

#include <fmt/format.h>

#include "forest/core/parallel.h"

namespace forest {
namespace {

// While it lives the library may use its widest vectors. Those of xxHash 0.8.1 leave the upper halves of the registers in use,
// and from then on each instruction that leaves these as they are, as all of SSE do, waits for the register's last one: what the
// thread does next is up to four times slower.
class Wide {
 public:
  Wide() = default;
  Wide(const Wide&) = delete;
  Wide& operator=(const Wide&) = delete;
#if defined(__x86_64__)
  ~Wide() {
    if (__builtin_cpu_supports("avx")) release();
  }

 private:
  [[gnu::target("avx")]] static void release() { _mm256_zeroupper(); }
#else
  ~Wide() {}
#endif
};

}  // namespace

std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed) {
  const Wide wide;
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

BlockHash::BlockHash()
    : state_(XXH3_createState(), [](void* s) { XXH3_freeState(static_cast<XXH3_state_t*>(s)); }) {
  if (!state_) throw std::bad_alloc();
  XXH3_64bits_reset(static_cast<XXH3_state_t*>(state_.get()));
}

void BlockHash::add(std::span<const std::byte> bytes) {
  const Wide wide;
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
  const Wide wide;
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
  const Wide wide;
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace forest
