// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/split_areas.h"

#include <algorithm>
#include <map>
#include <utility>

namespace forest {
namespace {

class Splitter {
 public:
  explicit Splitter(std::span<const std::uint16_t> areas) { out_.areas.assign(areas.begin(), areas.end()); }

  void add(const Triangle& t) {
    const auto area = [&](std::size_t k) { return out_.areas[t[k % 3]]; };
    for (std::size_t k = 0; k < 3; ++k) {
      if (area(k + 1) != area(k + 2)) continue;
      if (area(k) == area(k + 1)) return out_.triangles.push_back(t);
      return cut_off(t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
    }
    for (std::size_t k = 0; k < 3; ++k) cut_apart(t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
  }

  SplitAreas split() && { return std::move(out_); }

 private:
  /// The corner `a` from `b` and `c`, which are of one area.
  void cut_off(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint16_t near = out_.areas[a], far = out_.areas[b];
    out_.triangles.push_back({a, middle({a, b, b}, near), middle({a, c, c}, near)});
    out_.triangles.push_back({middle({a, b, b}, far), b, c});
    out_.triangles.push_back({middle({a, b, b}, far), c, middle({a, c, c}, far)});
  }

  /// The third of a triangle that is next to the corner `a`, of areas that all differ.
  void cut_apart(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint16_t own = out_.areas[a];
    const std::uint32_t inside = middle({a, b, c}, own);
    out_.triangles.push_back({a, middle({a, b, b}, own), inside});
    out_.triangles.push_back({a, inside, middle({a, c, c}, own)});
  }

  std::uint32_t middle(std::array<std::uint32_t, 3> of, std::uint16_t area) {
    std::ranges::sort(of);
    if (of[0] == of[1]) std::swap(of[0], of[2]);  // two: the second again
    const auto [known, added] = known_.try_emplace({of, area}, std::uint32_t(out_.areas.size()));
    if (added) out_.middles.push_back(of), out_.areas.push_back(area);
    return known->second;
  }

  SplitAreas out_;
  std::map<std::pair<std::array<std::uint32_t, 3>, std::uint16_t>, std::uint32_t> known_;
};

}  // namespace

SplitAreas split_areas(std::span<const Triangle> triangles, std::span<const std::uint16_t> areas) {
  Splitter splitter(areas);
  for (const Triangle& t : triangles) splitter.add(t);
  return std::move(splitter).split();
}

}  // namespace forest
