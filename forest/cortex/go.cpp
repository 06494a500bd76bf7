// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/go.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/cortex/gauge.h"

namespace forest::cortex {

std::vector<double> to_keep(const Elements& elements, double good) {
  std::vector<double> keep(elements.size(), -1.);
  const Looks looks = look(elements);
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    if (certify(elements.hexahedron(e)).positive()) keep[e] = std::clamp(double(looks.least[e]), 0., good);
  });
  return keep;
}

void go(Elements& elements, std::span<const Depths> aim, std::span<const double> keep) {
  constexpr std::uint8_t most_halvings = 3;  // then it stays
  const std::vector<Depths> start = elements.curves;
  const Stars stars(elements);
  std::vector<std::uint8_t> halved(start.size(), 0);
  std::vector<std::uint32_t> touched;  // elements of which something moved
  for (std::uint32_t c = 0; c < start.size(); ++c)
    if (aim[c] != start[c]) std::ranges::copy(stars.of(c), std::back_inserter(touched));
  touched = distinct(std::move(touched));
  std::ranges::copy(aim, elements.curves.begin());
  while (!touched.empty()) {
    std::vector<std::uint8_t> lost(touched.size(), 0);
    const Looks looks = look(elements, touched);
    parallel_for(touched.size(), 64, [&](std::size_t i) {
      const double wanted = keep[touched[i]];
      lost[i] = wanted >= 0. &&
                (double(looks.least[i]) < wanted || !certify(elements.hexahedron(touched[i])).positive());
    });
    std::vector<std::uint32_t> less, next;
    for (std::size_t i = 0; i < touched.size(); ++i)
      if (lost[i]) std::ranges::copy(elements.elements[touched[i]], std::back_inserter(less));
    for (const std::uint32_t c : distinct(std::move(less))) {
      if (halved[c] > most_halvings) continue;
      const double share = ++halved[c] > most_halvings ? 0. : 1. / double(1 << halved[c]);
      for (std::size_t d = 0; d < 4; ++d)
        elements.curves[c][d] = start[c][d] + share * (aim[c][d] - start[c][d]);
      std::ranges::copy(stars.of(c), std::back_inserter(next));
    }
    touched = distinct(std::move(next));
  }
}

}  // namespace forest::cortex
