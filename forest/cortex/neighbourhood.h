// SPDX-License-Identifier: Apache-2.0
// Which of an element's sixteen curves lie where, and which elements share them. Private to this room.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "forest/cortex/elements.h"

namespace forest::cortex {

/// Where the curve stands that is the i-th along u and the j-th along v.
constexpr std::size_t slot(int i, int j) { return std::size_t(i) + 4 * std::size_t(j); }
/// The slots of the four sides, each from its first corner to its last.
inline constexpr std::array<std::array<std::size_t, 4>, 4> sides{
    {{slot(0, 0), slot(1, 0), slot(2, 0), slot(3, 0)},
     {slot(0, 3), slot(1, 3), slot(2, 3), slot(3, 3)},
     {slot(0, 0), slot(0, 1), slot(0, 2), slot(0, 3)},
     {slot(3, 0), slot(3, 1), slot(3, 2), slot(3, 3)}}};

/// The face of an element at a depth of its curves.
Patch face_of(const Elements& elements, std::size_t element, std::size_t depth);

/// The elements of every curve, as one list.
class Stars {
 public:
  explicit Stars(const Elements& elements);
  std::span<const std::uint32_t> of(std::uint32_t curve) const {
    return std::span(list_).subspan(starts_[curve], starts_[curve + 1] - starts_[curve]);
  }

 private:
  std::vector<std::uint32_t> starts_, list_;
};

/// Some elements, with all that share a corner with them, so many times.
std::vector<std::uint32_t> widened(const Elements& elements, const Stars& stars,
                                   std::span<const std::uint32_t> list, int rings = 1);

/// Of every corner whether it belongs to a side that only one element has.
std::vector<std::uint8_t> by_the_wall(const Elements& elements);

/// A cubic through four places swings widely where they zigzag: what the two inner ones deviate from the straight way in
/// opposite directions comes out four and a half times as large in its control points, three times as much as what they deviate
/// alike. A third of it is kept, which makes no difference on a smooth surface and some µm at a crease.
void calm(const Place& first, Place& second, Place& third, const Place& last);

}  // namespace forest::cortex
