// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/ribbon.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "forest/core/distinct.h"
#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/unions.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

Edge edge_of(const Triangle& t, std::size_t e) { return std::minmax(t[e], t[(e + 1) % 3]); }

double area_of(const std::vector<Place>& at, const Triangle& t) {
  return .5 * (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]).norm();
}

// Marks what no elements can be laid over: pieces of cortex within the wall that are smaller than a wall has to be. The largest one stays.
void close_islands(const Ribbon& ribbon, std::span<const double> areas, double least,
                   std::vector<std::uint8_t>& wall) {
  Unions pieces(ribbon.size());
  for (const Triangle& t : ribbon.triangles) {
    if (wall[t[0]] || wall[t[1]] || wall[t[2]]) continue;
    for (const std::size_t k : {1u, 2u}) pieces.join(t[0], t[k]);
  }
  std::vector<double> area(ribbon.size(), 0.);
  for (std::uint32_t v = 0; v < ribbon.size(); ++v)
    if (!wall[v]) area[pieces.root(v)] += areas[v];
  const double enough = area.empty() ? 0. : std::min(least, *std::max_element(area.begin(), area.end()));
  for (std::uint32_t v = 0; v < ribbon.size(); ++v)
    if (!wall[v] && area[pieces.root(v)] < enough) wall[v] = 1;
}

// Thin places that hang together over an area are a wall.
std::vector<std::uint8_t> find_wall(const Ribbon& ribbon, const RibbonOptions& options) {
  const std::size_t n = ribbon.size();
  std::vector<double> areas(n, 0.);
  for (const Triangle& t : ribbon.triangles)
    for (const std::uint32_t v : t) areas[v] += area_of(ribbon.outer, t) / 3.;
  const Neighbours near = neighbours(n, ribbon.triangles);
  std::vector<std::uint8_t> wall(n, 0), seen(n, 0);
  for (std::uint32_t start = 0; start < n; ++start) {
    if (seen[start] || double(ribbon.thickness[start]) >= options.least_thickness) continue;
    std::vector<std::uint32_t> piece{start};
    seen[start] = 1;
    double area = 0.;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      area += areas[piece[i]];
      for (const std::uint32_t v : near.of(piece[i]))
        if (!seen[v] && double(ribbon.thickness[v]) < options.least_thickness)
          seen[v] = 1, piece.push_back(v);
    }
    if (area >= options.least_wall)
      for (const std::uint32_t v : piece) wall[v] = 1;
  }
  close_islands(ribbon, areas, options.least_wall, wall);
  return wall;
}

}  // namespace

std::vector<Place> normals_of(std::span<const Place> places, std::span<const Triangle> triangles) {
  std::vector<Place> normals(places.size(), Place::Zero());
  for (const Triangle& t : triangles) {
    const Place across = (places[t[1]] - places[t[0]]).cross(places[t[2]] - places[t[0]]);
    for (const std::uint32_t v : t) normals[v] += across;
  }
  for (Place& n : normals) n.normalize();
  return normals;
}

Neighbours neighbours(std::size_t vertices, std::span<const Triangle> triangles) {
  Neighbours near;
  std::vector<std::uint32_t> counts(vertices + 1, 0);
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) counts[v + 1] += 2;
  std::partial_sum(counts.begin(), counts.end(), counts.begin());
  std::vector<std::uint32_t> all(counts.back()), next(counts.begin(), counts.end() - 1);
  for (const Triangle& t : triangles)
    for (std::size_t e = 0; e < 3; ++e)
      all[next[t[e]]++] = t[(e + 1) % 3], all[next[t[e]]++] = t[(e + 2) % 3];
  near.starts.assign(vertices + 1, 0);
  near.list.reserve(all.size() / 2);
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto begin = all.begin() + counts[v], end = all.begin() + counts[v + 1];
    std::sort(begin, end);
    near.list.insert(near.list.end(), begin, std::unique(begin, end));
    near.starts[v + 1] = std::uint32_t(near.list.size());
  }
  return near;
}

Mesh halved(const Mesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e) edges.push_back(edge_of(t, e));
  edges = distinct(std::move(edges));
  Mesh fine{mesh.positions, mesh.labels, {}};
  const auto old = std::uint32_t(mesh.positions.size());
  for (const auto& [a, b] : edges) fine.positions.push_back(.5f * (mesh.positions[a] + mesh.positions[b]));
  fine.labels.resize(fine.positions.size(), 0);
  fine.triangles.reserve(mesh.triangles.size() * 4);
  for (const Triangle& t : mesh.triangles) {
    std::array<std::uint32_t, 3> middle{};  // of the edges that begin at each corner
    for (std::size_t e = 0; e < 3; ++e)
      middle[e] =
          old + std::uint32_t(std::lower_bound(edges.begin(), edges.end(), edge_of(t, e)) - edges.begin());
    for (std::size_t e = 0; e < 3; ++e) fine.triangles.push_back({t[e], middle[e], middle[(e + 2) % 3]});
    fine.triangles.push_back({middle[0], middle[1], middle[2]});
  }
  return fine;
}

