// SPDX-License-Identifier: Apache-2.0
#include "forest/io/difference.h"

#include <algorithm>
#include <unordered_map>

namespace forest::io {
namespace {

constexpr std::size_t none = std::size_t(-1);

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return lines;
}

// Of each line of `to`, the line of `from` with the same text, where both texts have it once.
std::vector<std::size_t> unique_matches(const std::vector<std::string_view>& from,
                                        const std::vector<std::string_view>& to) {
  struct Places {
    std::size_t from = none, to = none;
    bool repeated = false;
  };
  std::unordered_map<std::string_view, Places> places;
  for (std::size_t i = 0; i < from.size(); ++i) {
    Places& p = places[from[i]];
    p.repeated |= p.from != none;
    p.from = i;
  }
  for (std::size_t i = 0; i < to.size(); ++i)
    if (const auto p = places.find(to[i]); p != places.end()) {
      p->second.repeated |= p->second.to != none;
      p->second.to = i;
    }
  std::vector<std::size_t> match(to.size(), none);
  for (const auto& [text, p] : places)
    if (!p.repeated && p.to != none) match[p.to] = p.from;
  return match;
}

// Leaves of the matches the longest sequence that rises in both texts.
void keep_rising(std::vector<std::size_t>& match) {
  std::vector<std::size_t> tails,
      before(match.size(), none);  // tails[k]: last line of a rising sequence of k + 1
  for (std::size_t i = 0; i < match.size(); ++i) {
    if (match[i] == none) continue;
    const auto tail =
        std::ranges::lower_bound(tails, match[i], {}, [&](std::size_t line) { return match[line]; });
    if (tail != tails.begin()) before[i] = *(tail - 1);
    if (tail == tails.end())
      tails.push_back(i);
    else
      *tail = i;
  }
  std::vector<std::size_t> kept(match.size(), none);
  for (std::size_t at = tails.empty() ? none : tails.back(); at != none; at = before[at])
    kept[at] = match[at];
  match = std::move(kept);
}

}  // namespace

std::vector<Passage> difference(std::string_view from_text, std::string_view to_text) {
  const auto from = lines_of(from_text), to = lines_of(to_text);
  std::vector<std::size_t> match = unique_matches(from, to);
  keep_rising(match);
  for (std::size_t i = 1, last = none; i < to.size(); ++i) {  // equal lines after a match
    if (match[i - 1] != none) last = match[i - 1];
    if (match[i] == none && last != none && match[i - 1] == last && last + 1 < from.size() &&
        from[last + 1] == to[i])
      match[i] = last + 1;
  }
  for (std::size_t i = 0; i < to.size() && match[i] == none && i < from.size() && from[i] == to[i]; ++i)
    match[i] = i;
  keep_rising(match);

  std::vector<Passage> passages;
  for (std::size_t i = 0; i < to.size(); ++i) {
    Passage* last = passages.empty() ? nullptr : &passages.back();
    if (match[i] == none) {
      if (!last || last->count) last = &passages.emplace_back();
      last->text += to[i];
    } else if (last && last->count && last->first + last->count == match[i]) {
      ++last->count;
    } else {
      passages.push_back({match[i], 1, {}});
    }
  }
  return passages;
}

std::string rebuilt(std::string_view from_text, const std::vector<Passage>& passages) {
  const auto from = lines_of(from_text);
  std::string text;
  for (const Passage& p : passages) {
    text += p.text;
    for (std::size_t i = p.first; i < p.first + p.count && i < from.size(); ++i) text += from[i];
  }
  return text;
}

}  // namespace forest::io
