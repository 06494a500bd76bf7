// SPDX-License-Identifier: Apache-2.0
// Numbers in text, as fast as a core reads them. Reading: decimal digits are gathered in an integer and
// divided by a power of ten, which is exact to the last bit while the integer is below 2^53 and the power at
// most 10^22 (Clinger 1990, "How to read floating point numbers accurately"); anything else goes to
// std::from_chars. Writing: the shortest digits that read back to the same bits.
#pragma once

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace forest::io {

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
inline bool is_line_end(char c) { return c == '\n' || c == '\r'; }

/// What may follow a number where columns are set apart by blanks.
inline bool ends_number(char c) { return is_blank(c) || is_line_end(c); }

// The readers below need no end: the text must be followed by a character that belongs to no number (a line
// end). They return false, and leave `p` where it was, when there is no such number or it does not end in a
// blank or line end (read_real: in what `ends` says).

/// -?[0-9]{1,18}
inline bool read_integer(const char*& p, std::int64_t& value) {
  const char* q = p;
  const bool minus = *q == '-';
  q += minus;
  const char* const first = q;
  std::int64_t sum = 0;
  while (is_digit(*q) && q - first < 18) sum = 10 * sum + (*q++ - '0');
  if (q == first || !ends_number(*q)) return false;
  value = minus ? -sum : sum;
  p = q;
  return true;
}

/// Decimal notation with optional sign and exponent, rounded to the nearest float. Too large gives an
/// infinity, too small a zero. The words nan and inf are not read. `exponent` is set when there is one.
template <bool (*ends)(char) = ends_number>
bool read_real(const char*& p, float& value, bool& exponent) {
  static constexpr std::array<double, 23> powers{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                 1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const char* q = p;
  const bool minus = *q == '-';
  q += minus || *q == '+';
  const char* const first = q;
  std::uint64_t digits = 0;
  while (is_digit(*q)) digits = 10 * digits + static_cast<std::uint64_t>(*q++ - '0');
  std::int64_t count = q - first, fraction = 0;
  if (*q == '.') {
    const char* const dot = ++q;
    while (is_digit(*q)) digits = 10 * digits + static_cast<std::uint64_t>(*q++ - '0');
    fraction = q - dot;
    count += fraction;
  }
  if (count == 0) return false;
  if (count <= 18 && digits < (1ull << 53) && ends(*q)) [[likely]] {
    const double exact = static_cast<double>(digits) / powers[static_cast<std::size_t>(fraction)];
    // A double half way between two floats may itself have been rounded: then the long way decides.
    if ((std::bit_cast<std::uint64_t>(exact) & 0x1fffffff) != 0x10000000) [[likely]] {
      value = static_cast<float>(minus ? -exact : exact);
      p = q;
      return true;
    }
  }
  for (; !ends(*q); ++q) exponent = exponent || *q == 'e' || *q == 'E';
  float parsed = 0.f;
  const auto [end, error] = std::from_chars(first, q, parsed);
  if (error == std::errc::invalid_argument || end != q) return false;
  if (error == std::errc::result_out_of_range) {  // tells not whether it is too large or too small
    double wide = 0.;
    bool small = false;
    if (std::from_chars(first, q, wide).ec == std::errc::result_out_of_range)
      for (const char* c = first; c < q; ++c) small = small || ((*c == 'e' || *c == 'E') && c[1] == '-');
    else
      small = wide < 1.;
    parsed = small ? 0.f : std::numeric_limits<float>::infinity();
  }
  value = minus ? -parsed : parsed;
  p = q;
  return true;
}

inline void append_number(std::string& text, std::int64_t value) {
  std::array<char, 24> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

/// The shortest text that is read as the same number, with an exponent where that is shorter.
inline void append_shortest(std::string& text, float value) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

/// Without exponent, as some formats demand: at most some 60 characters.
inline void append_number(std::string& text, float value) {
  std::array<char, 128> digits;
  text.append(
      digits.data(),
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed).ptr);
}

}  // namespace forest::io
