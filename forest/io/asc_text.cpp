// SPDX-License-Identifier: Apache-2.0
#include "forest/io/asc_text.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

constexpr std::string_view layout = "a point is (x y z diameter)";
// Properties of outlines and trees in which numbers follow the word.
constexpr std::array<std::string_view, 6> numbered_words{"ZSmear", "Class",      "Font",
                                                         "Color",  "Resolution", "SSM"};

}  // namespace

std::string_view AscText::word() const {
  const char* q = p_;
  do ++q;
  while (q < end_ && !ends_word(*q));
  return {p_, std::min(q, end_)};
}

std::string_view AscText::quoted() {
  const char* const begin = ++p_;
  const std::size_t line = line_;
  for (; *p_ != '"'; ++p_) {
    if (p_ == end_)
      throw InputError(name_, line, "a quotation mark is not closed; close it, or get the whole file");
    line_ += *p_ == '\n' || (*p_ == '\r' && p_[1] != '\n');
  }
  return {begin, p_++};
}

void AscText::unfinished(std::string_view what, std::size_t begin) const {
  throw InputError(
      name_, line_,
      fmt::format("the file ends inside of {} that begins on line {}; get the whole file, or close "
                  "its brackets",
                  what, begin));
}

void AscText::unexpected(std::string_view where) const {
  throw InputError(
      name_, line_,
      fmt::format("\"{}\" has no meaning in {}; remove it or put it into brackets", shown(word()), where));
}

void AscText::odd_point(std::array<float, 4>& v, std::size_t count) {
  for (;;) {
    const char c = next();
    if (c == ')') break;
    if (p_ == end_) unfinished("a point", line_);
    if (count < 3 || c == '(' || c == '|' || c == '<' || c == '>' || c == '"')
      throw InputError(name_, line_, fmt::format("\"{}\" is not a number; {}", shown(word()), layout));
    if (begins_number(c) && count == 3 && !is_letter(c))
      throw InputError(name_, line_, fmt::format("\"{}\" is not a diameter; {}", shown(word()), layout));
    if (begins_number(c))
      oddities_.add(AscOddity::extra_numbers, line_, "a point has more than four numbers");
    p_ += word().size();  // the name of a section (S1) may follow
  }
  ++p_;
  if (count < 3) throw InputError(name_, line_, fmt::format("a point has {} numbers; {}", count, layout));
  if (count == 3) {
    oddities_.add(AscOddity::no_diameter, line_, "a point has no diameter");
    v[3] = 2.f * last_.radius;
  }
}

void AscText::unknown_numbers(std::array<float, 4>& v) {
  const std::array<float, 3> before{last_.x, last_.y, last_.z};
  for (std::size_t i = 0; i < 3; ++i)
    if (!std::isfinite(v[i])) {
      if (!has_last_)
        throw InputError(name_, line_, "the first point has no place; give its coordinates in µm");
      oddities_.add(AscOddity::unknown_place, line_, "a coordinate is not finite");
      v[i] = before[i];
    }
  if (v[3] >= 0.f && std::isfinite(v[3])) return;
  if (v[3] < 0.f)
    oddities_.add(AscOddity::negative_diameter, line_,
                  [&] { return fmt::format("the diameter is {}", v[3]); });
  else
    oddities_.add(AscOddity::unknown_diameter, line_, "the diameter is not finite");
  v[3] = 2.f * last_.radius;
}

AscText::Block AscText::skip_block() {
  Block block;
  const std::size_t begin = line_;
  std::size_t depth = 0;
  bool first = true, opened = false, numbers = false;
  do {
    const char c = next();
    if (p_ == end_) unfinished("a block", begin);
    const bool glued = block.text.empty() || block.text.back() == '(' || c == ')';
    if (!glued) block.text += ' ';
    if (c == '(') {
      ++depth;
      block.text += c, ++p_;
      block.splits = block.splits || (opened && depth > 2);
      opened = true, numbers = false;
      block.more = block.more || depth > 1;
      continue;
    }
    if (c == ')') {
      --depth;
      block.text += c, ++p_;
    } else if (c == '"') {
      const std::string_view string = quoted();
      (block.text += '"') += string;
      block.text += '"';
      if (block.quoted.empty()) block.quoted = string;
      block.quotes = block.quotes || depth == 1;
      block.more = true;
    } else {
      const std::string_view word = this->word();
      if (first) block.word = word;
      float value = 0.f;
      bool exponent = false;
      const char* q = p_;
      const bool number = begins_number(c) && read_real<ends_word>(q, value, exponent);
      block.points += number && opened && depth > 1;
      block.splits = block.splits || c == '|';
      block.numbers += number && numbers;
      numbers = depth == 1 && (first || (numbers && number));
      block.more = block.more || !first;
      block.text += word;
      p_ += word.size();
    }
    first = false, opened = false;
  } while (depth > 0);
  return block;
}

void AscText::refuse_broken_point(const Block& block, std::size_t line) const {
  if (block.numbers >= 2 && std::ranges::find(numbered_words, block.word) == numbered_words.end())
    throw InputError(name_, line, fmt::format("\"{}\" is not a number; {}", shown(block.word), layout));
}

}  // namespace forest::io
