// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/elements.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// A curve that ran astray, to another bank: far from what is around it, where curves that are only fanned out lie on both sides.
// It becomes their mean.
void call_back_strays(Elements& elements) {
  constexpr double far_corner = 2500., far_inside = 1500.;  // µm
  std::vector<std::vector<std::uint32_t>> near(elements.corners);
  for (const auto& e : elements.elements)
    for (const auto& side : sides)
      near[e[side[0]]].push_back(e[side[3]]), near[e[side[3]]].push_back(e[side[0]]);
  const auto mean = [&](std::uint32_t c, std::size_t depth) {
    Place sum = Place::Zero();
    for (const std::uint32_t other : near[c]) sum += elements.curves[other][depth];
    return Place(sum / double(near[c].size()));
  };
  // The farthest of each neighbourhood first, since it pulls the mean of those around it.
  std::vector<double> off(elements.corners, 0.);
  constexpr int most_rounds = 50;
  bool more = true;
  for (int round = 0; more && round < most_rounds; ++round) {
    more = false;
    parallel_for(elements.corners, 256, [&](std::size_t i) {
      const auto c = std::uint32_t(i);
      off[c] = near[c].empty() ? 0.
                               : std::max((elements.curves[c][3] - mean(c, 3)).norm(),
                                          (elements.curves[c][1] - mean(c, 1)).norm());
    });
    for (std::uint32_t c = 0; c < elements.corners; ++c) {
      if (off[c] < far_corner ||
          std::ranges::any_of(near[c], [&](std::uint32_t o) { return off[o] > off[c]; }))
        continue;
      for (std::size_t d = 1; d < 4; ++d) elements.curves[c][d] = mean(c, d);
      more = true;
    }
  }
  for (const auto& e : elements.elements) {
    std::array<Depths, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = elements.curves[e[slot(k & 1 ? 3 : 0, k & 2 ? 3 : 0)]];
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        if (i % 3 == 0 && j % 3 == 0) continue;
        const double u = i / 3., v = j / 3.;
        for (std::size_t d = 0; d < 4; ++d) {
          const Place even = (1. - v) * ((1. - u) * corners[0][d] + u * corners[1][d]) +
                             v * ((1. - u) * corners[2][d] + u * corners[3][d]);
          if (Place& place = elements.curves[e[slot(i, j)]][d]; (place - even).norm() > far_inside)
            place = even;
        }
      }
  }
}

// An outer surface that is crumpled on a smaller scale than an element, or creased like the floor of a sulcus whose banks touch, folds the
// faces of elements on it: these become smoother, each place going to the middle of those around, until they are folded no more. The
// inner half of the curves hardly follows and their slope at the inner surface stays: (1 − w)² of the way. Sides of one element alone stay.
void smooth_folded_faces(Elements& elements) {
  constexpr int most_rounds = 6, steps = 4;
  constexpr double least = .2;  // scaled Jacobian
  const Stars stars(elements);
  const std::vector<std::uint8_t> rim = by_the_wall(elements);
  const auto stays = [&](std::uint32_t c) {  // corners by the wall, and what is between them on a side
    if (c < elements.corners) return rim[c] != 0;
    const auto& own = elements.elements[stars.of(c)[0]];
    const auto at = std::find(own.begin(), own.end(), c) - own.begin();
    return stars.of(c).size() == 1 && (at % 4 % 3 == 0 || at / 4 % 3 == 0);
  };
  std::vector<std::uint32_t> look(elements.size());
  std::iota(look.begin(), look.end(), 0u);
  for (int round = 0; round < most_rounds && !look.empty(); ++round) {
    std::vector<std::uint8_t> folded(look.size(), 0);
    parallel_for(look.size(), 64, [&](std::size_t n) {
      const Hexahedron h = elements.hexahedron(look[n]);
      for (int j = 0; j <= steps && !folded[n]; ++j)
        for (int i = 0; i <= steps && !folded[n]; ++i) {
          const Eigen::Matrix3d slope = h.jacobian(double(i) / steps, double(j) / steps, 0.);
          folded[n] = slope.determinant() < least * slope.colwise().norm().prod();
        }
    });
    std::vector<std::uint32_t> moving;
    for (std::size_t n = 0; n < look.size(); ++n)
      if (folded[n])
        for (const std::uint32_t c : elements.elements[look[n]])
          if (!stays(c)) moving.push_back(c);
    moving = distinct(std::move(moving));
    std::vector<Place> ways(moving.size());
    parallel_for(moving.size(), 256, [&](std::size_t n) {
      Place sum = Place::Zero();
      double count = 0.;
      for (const std::uint32_t e : stars.of(moving[n])) {
        const auto& own = elements.elements[e];
        const auto at = int(std::find(own.begin(), own.end(), moving[n]) - own.begin());
        for (const auto& [u, v] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          const int i = at % 4 + u, j = at / 4 + v;
          if (i < 0 || i > 3 || j < 0 || j > 3) continue;
          sum += elements.curves[own[slot(i, j)]][0], count += 1.;
        }
      }
      ways[n] = sum / count - elements.curves[moving[n]][0];
    });
    for (std::size_t n = 0; n < moving.size(); ++n)
      for (std::size_t d = 0; d < 3; ++d)
        elements.curves[moving[n]][d] += double((3 - d) * (3 - d)) / 9. * ways[n];
    look.clear();
    for (const std::uint32_t c : moving)
      for (const std::uint32_t e : stars.of(c)) look.push_back(e);
    look = distinct(std::move(look));
  }
}

}  // namespace

