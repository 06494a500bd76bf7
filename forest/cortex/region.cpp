// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/region.h"

#include <algorithm>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {

using Place = Eigen::Vector3d;

std::vector<Place> middles_of(std::span<const Hexahedron> elements) {
  std::vector<Place> middles(elements.size());
  parallel_for(elements.size(), 256, [&](std::size_t e) { middles[e] = elements[e].at(.5, .5, .5); });
  return middles;
}

std::vector<float> values_at(std::span<const Hexahedron> elements, const Mesh& outer,
                             std::span<const float> values) {
  constexpr double near = 300.;  // µm
  const TriangleTree tree(outer);
  std::vector<float> result(elements.size());
  std::vector<std::uint8_t> away(elements.size(), 0);
  parallel_for(elements.size(), 256, [&](std::size_t e) {
    const auto hit = tree.nearest(elements[e].at(.5, .5, 0.), near);
    away[e] = !hit;
    if (!hit) return void(result[e] = std::numeric_limits<float>::quiet_NaN());
    const Triangle& t = outer.triangles[hit->triangle];
    const auto vertex = *std::ranges::min_element(
        t, {}, [&](std::uint32_t v) { return (outer.positions[v].cast<double>() - hit->at).squaredNorm(); });
    result[e] = values[vertex];
  });
  if (const auto count = std::ranges::count(away, 1); 100 * count > std::ptrdiff_t(elements.size()))
    throw Error(fmt::format(
        "{} of {} elements lie more than .3 mm from the surface of the areas; give the outer surface "
        "that they were built from",
        count, elements.size()));
  return result;
}

std::vector<std::uint32_t> row_through(const Sheet& sheet, std::uint32_t middle, std::size_t count) {
  std::vector<std::uint32_t> row{middle};
  std::set<std::uint32_t> taken{middle};
  const auto walk = [&](std::uint32_t element, Face out, std::size_t length) {
    std::vector<std::uint32_t> way;
    while (way.size() < length) {
      const Junction next = sheet.junctions[element][std::size_t(out)];
      if (next.element == Junction::nothing || !taken.insert(next.element).second) break;
      way.push_back(element = next.element);
      out = Face(int(next.face) ^ 1);  // out by the opposite face
    }
    return way;
  };
  auto before = walk(middle, Face::u0, (count - 1) / 2);
  const auto after = walk(middle, Face::u1, count - 1 - before.size());
  std::ranges::reverse(before);
  row.insert(row.begin(), before.begin(), before.end());
  row.insert(row.end(), after.begin(), after.end());
  return row;
}

Vec3 towards_pia(std::span<const Hexahedron> elements, std::span<const std::uint32_t> chosen) {
  Place sum = Place::Zero();
  for (const std::uint32_t e : chosen)
    sum -= elements[e].jacobian(Place::Constant(.5)).col(2).stableNormalized();
  constexpr double least = .1;  // of the number of elements
  if (!(sum.norm() > least * double(chosen.size()))) return Vec3::UnitY();
  return sum.normalized().cast<float>();
}

}  // namespace forest::cortex
