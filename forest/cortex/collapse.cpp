// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/collapse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "forest/core/distinct.h"
#include "forest/core/unions.h"

namespace forest::cortex {
namespace {

// A triangulation that is whole at every step.
struct Collapsing {
  std::vector<Triangle> triangles;             // of roots
  std::vector<std::uint8_t> alive;             // triangles
  std::vector<std::vector<std::uint32_t>> of;  // triangles around a root
  Unions joined;
  std::vector<std::uint8_t> border;

  std::uint32_t root(std::uint32_t v) { return joined.root(v); }
  std::vector<std::uint32_t> around(std::uint32_t v) const {
    std::vector<std::uint32_t> list;
    for (const std::uint32_t t : of[v])
      for (const std::uint32_t w : triangles[t])
        if (w != v) list.push_back(w);
    return distinct(std::move(list));
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
    joined.join(a, b);
    border[a] |= border[b];
    return true;
  }
};

// Clusters of vertices that see the same point of their lattice, and what becomes of them.
class Clusters {
 public:
  Clusters(const Level& level, std::vector<Triangle> triangles)
      : level_(level),
        n_(level.sites.size()),
        mesh_{std::move(triangles),
              {},
              std::vector<std::vector<std::uint32_t>>(n_),
              Unions(n_),
              std::vector<std::uint8_t>(n_, 0)} {
    mesh_.alive.assign(mesh_.triangles.size(), 1);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      for (const std::uint32_t v : mesh_.triangles[t]) mesh_.of[v].push_back(t);
  }

  // Vertices whose lattices agree that no step lies between them.
  void join_alike() {
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> zeros;
    for (std::uint32_t i = 0; i < n_; ++i)
      for (std::uint32_t e = level_.starts[i]; e < level_.starts[i + 1]; ++e) {
        const std::uint32_t j = level_.list[e];
        if (j < i) continue;
        if (mesh_.shared(i, j).size() == 1) mesh_.border[i] = mesh_.border[j] = 1;
        const LatticeSite &a = level_.sites[i], &b = level_.sites[j];
        if (step_between(a, b).isZero()) zeros.emplace_back((a.point - b.point).norm() / a.spacing, i, j);
      }
    std::sort(zeros.begin(), zeros.end());
    for (int pass = 0; pass < 3; ++pass)
      for (const auto& [distance, i, j] : zeros)
        if (const std::uint32_t a = mesh_.root(i), b = mesh_.root(j); a != b) mesh_.join(a, b);
  }

  // Where the vertices of a cluster see their common point, the nearer the more.
  void place() {
    places_.assign(n_, Place::Zero()), normals_ = arms_ = places_;
    weights_.assign(n_, 0.), spacings_.assign(n_, 0.), valley_.assign(n_, std::nullopt);
    std::vector<double> nearest(n_, 1e300);
    for (std::uint32_t i = 0; i < n_; ++i) {
      const LatticeSite& s = level_.sites[i];
      const std::uint32_t r = mesh_.root(i);
      const double d = (s.point - s.at).norm() / s.spacing,
                   w = (s.area + 1.) * std::exp(-9. * std::min(d * d, 4.));
      places_[r] += w * s.point, normals_[r] += w * s.normal, spacings_[r] += w * s.spacing, weights_[r] += w;
      if (d < nearest[r]) nearest[r] = d, arms_[r] = s.along;
      if (s.line && s.line->kind == Line::Kind::valley &&
          (!valley_[r] || (s.line->at - s.point).norm() < (valley_[r]->at - places_[r] / weights_[r]).norm()))
        valley_[r] = s.line;
    }
    for (std::uint32_t r = 0; r < n_; ++r)
      if (weights_[r] > 0.) places_[r] /= weights_[r], spacings_[r] /= weights_[r], normals_[r].normalize();
  }

  // What the lattices could not agree on: vertices far too near to one another.
  void join_near() {
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> shorts;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (mesh_.alive[t])
        for (std::size_t e = 0; e < 3; ++e) {
          const std::uint32_t a = mesh_.triangles[t][e], b = mesh_.triangles[t][(e + 1) % 3];
          const double share = (places_[a] - places_[b]).norm() / (.5 * (spacings_[a] + spacings_[b]));
          if (a < b && share < .5) shorts.emplace_back(share, a, b);
        }
    std::sort(shorts.begin(), shorts.end());
    constexpr std::size_t most_around = 8;  // triangles of a vertex
    for (const auto& [share, i, j] : shorts) {
      const std::uint32_t a = mesh_.root(i), b = mesh_.root(j);
      if (a == b) continue;
      if ((places_[a] - places_[b]).norm() > .6 * (.5 * (spacings_[a] + spacings_[b]))) continue;
      const Place middle =
          (weights_[a] * places_[a] + weights_[b] * places_[b]) / (weights_[a] + weights_[b]);
      if (mesh_.of[a].size() + mesh_.of[b].size() > most_around + 4) continue;
      if (!mesh_.join(a, b)) continue;
      places_[a] = middle, weights_[a] += weights_[b];
      if (!valley_[a]) valley_[a] = valley_[b];
    }
  }

