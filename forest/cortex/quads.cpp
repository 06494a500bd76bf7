// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/quads.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/valence.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

using Complex = std::complex<double>;

// Where a line passes by a vertex: the nearest place on it and its direction.
struct Pass {
  Place at, along;
  Line::Kind kind;

  bool holds() const { return kind != Line::Kind::crest; }  // sides of elements lie on it
};

std::vector<std::optional<Pass>> passes(const Ribbon& ribbon, std::span<const Line> lines) {
  std::vector<std::optional<Pass>> by(ribbon.size());
  for (const Line& line : lines) {  // the strongest first
    const std::size_t n = line.points.size();
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Place along = line.direction(i);
      if (along.squaredNorm() == 0.) continue;
      for (const std::uint32_t v : ribbon.triangles[line.triangles[i]]) {
        const Place a = line.points[i], way = line.points[i + 1] - a;
        const double share = way.squaredNorm() > 0.
                                 ? std::clamp((ribbon.middle[v] - a).dot(way) / way.squaredNorm(), 0., 1.)
                                 : 0.;
        const Place at = a + share * way;
        if (!by[v] || (by[v]->kind == line.kind &&
                       (by[v]->at - ribbon.middle[v]).norm() > (at - ribbon.middle[v]).norm()))
          by[v] = Pass{at, along, line.kind};
      }
    }
  }
  return by;
}

}  // namespace

std::vector<Place> crosses(const Ribbon& ribbon, const Neighbours& near, std::span<const Curvature> curvature,
                           std::span<const Line> lines) {
  // A cross is a complex number: four times its angle in a frame of the vertex. A neighbour's is turned into this frame by
  // the least rotation that takes the one normal to the other.
  const std::size_t n = ribbon.size();
  std::vector<Place> axis(n);
  for (std::size_t v = 0; v < n; ++v) axis[v] = curvature[v].normal.unitOrthogonal();
  const auto angle_of = [&](std::size_t v, const Place& direction) {
    const Place up = curvature[v].normal.cross(axis[v]);
    return std::atan2(direction.dot(up), direction.dot(axis[v]));
  };
  std::vector<Complex> turns(near.list.size());
  parallel_for(n, 2048, [&](std::size_t v) {
    for (std::uint32_t e = near.starts[v]; e < near.starts[v + 1]; ++e) {
      const std::uint32_t w = near.list[e];
      const Place& from = curvature[w].normal;
      const Place& to = curvature[v].normal;
      const Place turned = from.squaredNorm() > 0. && to.squaredNorm() > 0. && from.dot(to) > -.99
                               ? Place(Eigen::Quaterniond::FromTwoVectors(from, to) * axis[w])
                               : axis[w];
      turns[e] = std::polar(1., 4. * angle_of(v, turned));
    }
  });
  // What a vertex wants, and how much.
  double mean = 0.;
  for (const Curvature& c : curvature) mean += std::pow(c.most - c.least, 2) / double(n);
  std::vector<Complex> wanted(n);
  std::vector<double> weight(n);
  const auto by = passes(ribbon, lines);
  for (std::size_t v = 0; v < n; ++v) {
    const Curvature& c = curvature[v];
    weight[v] = .02 * std::min(4., mean > 0. ? std::pow(c.most - c.least, 2) / mean : 0.);
    Place along = c.along_most;
    if (by[v]) along = by[v]->along, weight[v] = 50.;
    wanted[v] = std::polar(1., 4. * angle_of(v, along));
  }
  // (degree + weight) z - sum of turned neighbours = weight · wanted, by conjugate gradients with the diagonal before them.
  const auto apply = [&](const std::vector<Complex>& z, std::vector<Complex>& out) {
    parallel_for(n, 4096, [&](std::size_t v) {
      Complex sum = (weight[v] + double(near.starts[v + 1] - near.starts[v])) * z[v];
      for (std::uint32_t e = near.starts[v]; e < near.starts[v + 1]; ++e) sum -= turns[e] * z[near.list[e]];
      out[v] = sum;
    });
  };
  const auto dot = [&](const std::vector<Complex>& a, const std::vector<Complex>& b) {
    double sum = 0.;
    for (std::size_t v = 0; v < n; ++v) sum += a[v].real() * b[v].real() + a[v].imag() * b[v].imag();
    return sum;
  };
  std::vector<Complex> z = wanted, r(n), p(n), q(n), s(n);
  apply(z, q);
  const auto before = [&](std::size_t v) {
    return weight[v] + double(near.starts[v + 1] - near.starts[v]) + 1e-9;
  };
  for (std::size_t v = 0; v < n; ++v)
    r[v] = weight[v] * wanted[v] - q[v], s[v] = r[v] / before(v), p[v] = s[v];
  double rs = dot(r, s);
  const double enough = rs * 1e-8;
  for (int round = 0; round < 400 && rs > enough && rs > 0.; ++round) {
    apply(p, q);
    const double alpha = rs / dot(p, q);
    for (std::size_t v = 0; v < n; ++v) z[v] += alpha * p[v], r[v] -= alpha * q[v], s[v] = r[v] / before(v);
    const double next = dot(r, s);
    for (std::size_t v = 0; v < n; ++v) p[v] = s[v] + next / rs * p[v];
    rs = next;
  }
  std::vector<Place> result(n);
  for (std::size_t v = 0; v < n; ++v) {
    const double angle = std::arg(z[v]) / 4.;
    result[v] = std::cos(angle) * axis[v] + std::sin(angle) * curvature[v].normal.cross(axis[v]);
  }
  return result;
}

