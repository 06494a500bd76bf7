// SPDX-License-Identifier: Apache-2.0
// What differs between two texts, line by line: E. Myers, An O(ND) difference algorithm and its variations, Algorithmica 1986.
#pragma once

#include <string>
#include <string_view>

namespace forest {

/// The unified format that `diff -u` writes and `patch` reads; empty when the texts are the same.
/// @param context  lines shown around each change
/// The fewest changes, unless they are more than 2000 lines: then whatever lies between the first and the last is one.
std::string unified_diff(std::string_view before, std::string_view after, std::string_view name_before,
                         std::string_view name_after, std::size_t context = 3);

}  // namespace forest
