// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/dealing.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace forest::statistics {

std::vector<std::uint32_t> numbered(std::span<const std::string> words) {
  std::map<std::string_view, std::uint32_t> numbers;
  std::vector<std::uint32_t> out;
  for (const std::string& word : words)
    out.push_back(numbers.try_emplace(word, std::uint32_t(numbers.size())).first->second);
  return out;
}

std::vector<std::uint32_t> dealt(std::size_t count, std::span<const std::uint32_t> slices, Random& random) {
  const std::size_t many = slices.empty() ? count : *std::ranges::max_element(slices) + std::size_t(1);
  std::vector<std::uint32_t> order(many);
  std::iota(order.begin(), order.end(), 0u);
  for (auto i = std::uint32_t(many); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  if (slices.empty()) return order;
  std::vector<std::uint32_t> place(many), rows(count);
  for (std::uint32_t i = 0; i < many; ++i) place[order[i]] = i;
  std::iota(rows.begin(), rows.end(), 0u);
  std::ranges::stable_sort(rows, {}, [&](std::uint32_t row) { return place[slices[row]]; });
  return rows;
}

}  // namespace forest::statistics