namespace {

// ---- The lattice field ---------------------------------------------------------------------------------------------------

// A vertex of one level of the hierarchy, and the lattice seen from it.
struct Site {
  Place at, normal, along;  // along: one arm of its cross
  double spacing, area;
  Place point;  // a point of the lattice, the nearest
  std::optional<Pass> line;

  Place up() const { return normal.cross(along); }
  Place rounded(const Place& from,
                const Place& to) const {  // the lattice point next to `to` of the lattice with `from`
    const Place d = to - from;
    return from + along * (std::floor(along.dot(d) / spacing + .5) * spacing) +
           up() * (std::floor(up().dot(d) / spacing + .5) * spacing);
  }
};

struct Level {
  std::vector<Site> sites;
  std::vector<std::uint32_t> starts, list;
  std::vector<float> weights;
  std::vector<std::uint32_t> coarser;  // of each site, in the next level
};

// Where the tangent planes of two sites meet, nearest to both.
Place between(const Site& a, const Site& b) {
  const double ab = a.normal.dot(b.normal), da = a.normal.dot(b.at - a.at), db = b.normal.dot(a.at - b.at);
  const double f = 1. / (1. - ab * ab + 1e-4);
  const double la = 2. * (da - ab * db) * f, lb = 2. * (db - ab * da) * f;
  return .5 * (a.at + b.at) + .25 * (a.normal * la + b.normal * lb);
}

// The pair of points of both lattices, near the middle of the two sites, that lie nearest to each other.
struct Agreement {
  Place one, other;
  Eigen::Vector2i from_one, from_other;  // steps along and up from each site's own point
};
Agreement agree(const Site& a, const Place& a_point, const Site& b, const Place& b_point) {
  const Place middle = between(a, b);
  struct Corner {
    Place at[4];
    Eigen::Vector2i steps[4];
  };
  const auto corners = [&](const Site& s, const Place& point) {
    Corner c;
    const Place d = middle - point, up = s.up();
    const int x = int(std::floor(s.along.dot(d) / s.spacing)), y = int(std::floor(up.dot(d) / s.spacing));
    for (int i = 0; i < 4; ++i) {
      c.steps[i] = {x + (i & 1), y + (i >> 1)};
      c.at[i] = point + s.spacing * (double(c.steps[i].x()) * s.along + double(c.steps[i].y()) * up);
    }
    return c;
  };
  const Corner ca = corners(a, a_point), cb = corners(b, b_point);
  Agreement best;
  double least = 1e300;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (const double d = (ca.at[i] - cb.at[j]).squaredNorm(); d < least)
        least = d, best = {ca.at[i], cb.at[j], ca.steps[i], cb.steps[j]};
  return best;
}

void hold_to_line(const Site& site, Place& point) {
  if (!site.line || !site.line->holds()) return;
  const Place side = site.normal.cross(site.line->along);
  if (side.squaredNorm() > 0.) point += side * side.dot(site.line->at - point) / side.squaredNorm();
}

void settle(Level& level, int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < level.sites.size(); ++i) {
      Site& site = level.sites[i];
      Place sum = site.point;
      double weights = 0.;
      for (std::uint32_t e = level.starts[i]; e < level.starts[i + 1]; ++e) {
        const Site& other = level.sites[level.list[e]];
        const Agreement agreed = agree(site, sum, other, other.point);
        const double w = double(level.weights[e]);
        sum = (weights * agreed.one + w * agreed.other) / (weights + w);
        weights += w;
        sum -= site.normal * site.normal.dot(sum - site.at);
      }
      if (weights == 0.) continue;
      hold_to_line(site, sum);
      site.point = site.rounded(sum, site.at);
    }
}