  // Two triangles each become a quadrilateral, the best first.
  Faces paired() {
    Faces result;
    std::vector<std::uint32_t> number(n_, ~0u);
    const auto vertex = [&](std::uint32_t v) {
      if (number[v] == ~0u) {
        number[v] = std::uint32_t(result.places.size());
        Place at = places_[v];
        const bool on = valley_[v] && (valley_[v]->at - at).norm() < .4 * spacings_[v];
        if (on) at = valley_[v]->at + valley_[v]->along * valley_[v]->along.dot(at - valley_[v]->at);
        result.places.push_back(at), result.on_valley.push_back(on);
      }
      return number[v];
    };
    for (const Pair& p : pairs())
      if (mesh_.alive[p.one] && mesh_.alive[p.other]) {
        mesh_.alive[p.one] = mesh_.alive[p.other] = 0;
        result.faces.push_back({vertex(p.a), vertex(p.b), vertex(p.c), vertex(p.d)});
      }
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (mesh_.alive[t])
        result.faces.push_back(
            {vertex(mesh_.triangles[t][0]), vertex(mesh_.triangles[t][1]), vertex(mesh_.triangles[t][2])});
    return result;
  }

 private:
  struct Pair {
    double score;
    std::uint32_t one, other, a, b, c, d;  // a–c is the edge that goes, a b c d the quadrilateral
  };

  // Pairs of triangles across the edges that run most diagonally through the lattice.
  std::vector<Pair> pairs() const {
    std::vector<Pair> pairs;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!mesh_.alive[t]) continue;
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t c = mesh_.triangles[t][e], a = mesh_.triangles[t][(e + 1) % 3],
                            b = mesh_.triangles[t][(e + 2) % 3];
        const auto both = mesh_.shared(a, c);
        if (both.size() != 2) continue;
        const std::uint32_t other = both[0] == t ? both[1] : both[0];
        if (other < t) continue;
        std::uint32_t d = 0;
        for (const std::uint32_t v : mesh_.triangles[other])
          if (v != a && v != c) d = v;
        if (d == b) continue;
        const Place normal = (normals_[a] + normals_[b] + normals_[c] + normals_[d]).normalized();
        const auto diagonal = [&](std::uint32_t v) {
          const Place way = places_[c] - places_[a], up = normals_[v].cross(arms_[v]);
          return std::abs(std::sin(2. * std::atan2(way.dot(up), way.dot(arms_[v]))));
        };
        double worst = 1.;
        const std::array<std::uint32_t, 4> corners{a, b, c, d};
        for (std::size_t k = 0; k < 4; ++k) {
          const Place in = (places_[corners[k]] - places_[corners[(k + 3) % 4]]).normalized();
          const Place out = (places_[corners[(k + 1) % 4]] - places_[corners[k]]).normalized();
          worst = std::min(worst, in.cross(out).dot(normal));
        }
        if (worst > .25) pairs.push_back({worst * (.2 + diagonal(a) + diagonal(c)), t, other, a, b, c, d});
      }
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
      return std::tuple(-p.score, p.one, p.other) < std::tuple(-q.score, q.one, q.other);
    });
    return pairs;
  }

  const Level& level_;
  const std::size_t n_;
  Collapsing mesh_;
  // Of clusters, by their root:
  std::vector<Place> places_, normals_, arms_;
  std::vector<double> weights_, spacings_;
  std::vector<std::optional<Pass>> valley_;
};

Faces extract(const Level& level, std::vector<Triangle> triangles) {
  Clusters clusters(level, std::move(triangles));
  clusters.join_alike();
  clusters.place();
  clusters.join_near();
  return clusters.paired();
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

}  // namespace

Faces collapsed(const Level& level, std::vector<Triangle> triangles) {
  Faces faces = extract(level, std::move(triangles));
  drop_doublets(faces);
  return faces;
}

Quads halved(const Faces& coarse) {
  Quads quads;
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
  return quads;
}

}  // namespace forest::cortex
