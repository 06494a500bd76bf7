// SPDX-License-Identifier: Apache-2.0
// A voltage as one byte, and a row of such bytes packed. Codes 0…254 lie evenly over a stated range; 255 says that there
// is no value (NaN). Rows are packed by frame of reference (Goldstein, Ramakrishnan & Shaft 1998, "Compressing relations
// and indexes"): of each group of 64 neighbours the least code, then what is above it in 0, 1, 2, 4 or 8 bits. Neighbours
// along a branch differ little, every group can be found and read alone, and unpacking is shifts that compilers turn into
// vector instructions.
//
//   row:  low, bits of each group (2 bytes a group) | 8 · bits bytes of each group
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace forest::reports {

using Code = std::uint8_t;
inline constexpr Code no_value = 255;
inline constexpr std::size_t group_size = 64;

struct Range {
  float low = -100.f, high = 50.f;  // mV

  float step() const { return (high - low) / 254.f; }
  /// The most by which a value inside the range is changed: 0.2953 mV for −100…+50 mV.
  float error() const { return .5f * step(); }
  /// After the point, with which neighbouring codes differ in their last two: 3 for −100…+50 mV.
  int decimals() const;
  /// NaN for no_value.
  float value(Code code) const;
  /// Values beyond the range become its nearest end; what is no number, no_value.
  void encode(std::span<const float> values, Code* out) const;

  bool operator==(const Range&) const = default;
};

/// Appends the packed row to `out`.
void pack_row(std::span<const Code> codes, std::vector<std::byte>& out);

/// Whether these bytes are a packed row of `count` codes, no more and no less.
bool is_row(std::span<const std::byte> row, std::size_t count);

/// Codes [first, first + out.size()) of a row of `count`; is_row must hold.
void unpack(std::span<const std::byte> row, std::size_t count, std::size_t first, std::span<Code> out);

/// In place: each code becomes the greater of both; no_value gives way.
void raise(std::span<Code> codes, std::span<const Code> others);

}  // namespace forest::reports