Level coarser(Level& fine) {
  const std::size_t n = fine.sites.size();
  constexpr std::uint32_t none = ~0u;
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t e = fine.starts[i]; e < fine.starts[i + 1]; ++e) {
      const std::uint32_t j = fine.list[e];
      if (j <= i) continue;
      const Site &a = fine.sites[i], &b = fine.sites[j];
      const double ratio = std::min(a.area, b.area) / std::max(a.area, b.area);
      pairs.emplace_back(-a.normal.dot(b.normal) * ratio, i, j);
    }
  // Those alike in direction and size first; what is left alone stays alone.
  std::sort(pairs.begin(), pairs.end());
  Level level;
  fine.coarser.assign(n, none);
  const auto merge = [&](std::uint32_t i, std::uint32_t j) {
    const Site &a = fine.sites[i], &b = fine.sites[j];
    Site s = a;
    if (i != j) {
      const double area = a.area + b.area, wa = a.area / area, wb = b.area / area;
      s.at = wa * a.at + wb * b.at;
      s.normal = (wa * a.normal + wb * b.normal).normalized();
      s.spacing = wa * a.spacing + wb * b.spacing, s.area = area;
      s.line = a.line && (a.line->holds() || !b.line) ? a.line : b.line;
      // The arm of b's cross nearest to a's.
      Place best = b.along;
      for (const Place& arm : {b.along, Place(b.up()), Place(-b.along), Place(-b.up())})
        if (arm.dot(a.along) > best.dot(a.along)) best = arm;
      s.along = wa * a.along + wb * best;
    }
    s.along = (s.along - s.normal * s.normal.dot(s.along)).normalized();
    if (s.line) {  // exactly along the line
      Place along = s.line->along - s.normal * s.normal.dot(s.line->along);
      if (along.norm() > .5) s.along = along.normalized();
    }
    s.point = s.at;
    fine.coarser[i] = fine.coarser[j] = std::uint32_t(level.sites.size());
    level.sites.push_back(s);
  };
  for (const auto& [order, i, j] : pairs)
    if (fine.coarser[i] == none && fine.coarser[j] == none) merge(i, j);
  for (std::uint32_t i = 0; i < n; ++i)
    if (fine.coarser[i] == none) merge(i, i);

  std::vector<std::tuple<std::uint32_t, std::uint32_t, float>> edges;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t e = fine.starts[i]; e < fine.starts[i + 1]; ++e)
      if (fine.coarser[i] != fine.coarser[fine.list[e]])
        edges.emplace_back(fine.coarser[i], fine.coarser[fine.list[e]], fine.weights[e]);
  std::sort(edges.begin(), edges.end());
  level.starts.assign(level.sites.size() + 1, 0);
  for (std::size_t e = 0; e < edges.size();) {
    const auto [a, b, w] = edges[e];
    float weight = 0.f;
    for (; e < edges.size() && std::get<0>(edges[e]) == a && std::get<1>(edges[e]) == b; ++e)
      weight += std::get<2>(edges[e]);
    level.list.push_back(b), level.weights.push_back(weight),
        level.starts[a + 1] = std::uint32_t(level.list.size());
  }
  for (std::size_t i = 1; i < level.starts.size(); ++i)
    level.starts[i] = std::max(level.starts[i], level.starts[i - 1]);
  return level;
}

void settle_all(Level& finest) {
  std::vector<Level> levels;
  levels.push_back(std::move(finest));
  while (levels.back().sites.size() > 64 && levels.size() < 40) {
    Level next = coarser(levels.back());
    if (next.sites.size() == levels.back().sites.size()) break;
    levels.push_back(std::move(next));
  }
  for (std::size_t l = levels.size(); l-- > 0;) {
    Level& level = levels[l];
    if (l + 1 < levels.size())
      for (std::size_t i = 0; i < level.sites.size(); ++i) {
        Site& site = level.sites[i];
        const Place from = levels[l + 1].sites[level.coarser[i]].point;
        Place point = from - site.normal * site.normal.dot(from - site.at);
        hold_to_line(site, point);
        site.point = site.rounded(point, site.at);
      }
    settle(level, 8);
  }
  finest = std::move(levels.front());
}

// ---- Collapsing triangles to the lattice ---------------------------------------------------------------------------------

// A triangulation that is whole at every step.
struct Collapsing {
  std::vector<Triangle> triangles;             // of roots
  std::vector<std::uint8_t> alive;             // triangles
  std::vector<std::vector<std::uint32_t>> of;  // triangles around a root
  std::vector<std::uint32_t> parent;
  std::vector<std::uint8_t> border;

