// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/elements.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::cortex {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

void towards(Place& place, double share, const Place& aim) { place += share * (aim - place); }

std::vector<std::uint32_t> distinct(std::vector<std::uint32_t> list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

// Of every curve the elements that it belongs to.
using Owners = std::vector<std::vector<std::uint32_t>>;
Owners owners_of(const Elements& elements) {
  Owners of(elements.curves.size());
  for (std::uint32_t e = 0; e < elements.size(); ++e)
    for (const std::uint32_t c : elements.elements[e]) of[c].push_back(e);
  return of;
}

// Some elements, with all that share a corner with them.
std::vector<std::uint32_t> widened(const Elements& elements, const Owners& of,
                                   std::span<const std::uint32_t> list) {
  std::vector<std::uint32_t> wide;
  for (const std::uint32_t e : list)
    for (const std::uint32_t c : elements.corners_of(e)) wide.insert(wide.end(), of[c].begin(), of[c].end());
  return distinct(std::move(wide));
}

// A cubic through four places swings widely where they zigzag: what the two inner ones deviate from the straight way in
// opposite directions comes out four and a half times as large in its control points, three times as much as what they deviate
// alike. A third of it is kept, which makes no difference on a smooth surface and some µm at a crease.
void calm(const Place& first, Place& second, Place& third, const Place& last) {
  const Place one = second - (2. * first + last) / 3., two = third - (first + 2. * last) / 3.;
  const Place zigzag = (one - two) / 2.;
  second -= zigzag * (2. / 3.), third += zigzag * (2. / 3.);
}

constexpr std::size_t slot(int i, int j) { return std::size_t(i + 4 * j); }
// The slots of the four sides from their first corner to their last, and the corners.
constexpr std::array<std::array<std::size_t, 4>, 4> sides{{{slot(0, 0), slot(1, 0), slot(2, 0), slot(3, 0)},
                                                           {slot(0, 3), slot(1, 3), slot(2, 3), slot(3, 3)},
                                                           {slot(0, 0), slot(0, 1), slot(0, 2), slot(0, 3)},
                                                           {slot(3, 0), slot(3, 1), slot(3, 2), slot(3, 3)}}};

// Corners of sides that only one element has.
std::vector<std::uint8_t> by_the_wall(const Elements& elements) {
  std::vector<std::uint8_t> rim(elements.corners, 0);
  std::map<Edge, int> met;
  for (const auto& e : elements.elements)
    for (const auto& side : sides) ++met[std::minmax(e[side[0]], e[side[3]])];
  for (const auto& [side, count] : met)
    if (count == 1) rim[side.first] = rim[side.second] = 1;
  return rim;
}

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
  const Owners of = owners_of(elements);
  const std::vector<std::uint8_t> rim = by_the_wall(elements);
  const auto stays = [&](std::uint32_t c) {  // corners by the wall, and what is between them on a side
    if (c < elements.corners) return rim[c] != 0;
    const auto& own = elements.elements[of[c][0]];
    const auto at = std::find(own.begin(), own.end(), c) - own.begin();
    return of[c].size() == 1 && (at % 4 % 3 == 0 || at / 4 % 3 == 0);
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
      for (const std::uint32_t e : of[moving[n]]) {
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
    for (const std::uint32_t c : moving) look.insert(look.end(), of[c].begin(), of[c].end());
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

void fit_faces(Elements& elements, const TriangleTree& outer, const TriangleTree& inner) {
  constexpr double reach = 300.;  // µm
  const std::vector<Depths> before = elements.curves;
  // What an element must keep: validity, and a good shape, or the one it had.
  constexpr double good = .5;
  std::vector<double> least(elements.size(), -1.);
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const Hexahedron h = elements.hexahedron(e);
    if (certify(h).positive()) least[e] = std::min(good, scaled_jacobian(h));
  });
  constexpr std::array<double, 3> at{1. / 6., .5, 5. / 6.};
  for (const std::size_t d : {std::size_t(0), std::size_t(3)}) {
    const TriangleTree& surface = d == 0 ? outer : inner;
    for (int round = 0; round < 2; ++round) {
      std::vector<Place> off(elements.size());  // the mean way from the face to the surface
      parallel_for(elements.size(), 64, [&](std::size_t e) {
        std::array<Place, 16> places;
        for (std::size_t c = 0; c < 16; ++c) places[c] = elements.curves[elements.elements[e][c]][d];
        const Patch patch = through_lattice(places);
        const Place outwards =
            elements.curves[elements.elements[e][5]][0] - elements.curves[elements.elements[e][5]][3];
        Place sum = Place::Zero();
        for (const double u : at)
          for (const double v : at) {
            const Place p = patch.at(u, v);
            const auto hit = surface.nearest(p, reach);
            if (!hit) continue;
            const Place n = surface.normal(hit->triangle);
            if (n.dot(outwards) > 0.) sum += n * n.dot(hit->at - p);
          }
        off[e] = sum / 9.;
      });
      std::vector<Place> move(elements.curves.size(), Place::Zero());
      std::vector<std::uint8_t> times(elements.curves.size(), 0);
      for (std::size_t e = 0; e < elements.size(); ++e)
        for (const std::uint32_t c : elements.elements[e])
          if (c >= elements.corners) move[c] += off[e], ++times[c];
      for (std::size_t c = elements.corners; c < move.size(); ++c)
        if (times[c]) elements.curves[c][d] += move[c] / double(times[c]);
    }
  }
  for (bool all = false; !all;) {
    std::vector<std::uint8_t> lost(elements.size(), 0);
    parallel_for(elements.size(), 64, [&](std::size_t e) {
      if (least[e] < 0.) return;
      const Hexahedron h = elements.hexahedron(e);
      lost[e] = scaled_jacobian(h) < least[e] || !certify(h).positive();
    });
    all = true;
    for (std::size_t e = 0; e < elements.size(); ++e) {
      if (!lost[e]) continue;
      least[e] = -1., all = false;
      for (const std::uint32_t c : elements.elements[e]) elements.curves[c] = before[c];
    }
  }
}

Mending mend(Elements& elements, const TriangleTree& outer, const TriangleTree& inner, Progress& progress) {
  constexpr int rounds_of_sides = 6, rounds_of_corners = 80;
  constexpr double farthest_way = 1e3;  // µm
  Mending result;
  const Owners of = owners_of(elements);
  const std::vector<Depths> before = elements.curves;
  std::vector<std::uint8_t> moved(elements.curves.size(), 0);
  progress.begin("untangling", 0);
  std::vector<std::uint32_t> bad = uncertified(elements);
  result.before = bad.size();

  // Not to the other bank of a sulcus or a gyrus: near, and facing the same way.
  const auto keep_on_surface = [&](Depths& curve) {
    constexpr double reach = 500.;
    const Place outwards = curve[0] - curve[3];
    if (const auto hit = outer.nearest(curve[0], reach);
        hit && outer.normal(hit->triangle).dot(outwards) > 0.)
      curve[0] = hit->at;
    if (const auto hit = inner.nearest(curve[3], reach);
        hit && inner.normal(hit->triangle).dot(outwards) > 0.)
      curve[3] = hit->at;
  };
  // Half way to straight sides, three quarters, … and wholly.
  std::vector<std::uint8_t> times(elements.size(), 0);
  const auto straighten = [&](std::uint32_t element) {
    const double much = ++times[element] < 4 ? .5 : 1.;
    const auto& e = elements.elements[element];
    for (const auto& side : sides)
      for (std::size_t k = 1; k < 3; ++k) {
        const double share = double(k) / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          towards(elements.curves[e[side[k]]][d], much,
                  (1. - share) * elements.curves[e[side[0]]][d] + share * elements.curves[e[side[3]]][d]);
        moved[e[side[k]]] = 1;
      }
    for (int j = 1; j < 3; ++j)
      for (int i = 1; i < 3; ++i) {
        const double u = i / 3., v = j / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          towards(elements.curves[e[slot(i, j)]][d], much,
                  (1. - u) * (1. - v) * elements.curves[e[slot(0, 0)]][d] +
                      u * (1. - v) * elements.curves[e[slot(3, 0)]][d] +
                      (1. - u) * v * elements.curves[e[slot(0, 3)]][d] +
                      u * v * elements.curves[e[slot(3, 3)]][d]);
        moved[e[slot(i, j)]] = 1;
      }
  };
  const auto spread = [&](std::span<const std::uint32_t> list) { return widened(elements, of, list); };
  for (int round = 0; round < rounds_of_sides && !bad.empty(); ++round) {
    for (const std::uint32_t e : bad) straighten(e);
    bad = uncertified(elements, spread(bad));
    progress.advance();
  }

  // What is left is few: corners look for a better place each, as long as the worst element around them gains.
  const std::vector<std::uint8_t> rim = by_the_wall(elements);
  const double mean_volume = [&] {
    double sum = 0.;
    for (std::uint32_t e = 0; e < elements.size(); e += 1 + std::uint32_t(elements.size() / 1000))
      sum += elements.hexahedron(e).volume();
    return sum / std::min<double>(double(elements.size()), 1000.);
  }();
  const auto worth = [&](const std::vector<std::uint32_t>& star) {
    double least = 1e300;
    for (const std::uint32_t e : star) {
      const Hexahedron h = elements.hexahedron(e);
      const Coefficients c = determinant(h);
      least = std::min(
          least, *std::min_element(c.begin(), c.end()) / std::max(std::abs(h.volume()), .1 * mean_volume));
    }
    return least;
  };
  for (int round = 0; round < rounds_of_corners && !bad.empty(); ++round) {
    for (const std::uint32_t e : bad)
      straighten(e);  // a neighbour's sides became straight, and its own inside is not
    bad = uncertified(elements, spread(bad));
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t e : bad)
      for (const std::uint32_t c : elements.corners_of(e)) corners.push_back(c);
    for (const std::uint32_t c : distinct(std::move(corners))) {
      const std::vector<std::uint32_t>& star = of[c];
      std::vector<std::uint32_t> own;  // all curves that a move of this corner may change
      for (const std::uint32_t e : star)
        own.insert(own.end(), elements.elements[e].begin(), elements.elements[e].end());
      own = distinct(std::move(own));
      std::vector<Depths> kept;
      for (const std::uint32_t k : own) kept.push_back(elements.curves[k]);
      const Depths start = elements.curves[c];
      double best = worth(star);
      Depths mean{Place::Zero(), Place::Zero(), Place::Zero(), Place::Zero()};
      double count = 0.;
      for (const std::uint32_t e : star) {
        const auto at = elements.corners_of(e);
        const std::size_t k = std::size_t(std::find(at.begin(), at.end(), c) - at.begin());
        for (const std::size_t other : {k ^ 1u, k ^ 2u}) {
          for (std::size_t d = 0; d < 4; ++d) mean[d] += elements.curves[at[other]][d];
          count += 1.;
        }
      }
      for (std::size_t d = 0; d < 4; ++d) mean[d] /= count;
      const double reach = (mean[1] - start[1]).norm() + .1 * (start[0] - start[3]).norm();
      Random random(1, c, std::uint32_t(round));
      std::vector<Depths> better;
      constexpr int tries = 40;
      for (int t = 0; t < tries; ++t) {
        Depths next = start;
        if (t < 4 && !rim[c])
          for (std::size_t d = 0; d < 4; ++d) towards(next[d], .25 * double(t + 1), mean[d]);
        else if (t < 7) {  // less bent from depth to depth
          const Place one = (2. * next[0] + next[3]) / 3., two = (next[0] + 2. * next[3]) / 3.;
          if (t == 4) calm(next[0], next[1], next[2], next[3]);
          towards(next[1],
                  t == 5   ? .5
                  : t == 6 ? 1.
                           : 0.,
                  one),
              towards(next[2],
                      t == 5   ? .5
                      : t == 6 ? 1.
                               : 0.,
                      two);
        } else {
          const Place way(random.normal(), random.normal(), random.normal());
          const Place turn(random.normal(), random.normal(), random.normal());
          // All depths alike and turned, or only some: those near one surface, or a single one.
          const std::size_t first = t % 3 == 0 ? 0 : std::size_t(random.below(4));
          const std::size_t last = t % 3 == 0 ? 3 : t % 3 == 1 ? first : first < 2 ? 1 : 3;
          const double size = (t & 1) ? .15 : .04;
          for (std::size_t d = std::min(first, last); d <= last; ++d)
            next[d] += size * reach * (way + (double(d) / 1.5 - 1.) * turn);
        }
        keep_on_surface(next);
        bool near = true;
        for (std::size_t d = 0; d < 4; ++d) near = near && (next[d] - before[c][d]).norm() < farthest_way;
        if (!near) continue;
        elements.curves[c] = next;
        for (const std::uint32_t e : star) times[e] = 4, straighten(e);
        if (const double now = worth(star); now > best) {
          best = now, better.clear();
          for (const std::uint32_t k : own) better.push_back(elements.curves[k]);
        }
        for (std::size_t k = 0; k < own.size(); ++k) elements.curves[own[k]] = kept[k];
      }
      for (std::size_t k = 0; k < better.size(); ++k) elements.curves[own[k]] = better[k], moved[own[k]] = 1;
    }
    bad = uncertified(elements, spread(spread(bad)));  // sides of the stars' rims changed, too
    progress.advance();
  }
  progress.end();
  result.after = bad.size();
  for (std::size_t c = 0; c < moved.size(); ++c) {
    if (!moved[c]) continue;
    ++result.moved;
    for (std::size_t d = 0; d < 4; ++d)
      result.farthest = std::max(result.farthest, (elements.curves[c][d] - before[c][d]).norm());
  }
  return result;
}

