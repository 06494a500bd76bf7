// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/go.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "forest/core/parallel.h"

namespace forest::cortex {

std::vector<double> to_keep(const Elements& elements, double good) {
  std::vector<double> keep(elements.size(), -1.);
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const Hexahedron h = elements.hexahedron(e);
    if (certify(h).positive()) keep[e] = std::min(good, scaled_jacobian(h));
  });
  return keep;
}

void go(Elements& elements, std::span<const Depths> aim, std::span<const double> keep) {
  constexpr std::uint8_t most_halvings = 3;  // then it stays
  const std::vector<Depths> start = elements.curves;
  const Stars stars(elements);
  std::vector<std::uint8_t> halved(start.size(), 0);
  std::vector<std::uint32_t> look;  // elements of which something moved
  for (std::uint32_t c = 0; c < start.size(); ++c)
    if (aim[c] != start[c]) std::ranges::copy(stars.of(c), std::back_inserter(look));
  look = distinct(std::move(look));
  std::ranges::copy(aim, elements.curves.begin());
  while (!look.empty()) {
    std::vector<std::uint8_t> lost(look.size(), 0);
    parallel_for(look.size(), 64, [&](std::size_t i) {
      const double wanted = keep[look[i]];
      if (wanted < 0.) return;
      const Hexahedron h = elements.hexahedron(look[i]);
      lost[i] = scaled_jacobian(h) < wanted || !certify(h).positive();
    });
    std::vector<std::uint32_t> less, next;
    for (std::size_t i = 0; i < look.size(); ++i)
      if (lost[i]) std::ranges::copy(elements.elements[look[i]], std::back_inserter(less));
    for (const std::uint32_t c : distinct(std::move(less))) {
      if (halved[c] > most_halvings) continue;
      const double share = ++halved[c] > most_halvings ? 0. : 1. / double(1 << halved[c]);
      for (std::size_t d = 0; d < 4; ++d)
        elements.curves[c][d] = start[c][d] + share * (aim[c][d] - start[c][d]);
      std::ranges::copy(stars.of(c), std::back_inserter(next));
    }
    look = distinct(std::move(next));
  }
}

}  // namespace forest::cortex