  std::uint32_t root(std::uint32_t v) {
    while (parent[v] != v) parent[v] = parent[parent[v]], v = parent[v];
    return v;
  }
  std::vector<std::uint32_t> around(std::uint32_t v) const {
    std::vector<std::uint32_t> list;
    for (const std::uint32_t t : of[v])
      for (const std::uint32_t w : triangles[t])
        if (w != v) list.push_back(w);
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    return list;
  }
  std::vector<std::uint32_t> shared(std::uint32_t a, std::uint32_t b) const {
    std::vector<std::uint32_t> list;
    for (const std::uint32_t t : of[a])
      if (std::find(triangles[t].begin(), triangles[t].end(), b) != triangles[t].end()) list.push_back(t);
    return list;
  }
  // Joins b to a, unless that would fold the surface onto itself (the link condition, Dey et al. 1999).
  bool join(std::uint32_t a, std::uint32_t b) {
    const auto both = shared(a, b);
    if (both.empty()) return false;
    if (border[a] && border[b] && both.size() != 1) return false;
    const auto na = around(a), nb = around(b);
    std::vector<std::uint32_t> common;
    std::set_intersection(na.begin(), na.end(), nb.begin(), nb.end(), std::back_inserter(common));
    if (common.size() != both.size()) return false;
    if (of[a].size() + of[b].size() <= 2 * both.size() + 2) return false;  // a lone tetrahedron or flap
    for (const std::uint32_t t : both) {
      alive[t] = 0;
      for (const std::uint32_t w : triangles[t])
        if (w != b) std::erase(of[w], t);
    }
    for (const std::uint32_t t : of[b])
      if (alive[t]) {
        for (std::uint32_t& w : triangles[t])
          if (w == b) w = a;
        of[a].push_back(t);
      }
    of[b].clear();
    parent[b] = a;
    border[a] |= border[b];
    return true;
  }
};

// ---- From the ribbon to quadrilaterals ------------------------------------------------------------------------------------

// Volume under a unit of area of the middle, µm, at every vertex.
std::vector<double> heights(const Ribbon& ribbon) {
  std::vector<double> volumes(ribbon.size(), 0.), areas(ribbon.size(), 0.);
  for (const Triangle& t : ribbon.triangles) {
    if (ribbon.is_wall(t)) continue;
    const double volume = volume_under(ribbon, t);
    const double area =
        .5 *
        (ribbon.middle[t[1]] - ribbon.middle[t[0]]).cross(ribbon.middle[t[2]] - ribbon.middle[t[0]]).norm();
    for (const std::uint32_t v : t) volumes[v] += volume, areas[v] += area;
  }
  for (std::size_t v = 0; v < volumes.size(); ++v)
    volumes[v] = areas[v] > 0. ? std::clamp(volumes[v] / areas[v], 200., 1e4) : 0.;
  return volumes;
}

struct Faces {
  std::vector<Place> places;
  std::vector<std::uint8_t> on_valley;
  std::vector<std::vector<std::uint32_t>> faces;  // of three or four corners
};

// The step of a lattice from the point of one site to that of another.
Eigen::Vector2i step_between(const Site& a, const Site& b) {
  const Agreement agreed = agree(a, a.point, b, b.point);
  const int x = agreed.from_other.x(), y = agreed.from_other.y();
  const std::array<Place, 4> arms{b.along, b.up(), -b.along, -b.up()};
  const std::array<Eigen::Vector2i, 4> turned{Eigen::Vector2i{x, y}, {y, -x}, {-x, -y}, {-y, x}};
  std::size_t best = 0;
  for (std::size_t k = 1; k < 4; ++k)
    if (arms[k].dot(a.along) > arms[best].dot(a.along)) best = k;
  return agreed.from_one - turned[best];
}