void even_out(Elements& elements, std::span<const std::uint32_t> tangled, int rings) {
  constexpr int rounds = 300;
  const Owners of = owners_of(elements);
  std::vector<std::uint32_t> heap(tangled.begin(), tangled.end());
  std::vector<std::uint8_t> in_heap(elements.size(), 0);
  for (int ring = 0; ring < rings; ++ring) heap = widened(elements, of, heap);
  for (const std::uint32_t e : heap) in_heap[e] = 1;
  const std::vector<std::uint8_t> rim = by_the_wall(elements);
  const auto inside = [&](std::uint32_t c) {
    return std::ranges::all_of(of[c], [&](std::uint32_t e) { return in_heap[e] != 0; });
  };
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t e : heap)
    for (const std::uint32_t c : elements.corners_of(e))
      if (!rim[c] && inside(c)) corners.push_back(c);
  corners = distinct(std::move(corners));
  std::vector<std::vector<std::uint32_t>> near(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const std::uint32_t e : of[corners[i]])
      for (const auto& side : sides) {
        const std::uint32_t a = elements.elements[e][side[0]], b = elements.elements[e][side[3]];
        if (a == corners[i]) near[i].push_back(b);
        if (b == corners[i]) near[i].push_back(a);
      }
    near[i] = distinct(std::move(near[i]));
  }
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < corners.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d) {
        Place sum = Place::Zero();
        for (const std::uint32_t c : near[i]) sum += elements.curves[c][d];
        elements.curves[corners[i]][d] = sum / double(near[i].size());
      }
  for (const std::uint32_t e : heap) {
    const auto& own = elements.elements[e];
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const std::uint32_t c = own[slot(i, j)];
        const bool corner = i % 3 == 0 && j % 3 == 0, middle = i % 3 != 0 && j % 3 != 0;
        if (corner || (!middle && (of[c].size() < 2 || !inside(c)))) continue;
        const double u = i / 3., v = j / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          elements.curves[c][d] =
              (1. - v) *
                  ((1. - u) * elements.curves[own[slot(0, 0)]][d] + u * elements.curves[own[slot(3, 0)]][d]) +
              v * ((1. - u) * elements.curves[own[slot(0, 3)]][d] + u * elements.curves[own[slot(3, 3)]][d]);
      }
  }
}

