// SPDX-License-Identifier: Apache-2.0
// The text of a Neurolucida file: characters become words, texts in quotation marks, points, and blocks whose inside does not
// matter. What brackets mean is its reader's (asc.cpp), who is told of comments, too, since ours say something.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/morphology/morphology.h"

namespace forest::io {

enum class AscOddity : std::uint8_t {
  byte_order_mark,
  padding,
  thumbnail,
  several_outlines,
  outline_by_name,
  small_outline,
  empty_outline,
  no_type,
  type_in_branch,
  no_diameter,
  negative_diameter,
  unknown_diameter,
  unknown_place,
  extra_numbers,
  empty_tree,
  tree_begins_with_split,
  branch_without_points,
  only_branch_point,
  empty_branch,
  single_daughter,
  second_split,
  unknown_word,
  text_in_tree,
  trailing_text,
  spine_without_place,
  spine_before_points,
  stray_bracket,
  comments_not_kept,
  properties_not_kept,
  count
};

inline bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
inline bool begins_number(char c) { return is_digit(c) || c == '-' || c == '+' || c == '.'; }
inline bool ends_word(char c) {
  return static_cast<unsigned char>(c) <= ' ' || c == ')' || c == '(' || c == ';' || c == '|' || c == '<' ||
         c == '>' || c == '"';
}

/// The base of its reader, which goes through it once: p_ is where it is, and line_ in which line.
class AscText {
 protected:
  AscText(std::string_view text, const std::string& name, std::span<const Oddity> table)
      : text_(text), name_(name), oddities_(table), p_(text_.data()), end_(p_ + text_.size()) {}
  ~AscText() = default;
  AscText(const AscText&) = delete;
  AscText& operator=(const AscText&) = delete;

  /// @param text  from its semicolon to the end of the line
  virtual void comment(std::string_view text) = 0;

  /// Goes to the next character that is neither blank nor in a comment.
  char next() {
    for (;; ++p_) {
      const char c = *p_;
      if (c == ' ' || c == '\t') continue;
      if (c == '\n') {
        ++line_;
      } else if (c == '\r') {
        line_ += p_[1] != '\n';
      } else if (c == ';') {
        const char* const begin = p_;
        while (!is_line_end(*p_) && p_ < end_) ++p_;
        comment({begin, p_});
        --p_;
      } else {
        return c;
      }
    }
  }

  /// The run of characters that begins here, one at least; stays in front of it.
  std::string_view word() const;
  /// From a quotation mark to behind the next one.
  std::string_view quoted();

  /// From the first number to behind the closing bracket.
  Point point() {
    std::array<float, 4> v{};
    std::size_t count = 0;
    bool exponent = false;
    while (count < 4 && read_real<ends_word>(p_, v[count], exponent)) {
      ++count;
      if (next() == ')') break;
    }
    if (count == 4 && *p_ == ')') [[likely]]
      ++p_;
    else
      odd_point(v, count);
    const float sum = v[0] + v[1] + v[2];
    if (!(std::abs(sum) < std::numeric_limits<float>::infinity()) || !(v[3] >= 0.f) ||
        !(v[3] < std::numeric_limits<float>::infinity())) [[unlikely]]
      unknown_numbers(v);
    return {v[0], v[1], v[2], .5f * v[3]};
  }

  struct Block {
    std::string text;       // one blank between words, no comments
    std::string_view word;  // its first
    std::string_view quoted;
    std::size_t numbers = 0;  // behind the word
    std::size_t points = 0;   // brackets that begin with a number
    bool quotes = false, splits = false, more = false;
  };

  /// From an opening bracket to behind the one that closes it, whatever is between them.
  Block skip_block();
  void back_to(const char* p, std::size_t line) { p_ = p, line_ = line; }

  [[noreturn]] void unfinished(std::string_view what, std::size_t begin) const;
  [[noreturn]] void unexpected(std::string_view where) const;
  /// Whether a block in a tree or an outline has a word where a point has a number.
  void refuse_broken_point(const Block& block, std::size_t line) const;

  const std::string text_;  // with the zero behind it, which ends every loop
  const std::string& name_;
  OddityList<AscOddity> oddities_;
  const char* p_;
  const char* const end_;
  std::size_t line_ = 1;
  Point last_;  // the one before, for numbers that are not known
  bool has_last_ = false;

 private:
  void odd_point(std::array<float, 4>& v, std::size_t count);
  void unknown_numbers(std::array<float, 4>& v);
};

}  // namespace forest::io
