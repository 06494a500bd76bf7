// SPDX-License-Identifier: Apache-2.0
// Sister cells, of one slice or one animal, resemble one another: they are dealt together, or chance looks narrower than it
// is and a classifier recognises the slice instead of the kind.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "forest/core/random.h"

namespace forest::statistics {

/// Numbers from 0, the same for equal words. None for none.
std::vector<std::uint32_t> numbered(std::span<const std::string> words);

/// 0 … count - 1 in a random order, those of one slice one after the other.
/// @param slices  a number for each; none when each is on its own
std::vector<std::uint32_t> dealt(std::size_t count, std::span<const std::uint32_t> slices, Random& random);

}  // namespace forest::statistics