LeftOut leave_out(Elements& elements, double least) {
  constexpr double no_tissue = 400.;  // µm: cortex is nowhere so thin
  LeftOut result;
  std::vector<std::uint8_t> rim = by_the_wall(elements);
  for (std::uint32_t c = 0; c < elements.corners; ++c)
    if ((elements.curves[c][0] - elements.curves[c][3]).norm() < no_tissue) rim[c] = 1;
  std::vector<std::uint8_t> bad(elements.size(), 0), gone(elements.size(), 0);
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const Hexahedron h = elements.hexahedron(e);
    bad[e] = scaled_jacobian(h) < least || !certify(h).positive();
  });
  for (bool more = true; more;) {
    more = false;
    for (std::size_t e = 0; e < elements.size(); ++e) {
      const auto corners = elements.corners_of(e);
      if (!bad[e] || gone[e] || std::ranges::none_of(corners, [&](std::uint32_t c) { return rim[c] != 0; }))
        continue;
      gone[e] = 1, more = true;
      for (const std::uint32_t c : corners) rim[c] = 1;
      ++result.elements, result.volume += elements.hexahedron(e).volume();
    }
  }
  std::size_t kept = 0;
  for (std::size_t e = 0; e < elements.size(); ++e)
    if (!gone[e]) elements.elements[kept++] = elements.elements[e];
  elements.elements.resize(kept);
  return result;
}

}  // namespace forest::cortex