Faces extract(const Level& level, std::vector<Triangle> triangles) {
  const std::size_t n = level.sites.size();
  Collapsing mesh{std::move(triangles),
                  {},
                  std::vector<std::vector<std::uint32_t>>(n),
                  std::vector<std::uint32_t>(n),
                  std::vector<std::uint8_t>(n, 0)};
  mesh.alive.assign(mesh.triangles.size(), 1);
  std::iota(mesh.parent.begin(), mesh.parent.end(), 0u);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) mesh.of[v].push_back(t);
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> zeros;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t e = level.starts[i]; e < level.starts[i + 1]; ++e) {
      const std::uint32_t j = level.list[e];
      if (j < i) continue;
      if (mesh.shared(i, j).size() == 1) mesh.border[i] = mesh.border[j] = 1;
      const Site &a = level.sites[i], &b = level.sites[j];
      if (step_between(a, b).isZero()) zeros.emplace_back((a.point - b.point).norm() / a.spacing, i, j);
    }
  std::sort(zeros.begin(), zeros.end());
  for (int pass = 0; pass < 3; ++pass)
    for (const auto& [distance, i, j] : zeros)
      if (const std::uint32_t a = mesh.root(i), b = mesh.root(j); a != b) mesh.join(a, b);

  // Where the vertices of a cluster see their common point, the nearer the more.
  std::vector<Place> places(n, Place::Zero()), normals(n, Place::Zero()), arms(n, Place::Zero());
  std::vector<double> weights(n, 0.), spacings(n, 0.);
  std::vector<double> nearest(n, 1e300);
  std::vector<std::optional<Pass>> valley(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Site& s = level.sites[i];
    const std::uint32_t r = mesh.root(i);
    const double d = (s.point - s.at).norm() / s.spacing,
                 w = (s.area + 1.) * std::exp(-9. * std::min(d * d, 4.));
    places[r] += w * s.point, normals[r] += w * s.normal, spacings[r] += w * s.spacing, weights[r] += w;
    if (d < nearest[r]) nearest[r] = d, arms[r] = s.along;
    if (s.line && s.line->kind == Line::Kind::valley &&
        (!valley[r] || (s.line->at - s.point).norm() < (valley[r]->at - places[r] / weights[r]).norm()))
      valley[r] = s.line;
  }
  for (std::uint32_t r = 0; r < n; ++r)
    if (weights[r] > 0.) places[r] /= weights[r], spacings[r] /= weights[r], normals[r].normalize();

  // What the lattices could not agree on: vertices far too near to one another.
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> shorts;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.alive[t])
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t a = mesh.triangles[t][e], b = mesh.triangles[t][(e + 1) % 3];
        const double share = (places[a] - places[b]).norm() / (.5 * (spacings[a] + spacings[b]));
        if (a < b && share < .5) shorts.emplace_back(share, a, b);
      }
  std::sort(shorts.begin(), shorts.end());
  constexpr std::size_t most_around = 8;  // triangles of a vertex
  for (const auto& [share, i, j] : shorts) {
    const std::uint32_t a = mesh.root(i), b = mesh.root(j);
    if (a == b) continue;
    if ((places[a] - places[b]).norm() > .6 * (.5 * (spacings[a] + spacings[b]))) continue;
    const Place middle = (weights[a] * places[a] + weights[b] * places[b]) / (weights[a] + weights[b]);
    if (mesh.of[a].size() + mesh.of[b].size() > most_around + 4) continue;
    if (!mesh.join(a, b)) continue;
    places[a] = middle, weights[a] += weights[b];
    if (!valley[a]) valley[a] = valley[b];
  }

  // Pairs of triangles across the edges that run most diagonally through the lattice.
  struct Pair {
    double score;
    std::uint32_t one, other, a, b, c, d;  // a–c is the edge that goes, a b c d the quadrilateral
  };
  std::vector<Pair> pairs;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive[t]) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t c = mesh.triangles[t][e], a = mesh.triangles[t][(e + 1) % 3],
                          b = mesh.triangles[t][(e + 2) % 3];
      const auto both = mesh.shared(a, c);
      if (both.size() != 2) continue;
      const std::uint32_t other = both[0] == t ? both[1] : both[0];
      if (other < t) continue;
      std::uint32_t d = 0;
      for (const std::uint32_t v : mesh.triangles[other])
        if (v != a && v != c) d = v;
      if (d == b) continue;
      const Place normal = (normals[a] + normals[b] + normals[c] + normals[d]).normalized();
      const auto diagonal = [&](std::uint32_t v) {
        const Place way = places[c] - places[a], up = normals[v].cross(arms[v]);
        return std::abs(std::sin(2. * std::atan2(way.dot(up), way.dot(arms[v]))));
      };
      double worst = 1.;
      const std::array<std::uint32_t, 4> corners{a, b, c, d};
      for (std::size_t k = 0; k < 4; ++k) {
        const Place in = (places[corners[k]] - places[corners[(k + 3) % 4]]).normalized();
        const Place out = (places[corners[(k + 1) % 4]] - places[corners[k]]).normalized();
        worst = std::min(worst, in.cross(out).dot(normal));
      }
      if (worst > .25) pairs.push_back({worst * (.2 + diagonal(a) + diagonal(c)), t, other, a, b, c, d});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
    return std::tuple(-p.score, p.one, p.other) < std::tuple(-q.score, q.one, q.other);
  });
  Faces result;
  std::vector<std::uint32_t> number(n, ~0u);
  const auto vertex = [&](std::uint32_t v) {
    if (number[v] == ~0u) {
      number[v] = std::uint32_t(result.places.size());
      Place at = places[v];
      const bool on = valley[v] && (valley[v]->at - at).norm() < .4 * spacings[v];
      if (on) at = valley[v]->at + valley[v]->along * valley[v]->along.dot(at - valley[v]->at);
      result.places.push_back(at), result.on_valley.push_back(on);
    }
    return number[v];
  };
  for (const Pair& p : pairs)
    if (mesh.alive[p.one] && mesh.alive[p.other]) {
      mesh.alive[p.one] = mesh.alive[p.other] = 0;
      result.faces.push_back({vertex(p.a), vertex(p.b), vertex(p.c), vertex(p.d)});
    }
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.alive[t])
      result.faces.push_back(
          {vertex(mesh.triangles[t][0]), vertex(mesh.triangles[t][1]), vertex(mesh.triangles[t][2])});
  return result;
}