Ribbon coarser(const Ribbon& ribbon) {
  if (ribbon.halvings == 0) return ribbon;
  Ribbon result;
  result.halvings = ribbon.halvings - 1;
  // As `halved` leaves them: of each four triangles the first three begin at the old one's corners, which come first of all.
  std::uint32_t last = 0;
  for (std::size_t i = 0; i + 3 < ribbon.triangles.size(); i += 4) {
    const auto* four = &ribbon.triangles[i];
    result.triangles.push_back({four[0][0], four[1][0], four[2][0]});
    for (const std::uint32_t v : result.triangles.back()) last = std::max(last, v);
  }
  const auto first_of = [&](const auto& all) {
    return std::decay_t<decltype(all)>(all.begin(), all.begin() + last + 1);
  };
  result.outer = first_of(ribbon.outer), result.middle = first_of(ribbon.middle),
  result.inner = first_of(ribbon.inner);
  result.thickness = first_of(ribbon.thickness), result.wall = first_of(ribbon.wall);
  return result;
}

Place on(const std::vector<Place>& level, const Ribbon& ribbon, const RibbonPoint& point) {
  const Triangle& t = ribbon.triangles[point.triangle];
  return point.weights[0] * level[t[0]] + point.weights[1] * level[t[1]] + point.weights[2] * level[t[2]];
}

namespace {

std::vector<std::uint32_t> outside_wall(const Ribbon& ribbon) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t t = 0; t < ribbon.triangles.size(); ++t)
    if (!ribbon.is_wall(ribbon.triangles[t])) list.push_back(t);
  return list;
}

Mesh level_of(const Ribbon& ribbon, const std::vector<Place>& level,
              std::span<const std::uint32_t> triangles) {
  Mesh mesh;
  mesh.positions.reserve(ribbon.size());
  for (const Place& p : level) mesh.positions.push_back(p.cast<float>());
  for (const std::uint32_t t : triangles) mesh.triangles.push_back(ribbon.triangles[t]);
  return mesh;
}

}  // namespace

RibbonLocator::RibbonLocator(const Ribbon& ribbon) : RibbonLocator(ribbon, ribbon.middle) {}

RibbonLocator::RibbonLocator(const Ribbon& ribbon, const std::vector<Place>& level)
    : ribbon_(ribbon),
      level_(level),
      original_(outside_wall(ribbon)),
      tree_(level_of(ribbon, level, original_)) {}

RibbonPoint RibbonLocator::nearest(const Place& to) const {
  const auto hit = tree_.nearest(to);
  const Triangle& t = ribbon_.triangles[original_[hit->triangle]];
  return {original_[hit->triangle], barycentric(level_[t[0]], level_[t[1]], level_[t[2]], hit->at)};
}

Ribbon make_ribbon(const Mesh& outer, const WCurves& curves, const RibbonOptions& options,
                   Progress& progress) {
  Mesh fine = outer;
  Ribbon ribbon;
  for (; mean_edge(fine) > options.edge; ++ribbon.halvings) fine = halved(fine);
  const std::size_t n = fine.positions.size();
  ribbon.triangles = fine.triangles;
  ribbon.outer.resize(n), ribbon.middle.resize(n), ribbon.inner.resize(n), ribbon.thickness.resize(n);
  const std::vector<Vec3> normals = vertex_normals(fine);
  std::vector<std::uint8_t> arrived(n);
  progress.begin("dropping w-curves", n);
  parallel_ranges(n, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      ribbon.outer[v] = fine.positions[v].cast<double>();
      const WCurve curve = curves.drop(ribbon.outer[v], -normals[v].cast<double>());
      ribbon.middle[v] = curve.at(.5), ribbon.inner[v] = curve.points.back();
      ribbon.thickness[v] = float(std::min(curve.length(), curves.straight_way(ribbon.outer[v])));
      arrived[v] = curve.arrived;
    }
    progress.advance(end - begin);
  });
  progress.end();
  ribbon.wall = find_wall(ribbon, options);
  std::vector<std::size_t> lost;
  std::vector<std::uint8_t> used(n, 0);  // a vertex of no triangle is no part of the surface
  for (const Triangle& t : ribbon.triangles)
    for (const std::uint32_t v : t) used[v] = 1;
  for (std::size_t v = 0; v < n; ++v)
    if (used[v] && !arrived[v] && !ribbon.wall[v]) lost.push_back(v);
  if (lost.size() * 100 > n) {
    const Place& first = ribbon.outer[lost.front()];
    throw Error(fmt::format(
        "{} of {} w-curves do not reach the inner surface, the first from ({:.1f}, {:.1f}, {:.1f}) "
        "mm; check that both surfaces are of one hemisphere and in the same coordinates",
        lost.size(), n, first[0] / 1e3, first[1] / 1e3, first[2] / 1e3));
  }
  return ribbon;
}

WCurve curve_at(const Ribbon& ribbon, const RibbonPoint& point, const WCurves& curves) {
  const Place outer = on(ribbon.outer, ribbon, point), inward = on(ribbon.inner, ribbon, point) - outer;
  if (auto curve = curves.through(on(ribbon.middle, ribbon, point), inward); curve && curve->arrived)
    return *std::move(curve);
  return curves.drop(outer, inward);
}

