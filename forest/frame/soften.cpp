// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/soften.h"

#include <algorithm>
#include <cmath>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"

namespace forest::frame {
namespace {

/// A row of bytes of which each gives a share to those at the same place of `before` and `after`.
FOREST_CLONES void mix(const std::uint8_t* before, const std::uint8_t* at, const std::uint8_t* after,
                       std::size_t count, std::uint16_t share, std::uint8_t* __restrict out) {
  const auto own = std::uint16_t(256 - 2 * share);
  for (std::size_t i = 0; i < count; ++i) {
    const auto around = std::uint16_t(share * std::uint16_t(before[i] + after[i]));
    out[i] = std::uint8_t(std::uint16_t(own * at[i] + around + 128) >> 8);
  }
}

void mix_across(const std::uint8_t* in, std::size_t row, std::uint16_t share, std::uint8_t* out) {
  mix(in, in + 4, in + 8, row - 8, share, out + 4);
  mix(in, in, in + 4, 4, share, out);
  mix(in + row - 8, in + row - 4, in + row - 4, 4, share, out + row - 4);
}

}  // namespace

void soften(const Image& from, float share, Image& to) {
  const auto part = std::uint16_t(std::lround(256.f * std::clamp(share, 0.f, .25f)));
  const std::size_t row = std::size_t(4) * from.width, rows = from.height;
  if (part == 0 || from.width < 2 || rows == 0) {
    to = from;
    return;
  }
  to.width = from.width, to.height = from.height, to.covered = from.covered;
  to.pixels.resize(from.pixels.size());
  constexpr std::size_t together = 32;
  parallel_ranges(rows, together, [&](std::size_t begin, std::size_t end) {
    // Three rows whose pixels have their shares of their neighbours already: they stay in the first cache.
    std::vector<std::uint8_t> across(3 * row);
    const auto at = [&](std::size_t y) { return &across[y % 3 * row]; };
    const auto mix_row = [&](std::size_t y) { mix_across(&from.pixels[y * row], row, part, at(y)); };
    if (begin > 0) mix_row(begin - 1);
    mix_row(begin);
    for (std::size_t y = begin; y < end; ++y) {
      const std::size_t above = y ? y - 1 : y, below = std::min(y + 1, rows - 1);
      if (below > y) mix_row(below);
      mix(at(above), at(y), at(below), row, part, &to.pixels[y * row]);
    }
  });
}

}  // namespace forest::frame