// Vertices within, around which there are only two faces, go, and the faces become one: no such quadrilateral can be convex.
void drop_doublets(Faces& mesh) {
  std::vector<std::vector<std::uint32_t>> of(mesh.places.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t e = 0; e < mesh.faces[f].size(); ++e) {
      const auto& face = mesh.faces[f];
      of[face[e]].push_back(f), ++sides[std::minmax(face[e], face[(e + 1) % face.size()])];
    }
  std::vector<std::uint8_t> border(mesh.places.size(), 0);
  for (const auto& [side, times] : sides)
    if (times == 1) border[side.first] = border[side.second] = 1;
  std::vector<std::uint32_t> open(mesh.places.size());
  std::iota(open.begin(), open.end(), 0u);
  while (!open.empty()) {
    const std::uint32_t v = open.back();
    open.pop_back();
    if (border[v] || of[v].size() != 2) continue;
    const std::uint32_t keep = of[v][0], drop = of[v][1];
    // From the neighbour behind v in one face to the one before it, then the other face's way back, without v.
    std::vector<std::uint32_t> ring;
    for (const std::uint32_t f : {keep, drop}) {
      const auto& face = mesh.faces[f];
      const std::size_t at = std::size_t(std::find(face.begin(), face.end(), v) - face.begin());
      for (std::size_t k = 1; k + 1 < face.size(); ++k) ring.push_back(face[(at + k) % face.size()]);
    }
    std::vector<std::uint32_t> sorted = ring;
    std::sort(sorted.begin(), sorted.end());
    if (ring.size() < 3 || ring.size() > 4 ||
        std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      continue;
    for (const std::uint32_t f : {keep, drop})
      for (const std::uint32_t w : mesh.faces[f]) std::erase(of[w], f);
    mesh.faces[keep] = ring, mesh.faces[drop].clear();
    for (const std::uint32_t w : ring) of[w].push_back(keep), open.push_back(w);
  }
  std::erase_if(mesh.faces, [](const auto& face) { return face.empty(); });
  std::vector<std::uint32_t> number(mesh.places.size(), ~0u);
  Faces packed;
  for (auto& face : mesh.faces)
    for (std::uint32_t& w : face) {
      if (number[w] == ~0u) {
        number[w] = std::uint32_t(packed.places.size());
        packed.places.push_back(mesh.places[w]), packed.on_valley.push_back(mesh.on_valley[w]);
      }
      w = number[w];
    }
  packed.faces = std::move(mesh.faces);
  mesh = std::move(packed);
}

// Every face as as many quadrilaterals as it has corners, each from a corner to the middle.
void halve(const Faces& coarse, Quads& quads) {
  quads.middle = coarse.places, quads.on_valley = coarse.on_valley;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle_of = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, fresh] = middles.insert({std::minmax(a, b), std::uint32_t(quads.middle.size())});
    if (fresh) {
      quads.middle.push_back(.5 * (coarse.places[a] + coarse.places[b]));
      quads.on_valley.push_back(coarse.on_valley[a] && coarse.on_valley[b]);
    }
    return at->second;
  };
  for (const auto& face : coarse.faces) {
    Place centre = Place::Zero();
    for (const std::uint32_t v : face) centre += coarse.places[v] / double(face.size());
    const auto c = std::uint32_t(quads.middle.size());
    quads.middle.push_back(centre), quads.on_valley.push_back(0);
    for (std::size_t e = 0; e < face.size(); ++e)
      quads.quads.push_back({face[e], middle_of(face[e], face[(e + 1) % face.size()]), c,
                             middle_of(face[(e + face.size() - 1) % face.size()], face[e])});
  }
}

}  // namespace