Ribbon unfolded(Ribbon ribbon, const WCurves& curves, Progress& progress) {
  constexpr int turns = 3, passes = 30, rounds = 20;
  constexpr double least_height =
      .02;  // of a triangle of the middle: twice its area by the square of its longest side
  // What is crumpled spreads no farther than that, µm: with all its surroundings it would slide off the end of a pocket.
  constexpr double farthest = 1200.;
  const std::size_t n = ribbon.size();
  const Neighbours near = neighbours(n, ribbon.triangles);
  const std::vector<Place> start = ribbon.middle;
  std::vector<std::uint8_t> fixed = ribbon.wall;
  for (const Triangle& t : ribbon.triangles)
    if (ribbon.is_wall(t)) fixed[t[0]] = fixed[t[1]] = fixed[t[2]] = 1;
  std::vector<Place> up(n), next(n);
  const auto look_up = [&] {  // where curves come from, smoothed
    for (std::size_t v = 0; v < n; ++v) up[v] = (ribbon.outer[v] - ribbon.inner[v]).normalized();
    for (int round = 0; round < 5; ++round) {
      parallel_for(n, 1024, [&](std::size_t v) {
        Place sum = up[v];
        for (const std::uint32_t other : near.of(std::uint32_t(v))) sum += up[other];
        next[v] = sum.normalized();
      });
      up.swap(next);
    }
  };
  const auto folded = [&](const Triangle& t) {
    const Place a = ribbon.middle[t[1]] - ribbon.middle[t[0]], b = ribbon.middle[t[2]] - ribbon.middle[t[0]];
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    return a.cross(b).dot((up[t[0]] + up[t[1]] + up[t[2]]).normalized()) < least_height * longest;
  };
  progress.begin("unfolding the middle", 0);
  for (int turn = 0; turn < turns; ++turn) {
    look_up();
    std::vector<std::uint32_t> moved;
    for (int pass = 0; pass < passes; ++pass) {
      std::vector<std::uint32_t> moving;
      for (const Triangle& t : ribbon.triangles) {
        if (ribbon.is_wall(t) || !folded(t)) continue;
        for (const std::uint32_t v : t) {
          moving.push_back(v);
          std::ranges::copy(near.of(v), std::back_inserter(moving));
        }
      }
      moving = distinct(std::move(moving));
      std::erase_if(moving, [&](std::uint32_t v) { return fixed[v] != 0; });
      if (moving.empty()) break;
      for (int round = 0; round < rounds; ++round) {
        parallel_for(moving.size(), 1024, [&](std::size_t i) {
          const std::uint32_t v = moving[i];
          Place mean = Place::Zero();
          for (const std::uint32_t other : near.of(v)) mean += ribbon.middle[other];
          const Place way = .7 * (mean / double(near.of(v).size()) - ribbon.middle[v]);
          next[v] = ribbon.middle[v] + way - up[v] * up[v].dot(way);
          if (const Place off = next[v] - start[v]; off.norm() > farthest)
            next[v] = start[v] + farthest * off.normalized();
        });
        for (const std::uint32_t v : moving) ribbon.middle[v] = next[v];
      }
      std::ranges::copy(moving, std::back_inserter(moved));
      progress.advance();
    }
    moved = distinct(std::move(moved));
    parallel_for(moved.size(), 64, [&](std::size_t i) {
      const std::uint32_t v = moved[i];
      const auto curve = curves.through(ribbon.middle[v], -up[v]);
      if (!curve || !curve->arrived) return;
      ribbon.outer[v] = curve->points.front(), ribbon.inner[v] = curve->points.back();
      if (turn + 1 < turns) ribbon.middle[v] = curve->at(.5);  // again half way down, which may fold a little
    });
  }
  progress.end();
  return ribbon;
}

double volume_under(const Ribbon& ribbon, const Triangle& triangle) {
  // A prism between two levels as three tetrahedra, cut along diagonals from the corner of the lowest number, as the
  // neighbours' are.
  Triangle t = triangle;
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  const auto tetrahedron = [](const Place& a, const Place& b, const Place& c, const Place& d) {
    return (b - a).cross(c - a).dot(d - a) / 6.;
  };
  const auto prism = [&](const std::vector<Place>& top, const std::vector<Place>& bottom) {
    const Place &a = top[t[0]], &b = top[t[1]], &c = top[t[2]], &A = bottom[t[0]], &B = bottom[t[1]],
                &C = bottom[t[2]];
    // The side over (b, c) is cut from the lower of its two corners on top.
    return tetrahedron(A, B, C, a) + (t[1] < t[2] ? tetrahedron(a, b, c, C) * -1. + tetrahedron(a, B, C, b)
                                                  : tetrahedron(a, b, c, B) * -1. + tetrahedron(a, B, C, c));
  };
  return prism(ribbon.outer, ribbon.middle) + prism(ribbon.middle, ribbon.inner);
}

}  // namespace forest::cortex
