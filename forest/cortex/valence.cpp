// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/valence.h"

#include <algorithm>
#include <initializer_list>
#include <span>
#include <utility>

#include "forest/core/distinct.h"

namespace forest::cortex {
namespace {

using Vertex = std::uint32_t;

class Evener {
 public:
  explicit Evener(Quads& quads) : quads_(quads), of_(quads.middle.size()), border_(quads.middle.size(), 0) {
    for (std::uint32_t f = 0; f < quads.quads.size(); ++f)
      for (const Vertex v : quads.quads[f]) of_[v].push_back(f);
    for (std::uint32_t f = 0; f < quads.quads.size(); ++f)
      for (std::size_t k = 0; k < 4; ++k)
        if (const Vertex a = at(f, k), b = at(f, k + 1); beside(a, b).size() == 1)
          border_[a] = border_[b] = 1;
  }

  std::size_t run() {
    std::size_t changes = 0, before = 1;
    for (int round = 0; round < 20 && before != changes; ++round) {
      before = changes;
      for (std::uint32_t f = 0; f < quads_.quads.size(); ++f) {
        for (std::size_t k = 0; k < 4 && alive(f); ++k) changes += turn(at(f, k), at(f, k + 1));
        for (std::size_t k = 0; k < 2 && alive(f); ++k) changes += close(f, k);
      }
    }
    pack();
    return changes;
  }

 private:
  Vertex at(std::uint32_t quad, std::size_t k) const { return quads_.quads[quad][k % 4]; }
  bool alive(std::uint32_t quad) const { return quads_.quads[quad][0] != quads_.quads[quad][2]; }
  std::size_t slot(std::uint32_t quad, Vertex v) const {
    const Quad& q = quads_.quads[quad];
    return std::size_t(std::find(q.begin(), q.end(), v) - q.begin());
  }
  std::vector<std::uint32_t> beside(Vertex a, Vertex b) const {  // quadrilaterals with the side
    std::vector<std::uint32_t> result;
    for (const std::uint32_t f : of_[a])
      if (const std::size_t k = slot(f, a); at(f, k + 1) == b || at(f, k + 3) == b) result.push_back(f);
    return result;
  }
  // What a vertex costs with so many more quadrilaterals.
  int cost(Vertex v, int more = 0) const {
    const int off = int(of_[v].size()) + more - (border_[v] ? 2 : 4);
    return off * off;
  }
  bool inside(Vertex v, int more) const { return border_[v] || int(of_[v].size()) + more >= 3; }

  Place normal_around(Vertex v) const {
    Place sum = Place::Zero();
    for (const std::uint32_t f : of_[v]) {
      const Quad& q = quads_.quads[f];
      sum += (quads_.middle[q[2]] - quads_.middle[q[0]]).cross(quads_.middle[q[3]] - quads_.middle[q[1]]);
    }
    return sum.normalized();
  }
  // Whether what a quadrilateral would be faces outwards, with at most one corner that is a little reflex.
  bool faces(const std::array<Place, 4>& p, const Place& normal) const {
    double least = 1.;
    for (std::size_t k = 0; k < 4; ++k)
      least = std::min(
          least,
          (p[(k + 1) % 4] - p[k]).normalized().cross((p[(k + 3) % 4] - p[k]).normalized()).dot(normal));
    return least > -.3 && (p[2] - p[0]).cross(p[3] - p[1]).dot(normal) > 0.;
  }

  void set(std::uint32_t quad, const Quad& to) {
    for (const Vertex v : quads_.quads[quad]) std::erase(of_[v], quad);
    quads_.quads[quad] = to;
    for (const Vertex v : to) of_[v].push_back(quad);
  }

