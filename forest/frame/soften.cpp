// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/soften.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"

namespace forest::frame {
namespace {

/// A row of bytes of which each gives a share to those at the same place of `before` and `after`.
void mix(const std::uint8_t* before, const std::uint8_t* at, const std::uint8_t* after, std::size_t count,
         std::uint16_t share, std::uint8_t* out) {
  const auto own = std::uint16_t(256 - 2 * share);
  for (std::size_t i = 0; i < count; ++i) {
    const auto around = std::uint16_t(share * std::uint16_t(before[i] + after[i]));
    out[i] = std::uint8_t(std::uint16_t(own * at[i] + around + 128) >> 8);
  }
}

}  // namespace

void soften(Image& image, float share) {
  const auto part = std::uint16_t(std::lround(256.f * std::clamp(share, 0.f, .25f)));
  const std::size_t row = std::size_t(4) * image.width, rows = image.height;
  if (part == 0 || image.width < 2 || rows == 0) return;
  std::vector<std::uint8_t> across(image.pixels.size());
  constexpr std::size_t together = 32;
  parallel_ranges(rows, together, [&](std::size_t from, std::size_t to) {
    for (std::size_t y = from; y < to; ++y) {
      const std::uint8_t* in = &image.pixels[y * row];
      std::uint8_t* out = &across[y * row];
      mix(in, in + 4, in + 8, row - 8, part, out + 4);
      mix(in, in, in + 4, 4, part, out);
      mix(in + row - 8, in + row - 4, in + row - 4, 4, part, out + row - 4);
    }
  });
  parallel_ranges(rows, together, [&](std::size_t from, std::size_t to) {
    for (std::size_t y = from; y < to; ++y)
      mix(&across[(y ? y - 1 : y) * row], &across[y * row], &across[std::min(y + 1, rows - 1) * row], row,
          part, &image.pixels[y * row]);
  });
}

}  // namespace forest::frame
