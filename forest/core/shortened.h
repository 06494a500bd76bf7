// SPDX-License-Identifier: Apache-2.0
// Names that are too long for their place.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest {

/// How many characters of UTF-8.
std::size_t characters(std::string_view text);
/// At most `most` characters: the middle makes room for an ellipsis, since names begin and end with what tells them apart.
std::string shortened(std::string_view text, std::size_t most);

}  // namespace forest
