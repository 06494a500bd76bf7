// SPDX-License-Identifier: Apache-2.0
// Numbers as words of files and command lines: a point is a point in every country, which is not so of std::strtod once
// a program has taken the language of its user.
#pragma once

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace forest {

/// The number that the word is, wholly: with a sign or none, of fractions in decimal notation or the words nan and inf. A
/// fraction beyond its type is 0 or an infinity, as IEEE 754 rounds it; a whole number beyond its type is none.
template <class Number>
std::optional<Number> number_of(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  Number value{};
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>)
    if (error ==
        std::errc::result_out_of_range) {  // which does not tell whether it is too large or too small
      double wide = 0.;
      const bool small = std::from_chars(word.data(), end, wide).ec == std::errc()
                             ? std::abs(wide) < 1.
                             : word.find("e-") != word.npos || word.find("E-") != word.npos;
      return std::copysign(small ? Number(0) : std::numeric_limits<Number>::infinity(),
                           word.starts_with('-') ? Number(-1) : Number(1));
    }
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

}  // namespace forest
