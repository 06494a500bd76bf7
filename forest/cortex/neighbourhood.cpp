// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/neighbourhood.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "forest/core/distinct.h"

namespace forest::cortex {

Patch face_of(const Elements& elements, std::size_t element, std::size_t depth) {
  std::array<Place, 16> places;
  for (std::size_t c = 0; c < 16; ++c) places[c] = elements.curves[elements.elements[element][c]][depth];
  return through_lattice(places);
}

Stars::Stars(const Elements& elements) : starts_(elements.curves.size() + 1) {
  for (const auto& e : elements.elements)
    for (const std::uint32_t c : e) ++starts_[c + 1];
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  list_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (std::uint32_t e = 0; e < elements.size(); ++e)
    for (const std::uint32_t c : elements.elements[e]) list_[next[c]++] = e;
}

std::vector<std::uint32_t> widened(const Elements& elements, const Stars& stars,
                                   std::span<const std::uint32_t> list, int rings) {
  std::vector<std::uint32_t> wide(list.begin(), list.end());
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t e : wide)
      for (const std::uint32_t c : elements.corners_of(e)) {
        const auto star = stars.of(c);
        next.insert(next.end(), star.begin(), star.end());
      }
    wide = distinct(std::move(next));
  }
  return wide;
}

std::vector<std::uint8_t> by_the_wall(const Elements& elements) {
  std::vector<std::uint8_t> rim(elements.corners, 0);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> met;
  for (const auto& e : elements.elements)
    for (const auto& side : sides) ++met[std::minmax(e[side[0]], e[side[3]])];
  for (const auto& [side, count] : met)
    if (count == 1) rim[side.first] = rim[side.second] = 1;
  return rim;
}

void calm(const Place& first, Place& second, Place& third, const Place& last) {
  const Place one = second - (2. * first + last) / 3., two = third - (first + 2. * last) / 3.;
  const Place zigzag = (one - two) / 2.;
  second -= zigzag * (2. / 3.), third += zigzag * (2. / 3.);
}

}  // namespace forest::cortex
