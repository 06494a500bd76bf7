// SPDX-License-Identifier: Apache-2.0
// A place in a text that moves on token by token and knows its line and column when something is wrong there.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest::lsystem {

/// Text and file name must outlive it.
class Cursor {
 public:
  Cursor(std::string_view text, const std::string& file) : text_(text), file_(file), end_(text.size()) {}

  void enter(std::size_t begin, std::size_t end) {
    at_ = begin, end_ = end;
  }  // sees only this part from now on
  std::size_t at() const { return at_; }
  std::size_t line();  // 1-based; counted on from where it was asked last

  // All of these pass over blanks first.
  bool more();  // is anything left
  bool sees(std::string_view token);
  bool takes(std::string_view token);  // moves past the token when it stands here
  void expect(std::string_view token, std::string_view purpose);
  char peek();  // '\0' at the end
  std::string_view rest();
  std::string name(std::string_view purpose);  // letters, digits and _; throws when none begins here
  double number();                             // finite, without a sign
  double signed_number();
  float exact_float();  // what fmt's shortest form of a float gave; with sign, inf and nan

  void skip(std::size_t count) { at_ += count; }
  [[noreturn]] void fail(const std::string& sentence) const { fail_at(at_, sentence); }
  /// Throws InputError "file:line: column n: sentence".
  [[noreturn]] void fail_at(std::size_t place, const std::string& sentence) const;

 private:
  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0, end_;
  std::size_t counted_ = 0, line_ = 1;  // up to where lines are counted, and the line there
};

constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
constexpr bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
constexpr bool is_name(char c) { return is_letter(c) || is_digit(c) || c == '_'; }

}  // namespace forest::lsystem
