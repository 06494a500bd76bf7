// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/cursor.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::lsystem {

std::size_t Cursor::line() {
  if (at_ < counted_) counted_ = 0, line_ = 1;
  line_ += std::size_t(std::ranges::count(text_.substr(counted_, at_ - counted_), '\n'));
  counted_ = at_;
  return line_;
}

bool Cursor::more() {
  while (at_ < end_ && is_space(text_[at_])) ++at_;
  return at_ < end_;
}

bool Cursor::sees(std::string_view token) {
  return more() && text_.substr(at_, end_ - at_).starts_with(token);
}

bool Cursor::takes(std::string_view token) {
  if (!sees(token)) return false;
  at_ += token.size();
  return true;
}

void Cursor::expect(std::string_view token, std::string_view purpose) {
  if (!takes(token)) fail(fmt::format("a '{}' is missing here, {}", token, purpose));
}

char Cursor::peek() { return more() ? text_[at_] : '\0'; }

std::string_view Cursor::rest() { return more() ? text_.substr(at_, end_ - at_) : std::string_view{}; }

std::string Cursor::name(std::string_view purpose) {
  const std::string_view all = rest();
  const auto length = std::size_t(std::ranges::find_if_not(all, is_name) - all.begin());
  if (length == 0 || is_digit(all[0])) fail(fmt::format("a name is missing here, {}", purpose));
  at_ += length;
  return std::string(all.substr(0, length));
}

double Cursor::number() {
  double value = 0.;
  const std::string_view all = rest();
  const auto [stop, error] = std::from_chars(all.data(), all.data() + all.size(), value);
  if (error != std::errc() || !std::isfinite(value) || all[0] == '-') fail("a number is missing here");
  at_ += std::size_t(stop - all.data());
  return value;
}

double Cursor::signed_number() { return takes("-") ? -number() : number(); }

float Cursor::exact_float() {
  float value = 0.f;
  const std::string_view all = rest();
  const auto [stop, error] = std::from_chars(all.data(), all.data() + all.size(), value);
  if (error != std::errc()) fail("a number is missing here");
  at_ += std::size_t(stop - all.data());
  return value;
}

void Cursor::fail_at(std::size_t place, const std::string& sentence) const {
  const std::string_view before = text_.substr(0, place);
  const auto line = std::size_t(std::ranges::count(before, '\n')) + 1;
  const std::size_t start = before.rfind('\n') + 1;  // npos + 1 is 0
  const auto column =
      std::ranges::count_if(before.substr(start), [](char c) { return (c & 0xc0) != 0x80; }) + 1;
  throw InputError(file_, line, fmt::format("column {}: {}", column, sentence));
}

}  // namespace forest::lsystem