Hexahedron Elements::hexahedron(std::size_t element) const {
  std::array<Eigen::Vector3d, 64> places;
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t c = 0; c < 16; ++c) places[16 * k + c] = curves[elements[element][c]][k];
  return through_lattice(places);
}

Elements make_elements(const Ribbon& ribbon, const Quads& quads, std::span<const Curvature> curvature,
                       const WCurves& curves, Progress& progress) {
  Elements result;
  result.corners = std::uint32_t(quads.middle.size());
  result.on_valley = quads.on_valley;
  std::vector<Place> starts = quads.middle;  // of all curves, on the middle
  std::map<Edge, std::uint32_t> first;       // of the two curves on a side, from the lower corner on
  for (const Quad& given : quads.quads) {
    // v along the fold.
    Quad q = given;
    const Triangle& t = ribbon.triangles[quads.points[q[0]].triangle];
    const Place fold = curvature[t[0]].along_least;
    const Place one = quads.middle[q[1]] - quads.middle[q[0]] + quads.middle[q[2]] - quads.middle[q[3]];
    const Place other = quads.middle[q[3]] - quads.middle[q[0]] + quads.middle[q[2]] - quads.middle[q[1]];
    if (std::abs(one.normalized().dot(fold)) < std::abs(other.normalized().dot(fold)))
      std::rotate(q.begin(), q.begin() + 1, q.end());
    std::array<std::uint32_t, 16> e{};
    e[slot(0, 0)] = q[0], e[slot(0, 3)] = q[1], e[slot(3, 3)] = q[2], e[slot(3, 0)] = q[3];
    for (const auto& side : sides) {
      const std::uint32_t a = e[side[0]], b = e[side[3]];
      const auto [at, fresh] = first.insert({std::minmax(a, b), std::uint32_t(starts.size())});
      if (fresh) {
        const Place low = starts[std::min(a, b)], high = starts[std::max(a, b)];
        starts.push_back(low + (high - low) / 3.), starts.push_back(low + (high - low) * (2. / 3.));
      }
      e[side[1]] = at->second + (a < b ? 0 : 1), e[side[2]] = at->second + (a < b ? 1 : 0);
    }
    for (int j = 1; j < 3; ++j)
      for (int i = 1; i < 3; ++i) {
        const double u = i / 3., v = j / 3.;
        e[slot(i, j)] = std::uint32_t(starts.size());
        starts.push_back((1. - u) * (1. - v) * starts[e[slot(0, 0)]] + u * (1. - v) * starts[e[slot(3, 0)]] +
                         (1. - u) * v * starts[e[slot(0, 3)]] + u * v * starts[e[slot(3, 3)]]);
      }
    result.elements.push_back(e);
  }

  const RibbonLocator locator(ribbon);
  std::vector<std::uint8_t> arrived(starts.size());
  result.curves.resize(starts.size());
  progress.begin("dropping the curves of elements", starts.size());
  parallel_ranges(starts.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const RibbonPoint point = c < result.corners ? quads.points[c] : locator.nearest(starts[c]);
      const WCurve curve = curve_at(ribbon, point, curves);
      for (std::size_t k = 0; k < 4; ++k) result.curves[c][k] = curve.at(double(k) / 3.);
      arrived[c] = curve.arrived;
    }
    progress.advance(end - begin);
  });
  progress.end();
  call_back_strays(result);
  for (const auto& [side, c] : first)
    for (std::size_t d = 0; d < 4; ++d)
      calm(result.curves[side.first][d], result.curves[c][d], result.curves[c + 1][d],
           result.curves[side.second][d]);
  parallel_for(result.size(), 256, [&](std::size_t e) {
    const auto at = [&](int i, int j, std::size_t d) -> Place& {
      return result.curves[result.elements[e][slot(i, j)]][d];
    };
    for (std::size_t d = 0; d < 4; ++d) {
      for (int j = 1; j < 3; ++j) calm(at(0, j, d), at(1, j, d), at(2, j, d), at(3, j, d));
      for (int i = 1; i < 3; ++i) calm(at(i, 0, d), at(i, 1, d), at(i, 2, d), at(i, 3, d));
    }
  });
  smooth_folded_faces(result);
  result.not_arrived = std::size_t(std::count(arrived.begin(), arrived.end(), 0));
  return result;
}

std::vector<std::uint32_t> uncertified(const Elements& elements, std::span<const std::uint32_t> of) {
  std::vector<std::uint8_t> bad(of.size(), 0);
  parallel_for(of.size(), 64,
               [&](std::size_t i) { bad[i] = !certify(elements.hexahedron(of[i])).positive(); });
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (bad[i]) result.push_back(of[i]);
  return result;
}

std::vector<std::uint32_t> uncertified(const Elements& elements) {
  std::vector<std::uint32_t> all(elements.size());
  std::iota(all.begin(), all.end(), 0u);
  return uncertified(elements, all);
}

}  // namespace forest::cortex
