// SPDX-License-Identifier: Apache-2.0
#include "forest/core/hash.h"

#include <algorithm>
#include <functional>

#include <gtest/gtest.h>
#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#endif

namespace forest {
namespace {

std::vector<std::byte> some_bytes(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = std::byte(i * 2654435761u >> 13);
  return bytes;
}

TEST(BlockHash, IsTheSameInPiecesOfAnySize) {
  const auto bytes = some_bytes(2 * BlockHash::block + 12345);
  for (const std::size_t piece : {std::size_t(4096), BlockHash::block, BlockHash::block + 1, bytes.size()}) {
    BlockHash hash;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      hash.add(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)));
    EXPECT_EQ(hash.value(), block_hash(bytes));
  }
}

TEST(BlockHash, ChangesWithEachBlock) {
  auto bytes = some_bytes(2 * BlockHash::block + 7);
  const std::uint64_t before = block_hash(bytes);
  for (const std::size_t at : {std::size_t(0), BlockHash::block, 2 * BlockHash::block, bytes.size() - 1}) {
    bytes[at] ^= std::byte(1);
    EXPECT_NE(block_hash(bytes), before);
    bytes[at] ^= std::byte(1);
  }
  EXPECT_EQ(block_hash(bytes), before);
}

#if defined(__x86_64__)
// Which parts of the processor's state differ from those of a fresh one (Intel SDM 1, 13.6: XGETBV of 1): bits 2 and 6 are the
// upper halves of the sixteen registers that SSE uses, too.
std::uint32_t wide_in_use() {
  std::uint32_t low, high;
  asm volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  return low & 0x44;
}
[[gnu::target("avx")]] void release() { _mm256_zeroupper(); }
[[gnu::target("avx")]] void use() { asm volatile("vcmpeqps %%ymm0, %%ymm0, %%ymm0" ::: "xmm0"); }

TEST(Hashes, LeaveTheUpperHalvesOfRegistersFree) {
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  if (!__builtin_cpu_supports("avx") || !__get_cpuid_count(13, 1, &a, &b, &c, &d) || !(a & 4))
    GTEST_SKIP() << "this processor does not tell";
  use();
  const std::uint32_t used = wide_in_use();
  release();
  if (!used || wide_in_use()) GTEST_SKIP() << "this processor does not tell";
  const auto bytes = some_bytes(100000);
  std::uint64_t sum = 0;
  const std::function<void()> hashes[]{[&] { sum += hash64(bytes); }, [&] { sum += block_hash(bytes); },
                                       [&] { sum += hash_hex(bytes).size(); },
                                       [&] {
                                         BlockHash hash;
                                         hash.add(bytes);
                                         EXPECT_EQ(wide_in_use(), 0u);
                                         sum += hash.value();
                                       }};
  for (const auto& hash : hashes) {
    hash();
    EXPECT_EQ(wide_in_use(), 0u);
  }
  EXPECT_NE(sum, 0u);
}
#endif

}  // namespace
}  // namespace forest
