// SPDX-License-Identifier: Apache-2.0
#include "forest/core/line_diff.h"

#include <algorithm>
#include <cstdlib>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace forest {
namespace {

using Lines = std::vector<std::string_view>;  // with their ends

Lines lines_of(std::string_view text) {
  Lines lines;
  while (!text.empty()) {
    const std::size_t length = std::min(text.find('\n'), text.size() - 1) + 1;
    lines.push_back(text.substr(0, length));
    text.remove_prefix(length);
  }
  return lines;
}

struct Edit {
  char sign;  // ' ', '-' or '+'
  std::string_view line;
};

constexpr int most_changes = 2000;

/// The edits between the parts of two texts that do not begin and end alike.
std::vector<Edit> edits_between(std::span<const std::string_view> a, std::span<const std::string_view> b) {
  const int n = int(a.size()), m = int(b.size());
  // reach[d][k + d]: how far in `a` one comes on the diagonal k, which is x - y, with d changes.
  std::vector<std::vector<int>> reach;
  const auto at = [&](int d, int k) { return reach[std::size_t(d)][std::size_t(k + d)]; };
  const auto inserted = [&](int d, int k) {  // whether the last of them is a line of `b`
    return k == -d || (k != d && at(d - 1, k - 1) < at(d - 1, k + 1));
  };
  const auto start = [&](int d, int k) {  // where one is just after it
    return d == 0 ? 0 : inserted(d, k) ? at(d - 1, k + 1) : at(d - 1, k - 1) + 1;
  };
  const auto on_diagonal = [&](int d) { return d >= std::abs(n - m) && (d - n + m) % 2 == 0; };
  bool found = false;
  for (int d = 0; !found && d <= std::min(n + m, most_changes); ++d) {
    std::vector<int> row(2 * std::size_t(d) + 1, 0);
    for (int k = -d; k <= d; k += 2) {
      int x = start(d, k);
      while (x < n && x - k < m && a[std::size_t(x)] == b[std::size_t(x - k)]) ++x;
      row[std::size_t(k + d)] = x;
    }
    reach.push_back(std::move(row));
    found = on_diagonal(d) && at(d, n - m) == n;
  }
  std::vector<Edit> edits;
  if (!found) {
    for (const std::string_view line : a) edits.push_back({'-', line});
    for (const std::string_view line : b) edits.push_back({'+', line});
    return edits;
  }
  int x = n, y = m;  // back from the end
  for (int d = int(reach.size()) - 1; d >= 0; --d) {
    const int k = x - y, least = start(d, k);
    while (x > least) --x, --y, edits.push_back({' ', a[std::size_t(x)]});
    if (d == 0) break;
    if (inserted(d, k))
      --y, edits.push_back({'+', b[std::size_t(y)]});
    else
      --x, edits.push_back({'-', a[std::size_t(x)]});
  }
  std::ranges::reverse(edits);
  return edits;
}

std::string range(std::size_t first, std::size_t count) {
  if (count == 1) return fmt::format("{}", first + 1);
  return fmt::format("{},{}", count ? first + 1 : first, count);  // of nothing: the line before it
}

}  // namespace

std::string unified_diff(std::string_view before, std::string_view after, std::string_view name_before,
                         std::string_view name_after, std::size_t context) {
  if (before == after) return {};
  const Lines a = lines_of(before), b = lines_of(after);
  const std::size_t shorter = std::min(a.size(), b.size());
  std::size_t head = 0, tail = 0;
  while (head < shorter && a[head] == b[head]) ++head;
  while (tail < shorter - head && a[a.size() - 1 - tail] == b[b.size() - 1 - tail]) ++tail;
  std::vector<Edit> edits;
  for (std::size_t i = 0; i < head; ++i) edits.push_back({' ', a[i]});
  const auto middle = [&](const Lines& lines) {
    return std::span(lines).subspan(head, lines.size() - head - tail);
  };
  for (const Edit& edit : edits_between(middle(a), middle(b))) edits.push_back(edit);
  for (std::size_t i = a.size() - tail; i < a.size(); ++i) edits.push_back({' ', a[i]});

  std::string out = fmt::format("--- {}\n+++ {}\n", name_before, name_after);
  std::size_t line_a = 0, line_b = 0, at = 0;  // at: of the edits before which all is written or passed
  const auto pass = [&](std::size_t end) {
    for (; at < end; ++at) line_a += edits[at].sign != '+', line_b += edits[at].sign != '-';
  };
  for (std::size_t change = 0; change < edits.size();) {
    if (edits[change].sign == ' ') {
      ++change;
      continue;
    }
    std::size_t last = change;  // changes with no more between them than both their contexts
    for (std::size_t i = change; i < edits.size() && i <= last + 2 * context + 1; ++i)
      if (edits[i].sign != ' ') last = i;
    const std::size_t begin = std::max(at, change - std::min(change, context));
    const std::size_t end = std::min(edits.size(), last + 1 + context);
    pass(begin);
    const std::size_t first_a = line_a, first_b = line_b;
    pass(end);
    out += fmt::format("@@ -{} +{} @@\n", range(first_a, line_a - first_a), range(first_b, line_b - first_b));
    for (std::size_t i = begin; i < end; ++i) {
      out += edits[i].sign, out += edits[i].line;
      if (!out.ends_with('\n')) out += "\n\\ No newline at end of file\n";
    }
    change = end;
  }
  return out;
}

}  // namespace forest