Quads lay_quads(const Ribbon& ribbon, std::span<const Curvature> curvature, std::span<const Line> given,
                const QuadOptions& options, Progress& progress) {
  std::vector<Line> lines = borders(ribbon);  // they come first where lines meet
  lines.insert(lines.end(), given.begin(), given.end());
  const Neighbours near = neighbours(ribbon.size(), ribbon.triangles);
  progress.begin("laying crosses along the folds", 0);
  const std::vector<Place> arms = crosses(ribbon, near, curvature, lines);
  progress.end();
  const std::vector<double> height = heights(ribbon);
  const auto by = passes(ribbon, lines);

  // The ribbon without its wall.
  std::vector<std::uint32_t> number(ribbon.size(), ~0u), vertices;
  std::vector<Triangle> triangles;
  double volume = 0.;
  for (const Triangle& t : ribbon.triangles) {
    if (ribbon.is_wall(t)) continue;
    volume += volume_under(ribbon, t);
    Triangle mine{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (number[t[k]] == ~0u) number[t[k]] = std::uint32_t(vertices.size()), vertices.push_back(t[k]);
      mine[k] = number[t[k]];
    }
    triangles.push_back(mine);
  }
  if (!(volume > 4. * options.volume))
    throw Error(fmt::format("the cortex has {:.3g} mm³, too little for elements of {:.3g} mm³", volume / 1e9,
                            options.volume / 1e9));
  const Neighbours own = neighbours(vertices.size(), triangles);
  Level finest;
  finest.starts = own.starts, finest.list = own.list, finest.weights.assign(own.list.size(), 1.f);
  std::vector<double> areas(ribbon.size(), 0.);
  for (const Triangle& t : ribbon.triangles)
    for (const std::uint32_t v : t)
      areas[v] += (ribbon.middle[t[1]] - ribbon.middle[t[0]])
                      .cross(ribbon.middle[t[2]] - ribbon.middle[t[0]])
                      .norm() /
                  6.;

  Quads quads;
  const double count = std::round(volume / options.volume);
  double factor = 1., nearest = 1e300;
  for (int attempt = 0; attempt < 6; ++attempt) {
    progress.begin("laying the lattice of elements", 0);
    finest.sites.clear();
    for (const std::uint32_t v : vertices) {
      Site s{.at = ribbon.middle[v],
             .normal = curvature[v].normal,
             .along = arms[v],
             .spacing = 2. * std::sqrt(factor * options.volume / height[v]),
             .area = areas[v],
             .point = ribbon.middle[v],
             .line = by[v]};
      finest.sites.push_back(s);
    }
    settle_all(finest);
    progress.end();
    progress.begin("collapsing triangles to the lattice", 0);
    Faces coarse = extract(finest, triangles);
    drop_doublets(coarse);
    Quads laid;
    halve(coarse, laid);
    even_valences(laid);
    progress.end();
    const double off = double(laid.quads.size()) / count;
    if (quads.quads.empty() || std::abs(off - 1.) < nearest)
      nearest = std::abs(off - 1.), quads = std::move(laid);
    if (nearest < options.volume_within) break;
    factor *= off;
  }

  // Back onto the ribbon, and along it until volumes are even.
  const RibbonLocator locator(ribbon);
  const TriangleTree valley_tree(pieces(lines, Line::Kind::valley)),
      border_tree(pieces(lines, Line::Kind::border));

  const std::size_t n = quads.middle.size();
  quads.points.resize(n);
  std::vector<double> under(n), held(n);  // held: to the directions of a line
  std::vector<Place> up(n), arm(n);
  std::vector<std::uint8_t> border(n, 0);  // sides that only one face has, of every vertex
  const auto put_back = [&](std::size_t v) {
    if (border[v])
      if (const auto hit = border_tree.nearest(quads.middle[v], 1.5 * std::cbrt(options.volume)))
        quads.middle[v] = hit->at;
    if (quads.on_valley[v] && !border[v])
      if (const auto hit = valley_tree.nearest(quads.middle[v])) quads.middle[v] = hit->at;
    const RibbonPoint point = locator.nearest(quads.middle[v]);
    quads.points[v] = point, quads.middle[v] = on(ribbon.middle, ribbon, point);
    const Triangle& c = ribbon.triangles[point.triangle];
    const Place& w = point.weights;
    std::size_t main = 0;
    for (const std::size_t k : {1u, 2u})
      if (w[Eigen::Index(k)] > w[Eigen::Index(main)]) main = k;
    arm[v] = arms[c[main]];
    held[v] = by[c[main]] ? .6 : 0.;
    under[v] = w[0] * height[c[0]] + w[1] * height[c[1]] + w[2] * height[c[2]];
    up[v] = (w[0] * curvature[c[0]].normal + w[1] * curvature[c[1]].normal + w[2] * curvature[c[2]].normal)
                .normalized();
  };
  parallel_for(n, 256, put_back);

  std::vector<std::vector<std::uint32_t>> of(n);  // quads around a vertex
  for (std::uint32_t q = 0; q < quads.quads.size(); ++q)
    for (const std::uint32_t v : quads.quads[q]) of[v].push_back(q);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Quad& q : quads.quads)
    for (std::size_t e = 0; e < 4; ++e) ++sides[std::minmax(q[e], q[(e + 1) % 4])];
  std::vector<Place> along_border(n);  // the sum of both neighbours
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rim;
  for (const auto& [edge, times] : sides)
    if (times == 1) ++border[edge.first], ++border[edge.second], rim.push_back(edge);

  progress.begin("evening volumes", std::size_t(options.relaxations));
  const double wanted = volume / double(quads.quads.size());
  std::vector<Place> moved(n);
  constexpr int smooth_rounds = 10, last_rounds = 15;
  for (int round = 0; round < options.relaxations; ++round) {
    const double shape = .3 + (.06 - .3) * double(round) / double(options.relaxations);
    // In the end only what is bent is mended.
    const bool last = round + last_rounds >= options.relaxations;
    for (const auto& [a, b] : rim) along_border[a] = along_border[b] = Place::Zero();
    for (const auto& [a, b] : rim) along_border[a] += quads.middle[b], along_border[b] += quads.middle[a];
    parallel_for(n, 1024, [&](std::size_t v) {
      if (border[v]) {  // the border becomes smooth and stays
        moved[v] = border[v] == 2 && round < smooth_rounds
                       ? Place(.5 * quads.middle[v] + .25 * along_border[v])
                       : quads.middle[v];
        return;
      }
      // Towards the mean of its neighbours, and to where its sides run along the cross; the more a face around it is bent
      // out of shape, the more.
      Place sum = Place::Zero(), mean = Place::Zero(), aligned = Place::Zero();
      double sides_around = 0., worst = 1.;
      const Place side = up[v].cross(arm[v]);
      for (const std::uint32_t i : of[v]) {
        const Quad& q = quads.quads[i];
        const std::size_t k = std::size_t(std::find(q.begin(), q.end(), std::uint32_t(v)) - q.begin());
        const std::array<Place, 4> p{quads.middle[q[k]], quads.middle[q[(k + 1) % 4]],
                                     quads.middle[q[(k + 2) % 4]], quads.middle[q[(k + 3) % 4]]};
        for (std::size_t c = 0; c < 4; ++c) {
          const Place out = p[(c + 1) % 4] - p[c], in = p[(c + 3) % 4] - p[c];
          worst = std::min(worst, up[v].dot(out.cross(in)) / (out.norm() * in.norm() + 1e-9));
        }
        const double tall = .25 * (under[q[0]] + under[q[1]] + under[q[2]] + under[q[3]]);
        const Place across = .5 * (p[2] - p[0]).cross(p[3] - p[1]);
        const double ratio = up[v].dot(across) * tall / wanted;
        const Place grow = .5 * up[v].cross(p[3] - p[1]);  // how the area changes with this corner
        const double squares = .5 * ((p[2] - p[0]).squaredNorm() + (p[3] - p[1]).squaredNorm());
        sum += std::clamp(1. - ratio, -1., 1.) * (wanted / tall) / squares * grow;
        for (const Place& next : {p[1], p[3]}) {
          const Place way = next - p[0];
          const double a = way.dot(arm[v]), b = way.dot(side);
          const Place straight = std::abs(a) > std::abs(b) ? Place(arm[v] * std::copysign(way.norm(), a))
                                                           : Place(side * std::copysign(way.norm(), b));
          mean += way, aligned += way - straight, sides_around += 1.;
        }
      }
      const double bent = std::clamp((.5 - worst) / .5, 0., 1.);
      if (last && bent == 0.) return void(moved[v] = quads.middle[v]);
      Place pull = (1. - bent) * (shape * .5 * mean + std::max(shape, held[v]) * aligned) / sides_around +
                   bent * .5 * mean / sides_around;
      pull -= up[v] * up[v].dot(pull);
      Place step = (last ? 1. - bent : 1. - .7 * bent) * .8 * sum + pull;
      const double most = .25 * std::sqrt(wanted / under[v]);
      if (step.norm() > most) step *= most / step.norm();
      moved[v] = quads.middle[v] + step;
    });
    quads.middle.swap(moved);
    parallel_for(n, 256, put_back);
    progress.advance();
  }
  progress.end();
  return quads;
}

}  // namespace forest::cortex
