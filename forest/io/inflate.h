// SPDX-License-Identifier: Apache-2.0
// Deflated bytes, with zlib's or gzip's head.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest::io {

/// Unpacked; of gzip all members (RFC 1952, 2.2). Zeros may follow. Memory grows with what comes, so that a size that lies
/// costs nothing. Throws InputError when the bytes are broken, cut off, followed by others, or more than `most` when unpacked.
std::string inflated(std::string_view bytes, std::size_t most, const std::string& name);

}  // namespace forest::io