  bool turn(Vertex x, Vertex v) {
    const auto both = beside(x, v);
    if (both.size() != 2 || (quads_.on_valley[x] && quads_.on_valley[v])) return false;
    // Around: one is x → p → q → v, the other v → r → s → x.
    std::uint32_t one = both[0], other = both[1];
    if (at(one, slot(one, v) + 1) != x) std::swap(one, other);
    if (at(one, slot(one, v) + 1) != x || at(other, slot(other, x) + 1) != v) return false;
    const std::size_t k = slot(one, x), l = slot(other, v);
    const Vertex p = at(one, k + 1), q = at(one, k + 2), r = at(other, l + 1), s = at(other, l + 2);
    for (const auto& [from, to, first, second] : {std::tuple{p, r, Quad{p, q, v, r}, Quad{r, s, x, p}},
                                                  std::tuple{q, s, Quad{q, v, r, s}, Quad{s, x, p, q}}}) {
      if (from == to || !inside(x, -1) || !inside(v, -1) || !beside(from, to).empty()) continue;
      if (cost(x, -1) + cost(v, -1) + cost(from, 1) + cost(to, 1) >=
          cost(x) + cost(v) + cost(from) + cost(to))
        continue;
      const Place normal = (normal_around(x) + normal_around(v)).normalized();
      if (!faces(places(first), normal) || !faces(places(second), normal)) continue;
      set(one, first), set(other, second);
      return true;
    }
    return false;
  }

  bool close(std::uint32_t quad, std::size_t k) {
    const Vertex a = at(quad, k), b = at(quad, k + 1), c = at(quad, k + 2), d = at(quad, k + 3);
    if (border_[a] || border_[c] || quads_.on_valley[a] || quads_.on_valley[c] || !inside(b, -1) ||
        !inside(d, -1))
      return false;
    const int merged = int(of_[a].size() + of_[c].size()) - 2;
    if (merged < 3 ||
        (merged - 4) * (merged - 4) + cost(b, -1) + cost(d, -1) >= cost(a) + cost(b) + cost(c) + cost(d))
      return false;
    // The faces around both have only b and d in common.
    std::vector<Vertex> near_a, near_c, common;
    for (const auto& [of, near] : {std::pair{a, &near_a}, std::pair{c, &near_c}}) {
      for (const std::uint32_t f : of_[of])
        for (const Vertex v : quads_.quads[f]) near->push_back(v);
      *near = distinct(std::move(*near));
    }
    std::set_intersection(near_a.begin(), near_a.end(), near_c.begin(), near_c.end(),
                          std::back_inserter(common));
    if (common.size() != 4) return false;
    const Place middle = .5 * (quads_.middle[a] + quads_.middle[c]);
    const Place normal = (normal_around(a) + normal_around(c)).normalized();
    for (const Vertex end : {a, c})
      for (const std::uint32_t f : of_[end]) {
        if (f == quad) continue;
        auto p = places(quads_.quads[f]);
        p[slot(f, end)] = middle;
        if (!faces(p, normal)) return false;
      }
    for (const Vertex v : quads_.quads[quad]) std::erase(of_[v], quad);
    quads_.quads[quad] = {a, a, a, a};
    for (const std::uint32_t f : of_[c]) quads_.quads[f][slot(f, c)] = a, of_[a].push_back(f);
    of_[c].clear();
    quads_.middle[a] = middle;
    return true;
  }

  std::array<Place, 4> places(const Quad& q) const {
    return {quads_.middle[q[0]], quads_.middle[q[1]], quads_.middle[q[2]], quads_.middle[q[3]]};
  }

  void pack() {
    std::erase_if(quads_.quads, [](const Quad& q) { return q[0] == q[2]; });
    std::vector<Vertex> number(quads_.middle.size(), ~0u);
    Quads packed;
    for (Quad& q : quads_.quads)
      for (Vertex& v : q) {
        if (number[v] == ~0u) {
          number[v] = Vertex(packed.middle.size());
          packed.middle.push_back(quads_.middle[v]), packed.on_valley.push_back(quads_.on_valley[v]);
        }
        v = number[v];
      }
    packed.quads = std::move(quads_.quads);
    quads_ = std::move(packed);
  }

  Quads& quads_;
  std::vector<std::vector<std::uint32_t>> of_;  // quadrilaterals of every vertex
  std::vector<std::uint8_t> border_;
};

}  // namespace

std::size_t even_valences(Quads& quads) { return Evener(quads).run(); }

}  // namespace forest::cortex
