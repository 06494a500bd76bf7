// SPDX-License-Identifier: Apache-2.0
// Checksums of bytes (xxHash: XXH3). They tell damage and change, they do not protect against forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace forest {

std::uint64_t hash64(std::span<const std::byte> bytes, std::uint64_t seed = 0);

/// 128 bits in 32 hexadecimal digits, for the provenance of files.
std::string hash_hex(std::span<const std::byte> bytes);

}  // namespace forest
