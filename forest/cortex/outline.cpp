// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/outline.h"

#include <algorithm>
#include <array>
#include <set>
#include <unordered_set>

namespace forest::cortex {
namespace {

constexpr std::size_t pieces = 8, many = 100;

struct Side {
  int axis;    // that does not change along it: 0 is u, 1 is v
  double end;  // its value there
};
constexpr std::array<Side, 4> sides{{{0, 0.}, {0, 1.}, {1, 0.}, {1, 1.}}};  // as Face: u0, u1, v0, v1

class Lines {
 public:
  // From (t = 0) to (t = 1), in the other order when that end comes first: neighbours have the same line.
  template <class At>
  void add(const Hexahedron& element, At&& at) {
    std::vector<Vec3> line(pieces + 1);
    for (std::size_t i = 0; i <= pieces; ++i)
      line[i] = element.at(at(double(i) / double(pieces))).template cast<float>();
    const auto of = [](const Vec3& p) { return std::array{p.x(), p.y(), p.z()}; };
    const auto middle = of(line[pieces / 2]);
    auto a = of(line.front()), b = of(line.back());
    if (b < a) std::swap(a, b);
    if (seen_.insert({a, b, middle}).second) lines_.push_back(std::move(line));
  }
  std::vector<std::vector<Vec3>> take() && { return std::move(lines_); }

 private:
  std::set<std::array<std::array<float, 3>, 3>> seen_;  // ends and middle
  std::vector<std::vector<Vec3>> lines_;
};

Eigen::Vector3d on(const Side& side, double along, double w) {
  return side.axis == 0 ? Eigen::Vector3d(side.end, along, w) : Eigen::Vector3d(along, side.end, w);
}

}  // namespace

std::vector<std::vector<Vec3>> outline(const Sheet& sheet, std::span<const std::uint32_t> elements,
                                       const std::function<Borders(std::uint32_t)>& borders) {
  const std::unordered_set<std::uint32_t> chosen(elements.begin(), elements.end());
  Lines lines;
  for (const std::uint32_t e : elements) {
    const Hexahedron& element = sheet.elements[e];
    for (std::size_t f = 0; f < sides.size(); ++f) {
      const Side& side = sides[f];
      const bool at_rim = !chosen.contains(sheet.junctions[e][f].element);
      if (!at_rim && elements.size() > many) continue;
      for (const double end : {0., 1.}) {
        lines.add(element, [&](double t) { return on(side, t, end); });
        lines.add(element, [&](double t) { return on(side, end, t); });
      }
      if (!at_rim) continue;
      const Borders layers = borders(e);
      for (std::size_t layer = 0; layer + 1 < layers.size(); ++layer)
        lines.add(element, [&](double t) {
          const Eigen::Vector3d at = on(side, t, 0.);
          return on(side, t, layers.end(at[0], at[1], layer));
        });
    }
  }
  return std::move(lines).take();
}

}  // namespace forest::cortex
