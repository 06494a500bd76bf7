// SPDX-License-Identifier: Apache-2.0
#include "forest/core/number_order.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <compare>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"

namespace forest {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_sign(char c) { return c == '-' || c == '+'; }
bool is_point(char c) { return c == '.' || c == ','; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || static_cast<unsigned char>(c) >= 128; }

// By the value of the numbers in them; the rest by its bytes.
std::strong_ordering by_each_number(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] <=> b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [](std::string_view text, std::size_t& at) {  // without the zeros before it
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string_view m = number(a, i), n = number(b, j);
    if (m != n) return m.size() != n.size() ? m.size() <=> n.size() : m <=> n;
  }
  return a.size() - i <=> b.size() - j;
}

std::optional<double> value_of(std::string_view digits) {
  double value = 0.;
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return end.ec == std::errc{} && end.ptr == digits.data() + digits.size() ? std::optional(value)
                                                                           : std::nullopt;
}

std::optional<double> last_number(std::string_view name) {
  const std::size_t end = name.find_last_of("0123456789");
  if (end == name.npos) return std::nullopt;
  std::size_t begin = end;
  while (begin > 0 && is_digit(name[begin - 1])) --begin;
  return value_of(name.substr(begin, end + 1 - begin));
}

// How many characters all have alike at their beginning.
std::size_t alike(std::span<const std::string> names) {
  std::size_t count = names[0].size();
  for (const std::string& name : names)
    count = std::min(count, std::size_t(std::ranges::mismatch(name, names[0]).in1 - name.begin()));
  return count;
}

// What lies between that which all have alike: a whole number with its sign and decimals, where it is one.
std::vector<std::string_view> differing(std::span<const std::string> names) {
  std::size_t front = alike(names);
  std::vector<std::string> reversed;
  for (const std::string& name : names)
    reversed.emplace_back(name.rbegin(), name.rend() - std::ptrdiff_t(front));
  std::size_t back = alike(reversed);
  const std::string& one = names[0];
  const auto digits_before = [&] {
    while (front > 0 && is_digit(one[front - 1])) --front;
  };
  digits_before();
  if (front > 1 && is_point(one[front - 1]) && is_digit(one[front - 2])) --front, digits_before();
  if (front > 0 && is_sign(one[front - 1]) &&
      (front == 1 || !(is_letter(one[front - 2]) || is_digit(one[front - 2]))))
    --front;
  const auto behind = [&](std::size_t i) { return i < back ? one[one.size() - back + i] : '\0'; };
  const auto digits_behind = [&] {
    while (is_digit(behind(0))) --back;
  };
  digits_behind();
  if (is_point(behind(0)) && is_digit(behind(1))) --back, digits_behind();
  std::vector<std::string_view> between;
  for (const std::string& name : names)
    between.push_back(std::string_view(name).substr(front, name.size() - front - back));
  return between;
}

struct Number {
  double value = 0.;               // with decimals
  double whole = 0., behind = 0.;  // or as two numbers, with the sign of the first
};

std::optional<Number> number_of(std::string_view text) {
  const double sign = text.starts_with('-') ? -1. : 1.;
  if (!text.empty() && is_sign(text[0])) text.remove_prefix(1);
  const auto point = std::size_t(std::ranges::find_if(text, is_point) - text.begin());
  const std::string_view digits = text.substr(0, point),
                         decimals = point < text.size() ? text.substr(point + 1) : std::string_view();
  if (digits.empty() || (point < text.size() && decimals.empty()) || !std::ranges::all_of(digits, is_digit) ||
      !std::ranges::all_of(decimals, is_digit))
    return std::nullopt;
  const auto whole = value_of(digits), behind = decimals.empty() ? 0. : value_of(decimals),
             value =
                 value_of(decimals.empty() ? std::string(digits) : fmt::format("{}.{}", digits, decimals));
  if (!whole || !behind || !value) return std::nullopt;
  return Number{sign * *value, sign * *whole, sign * *behind};
}

// Whether all that follow one another are as far apart.
bool even(std::span<const double> values) {
  for (std::size_t i = 2; i < values.size(); ++i)
    if (std::abs((values[i] - values[i - 1]) / (values[1] - values[0]) - 1.) > .01) return false;
  return values.size() < 2 || values[1] > values[0];
}

// The same of two numbers each, the second anew with every first.
bool even_of_two(std::span<const Number> numbers, std::span<const std::size_t> order) {
  double step = 0.;
  for (std::size_t i = 1; i < order.size(); ++i) {
    const Number &a = numbers[order[i - 1]], &b = numbers[order[i]];
    if (a.whole != b.whole) continue;
    if (step == 0.) step = b.behind - a.behind;
    if (!(step > 0.) || b.behind - a.behind != step) return false;
  }
  return true;
}

}  // namespace

std::vector<NumberedFile> in_number_order(std::span<const std::filesystem::path> files) {
  const std::size_t count = files.size();
  std::vector<std::string> names;
  for (const auto& file : files) names.push_back(lower(file.stem().string()));
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  const auto sort = [&](auto&& before) { std::ranges::stable_sort(order, before); };
  const auto refuse = [&](std::size_t one, std::size_t other, std::string_view why) {
    throw Error(
        fmt::format("{} and {} {}", files[one].filename().string(), files[other].filename().string(), why));
  };
  const auto each_once = [&](auto&& same) {
    const auto twice = std::ranges::adjacent_find(order, same);
    if (twice != order.end()) refuse(twice[0], twice[1], "have the same number; take one of them out");
  };
  const auto result = [&](auto&& number) {
    std::vector<NumberedFile> numbered;
    for (const std::size_t i : order) numbered.push_back({files[i], number(i)});
    return numbered;
  };
  const auto last = [&](std::size_t i) { return last_number(names[i]); };

  std::vector<Number> numbers;
  if (count > 1)
    for (const std::string_view text : differing(names))
      if (const auto number = number_of(text)) numbers.push_back(*number);
  if (count < 2 || numbers.size() < count) {
    const auto by = [&](std::size_t a, std::size_t b) { return by_each_number(names[a], names[b]); };
    sort([&](std::size_t a, std::size_t b) { return by(a, b) < 0; });
    each_once([&](std::size_t a, std::size_t b) { return by(a, b) == 0; });
    return result(last);
  }
  const auto two = [&](std::size_t i) { return std::pair(numbers[i].whole, numbers[i].behind); };
  const auto value = [&](std::size_t i) { return numbers[i].value; };
  sort([&](std::size_t a, std::size_t b) { return two(a) < two(b); });
  const auto by_two = order;
  sort([&](std::size_t a, std::size_t b) { return value(a) < value(b); });
  if (order != by_two) {
    std::vector<double> values;
    for (const std::size_t i : order) values.push_back(value(i));
    const bool decimals = even(values), pairs = even_of_two(numbers, by_two);
    if (decimals == pairs) {
      const auto [a, b] = std::ranges::mismatch(order, by_two);
      refuse(*a, *b, "may follow one another either way; give all names as many digits behind the point");
    }
    if (pairs) {
      order = by_two;
      each_once([&](std::size_t a, std::size_t b) { return two(a) == two(b); });
      return result(last);
    }
  }
  each_once([&](std::size_t a, std::size_t b) { return value(a) == value(b); });
  return result([&](std::size_t i) { return std::optional(value(i)); });
}

}  // namespace forest
