// SPDX-License-Identifier: Apache-2.0
// Checksums of bytes (xxHash: XXH3). They tell damage and change, they do not protect against forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace forest {

std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed = 0);

/// The checksum of many bytes that come piece by piece: that of the checksums of their blocks of 4 MiB, so that all cores
/// can check it.
class BlockHash {
 public:
  static constexpr std::size_t block = std::size_t(4) << 20;

  BlockHash();
  void add(std::span<const std::byte> bytes);
  std::uint64_t value() const;  // of all added so far

 private:
  std::shared_ptr<void> state_;  // of the block that is not full
  std::size_t filled_ = 0;
  std::vector<std::uint64_t> blocks_;
};
std::uint64_t block_hash(std::span<const std::byte> bytes);  // the same of bytes that are there, on all cores

/// 128 bits in 32 hexadecimal digits, for the provenance of files.
std::string hash_hex(std::span<const std::byte> bytes);

}  // namespace forest
