// SPDX-License-Identifier: Apache-2.0
// Pictures to and from PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace forest::io {

/// @param pixels  rows from the top, four bytes a pixel: red, green, blue (sRGB), opacity; width × height × 4 bytes
/// The file is written whole or not at all; throws Error. The same pixels give the same bytes.
void write_png(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
               std::span<const std::uint8_t> pixels);

struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  // as above
};

/// Throws InputError when the file is no picture or is damaged.
Picture read_png(const std::filesystem::path& path);

}  // namespace forest::io
