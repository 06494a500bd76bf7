// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/sulci.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "forest/core/parallel.h"
#include "forest/core/unions.h"

namespace forest::cortex {
namespace {

using Vertex = std::uint32_t;

// Each place drifts to the mean of its neighbours, x' = mean(x) - x, for a time, by stages of which each reaches farther than
// the last (Runge, Kutta & Legendre; Meyer, Balsara & Aslam 2012): s of them are stable for a time of (s² + s) / 2.
class Drift {
 public:
  explicit Drift(const Neighbours& near) : near_(near) {}

  void operator()(std::vector<Place>& places, double time) {
    const auto stages = int(std::ceil(.5 * (std::sqrt(8. * time + 1.) - 1.)));
    const double first = 2. / (double(stages) * stages + stages);
    const std::size_t n = places.size();
    before_ = places, last_.resize(n), next_.resize(n);
    parallel_for(n, 2048, [&](std::size_t v) { last_[v] = places[v] + first * time * slope(places, v); });
    for (int j = 2; j <= stages; ++j) {
      const double mu = (2. * j - 1.) / j, nu = (1. - j) / j;
      parallel_for(n, 2048, [&](std::size_t v) {
        next_[v] = mu * last_[v] + nu * before_[v] + mu * first * time * slope(last_, v);
      });
      before_.swap(last_), last_.swap(next_);
    }
    places = last_;
  }

 private:
  Place slope(const std::vector<Place>& at, std::size_t v) const {
    const auto around = near_.of(v);
    if (around.empty()) return Place::Zero();
    Place sum = Place::Zero();
    for (const Vertex u : around) sum += at[u];
    return sum / double(around.size()) - at[v];
  }

  const Neighbours& near_;
  std::vector<Place> before_, last_, next_;
};

// The sides opposite of every vertex in its triangles.
struct Links {
  std::vector<std::uint32_t> starts;
  std::vector<std::array<Vertex, 2>> sides;

  Links(std::size_t vertices, std::span<const Triangle> triangles)
      : starts(vertices + 1, 0), sides(3 * triangles.size()) {
    for (const Triangle& t : triangles)
      for (const Vertex v : t) ++starts[v + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    for (const Triangle& t : triangles)
      for (std::size_t k = 0; k < 3; ++k) sides[next[t[k]]++] = {t[(k + 1) % 3], t[(k + 2) % 3]};
  }
  std::span<const std::array<Vertex, 2>> of(Vertex v) const {
    return std::span(sides).subspan(starts[v], starts[v + 1] - starts[v]);
  }
};

// Vertices by depth; of equal depth the later one is deeper, so that none are equal.
class Relief {
 public:
  Relief(const Ribbon& ribbon, std::span<const double> depth)
      : ribbon_(ribbon),
        depth_(depth),
        near_(neighbours(ribbon.size(), ribbon.triangles)),
        links_(ribbon.size(), ribbon.triangles),
        order_(ribbon.size()),
        rank_(ribbon.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    std::stable_sort(order_.begin(), order_.end(), [&](Vertex a, Vertex b) { return depth[a] < depth[b]; });
    for (std::uint32_t i = 0; i < order_.size(); ++i) rank_[order_[i]] = i;
  }

  // Where the way down is steepest, of some neighbours.
  template <class List>
  std::optional<Vertex> down(Vertex from, const List& among) const {
    std::optional<Vertex> best;
    double most = 0.;
    for (const Vertex v : among) {
      if (rank_[v] < rank_[from]) continue;
      const double way = std::max((ribbon_.middle[v] - ribbon_.middle[from]).norm(), 1e-3),
                   steep = (depth_[v] - depth_[from]) / way;
      if (!best || steep > most) best = v, most = steep;
    }
    return best;
  }
  std::optional<Vertex> down(Vertex from) const { return down(from, near_.of(from)); }

  // At a pass the deeper neighbours are in several pieces: the steepest way into each. Else nothing.
  std::vector<Vertex> ways_down(Vertex v) const {
    std::vector<std::array<Vertex, 2>> joins;
    std::size_t changes = 0;
    for (const auto& side : links_.of(v)) {
      const bool one = rank_[side[0]] > rank_[v], other = rank_[side[1]] > rank_[v];
      changes += one != other;
      if (one && other) joins.push_back(side);
    }
    std::vector<Vertex> result;
    if (changes < 4) return result;
    std::map<Vertex, Vertex> piece;
    for (const Vertex u : near_.of(v))
      if (rank_[u] > rank_[v]) piece[u] = u;
    for (bool more = true; more;) {
      more = false;
      for (const auto& [a, b] : joins)
        if (piece[a] != piece[b]) piece[a] = piece[b] = std::min(piece[a], piece[b]), more = true;
    }
    for (const auto& [start, name] : piece) {
      if (start != name) continue;
      std::vector<Vertex> own;
      for (const auto& [u, of] : piece)
        if (of == name) own.push_back(u);
      result.push_back(*down(v, own));
    }
    return result;
  }

  // By how much each pass lies below the lower of the two crowns that join there as the surface is flooded from its crowns; 0
  // for all others.
  std::vector<double> below_crowns() const {
    Unions flooded(order_.size());
    std::vector<Vertex> crown(order_.size());
    std::iota(crown.begin(), crown.end(), 0u);
    std::vector<double> result(order_.size(), 0.);
    for (const Vertex v : order_)
      for (const Vertex u : near_.of(v)) {
        if (rank_[u] > rank_[v]) continue;
        Vertex a = flooded.root(v), b = flooded.root(u);
        if (a == b) continue;
        if (rank_[crown[a]] > rank_[crown[b]]) std::swap(a, b);  // the higher crown stays
        if (crown[b] != v) result[v] = std::max(result[v], depth_[v] - depth_[crown[b]]);
        flooded.join(a, b);
      }
    return result;
  }
  // Passes at which two pits join that were apart, as the surface is flooded from its pits.
  std::vector<std::uint8_t> joins_pits() const {
    Unions flooded(order_.size());
    std::vector<std::uint8_t> result(order_.size(), 0);
    for (auto at = order_.rbegin(); at != order_.rend(); ++at) {
      int joined = 0;
      for (const Vertex u : near_.of(*at)) {
        if (rank_[u] < rank_[*at]) continue;
        const Vertex a = flooded.root(*at), b = flooded.root(u);
        if (a != b) flooded.join(a, b), ++joined;
      }
      result[*at] = joined > 1;
    }
    return result;
  }

 private:
  const Ribbon& ribbon_;
  std::span<const double> depth_;
  const Neighbours near_;
  const Links links_;
  std::vector<Vertex> order_;
  std::vector<std::uint32_t> rank_;
};

using Graph = std::map<Vertex, std::set<Vertex>>;

// From a vertex and its neighbour on to the next one with another number of neighbours than two.
std::vector<Vertex> way(const Graph& graph, Vertex from, Vertex to) {
  std::vector<Vertex> result{from, to};
  while (result.back() != from && graph.at(result.back()).size() == 2) {
    const auto& next = graph.at(result.back());
    const Vertex before = result[result.size() - 2];
    result.push_back(*next.begin() == before ? *next.rbegin() : *next.begin());
  }
  return result;
}

double length_of(const std::vector<Place>& at, const std::vector<Vertex>& way) {
  double sum = 0.;
  for (std::size_t i = 1; i < way.size(); ++i) sum += (at[way[i]] - at[way[i - 1]]).norm();
  return sum;
}

// µm²: of all edges.
double mean_square_edge(const Ribbon& ribbon) {
  double square = 0.;
  for (const Triangle& t : ribbon.triangles)
    for (std::size_t e = 0; e < 3; ++e)
      square += (ribbon.middle[t[e]] - ribbon.middle[t[(e + 1) % 3]]).squaredNorm();
  return square / (3. * double(ribbon.triangles.size()));
}

// By how much each vertex is deeper than what lies around it, seen over `reach` µm (a standard deviation).
std::vector<double> below_surroundings(const Ribbon& ribbon, std::span<const double> depth, double reach) {
  const Neighbours near = neighbours(ribbon.size(), ribbon.triangles);
  // A round takes the mean of a vertex and its six neighbours or so.
  const auto rounds = std::lround(7. / 3. * reach * reach / mean_square_edge(ribbon));
  std::vector<double> mean(depth.begin(), depth.end()), next(depth.size());
  for (long round = 0; round < rounds; ++round) {
    parallel_for(mean.size(), 2048, [&](std::size_t v) {
      const auto around = near.of(v);
      double sum = mean[v];
      for (const Vertex u : around) sum += mean[u];
      next[v] = sum / double(around.size() + 1);
    });
    mean.swap(next);
  }
  for (std::size_t v = 0; v < mean.size(); ++v) mean[v] = depth[v] - mean[v];
  return mean;
}

// Takes away ways that end freely and are short, on which depth hardly changes, or which go straight up a bank: half of their places
// are no deeper than what lies around them.
void prune(Graph& graph, const Ribbon& ribbon, std::span<const double> depth, const SulcusOptions& options) {
  constexpr double around = 2e3;  // µm
  const std::vector<Place>& at = ribbon.outer;
  const std::vector<double> below = below_surroundings(ribbon, depth, around);
  const auto on_bank = [&](const std::vector<Vertex>& spur) {
    return 2 * std::ranges::count_if(spur, [&](Vertex v) { return below[v] <= 0.; }) >=
           std::ptrdiff_t(spur.size());
  };
  const auto faint = [&](const std::vector<Vertex>& spur) {
    const auto [least, most] = std::ranges::minmax(spur, {}, [&](Vertex v) { return depth[v]; });
    return depth[most] - depth[least] < options.persistence;
  };
  for (bool more = true; more;) {
    more = false;
    std::vector<Vertex> ends;
    for (const auto& [v, next] : graph)
      if (next.size() == 1) ends.push_back(v);
    for (const Vertex end : ends) {
      if (graph[end].size() != 1) continue;
      const auto spur = way(graph, end, *graph[end].begin());
      if (length_of(at, spur) >= options.shortest_spur && !faint(spur) && !on_bank(spur)) continue;
      for (std::size_t i = 1; i < spur.size(); ++i)
        graph[spur[i]].erase(spur[i - 1]), graph[spur[i - 1]].erase(spur[i]);
      more = true;
    }
  }
}

}  // namespace

std::vector<double> sulcal_depth(const Ribbon& ribbon, double scale) {
  // In a unit of time a place spreads by half of the mean squared edge along either axis.
  constexpr int steps = 25;
  const double time = 2. * scale * scale / mean_square_edge(ribbon) / steps;
  const Neighbours near = neighbours(ribbon.size(), ribbon.triangles);
  Drift drift(near);
  std::vector<Place> at = ribbon.middle;
  std::vector<double> depth(at.size(), 0.);
  for (int step = 0; step < steps; ++step) {
    const std::vector<Place> before = at, normals = normals_of(at, ribbon.triangles);
    drift(at, time);
    for (std::size_t v = 0; v < at.size(); ++v) depth[v] += (at[v] - before[v]).dot(normals[v]);
  }
  return depth;
}

std::vector<Line> sulci(const Ribbon& ribbon, const SulcusOptions& options) {
  const std::vector<double> depth = sulcal_depth(ribbon, options.scale);
  const Relief relief(ribbon, depth);
  std::vector<double> outside_wall;
  for (std::size_t v = 0; v < ribbon.size(); ++v)
    if (!ribbon.wall[v]) outside_wall.push_back(depth[v]);
  if (outside_wall.empty()) return {};
  const auto middle =
      outside_wall.begin() + std::ptrdiff_t(options.shallowest * double(outside_wall.size() - 1));
  std::nth_element(outside_wall.begin(), middle, outside_wall.end());
  const double level = *middle;

  const std::vector<double> below = relief.below_crowns();
  const std::vector<std::uint8_t> joins = relief.joins_pits();
  Graph graph;
  for (Vertex pass = 0; pass < ribbon.size(); ++pass) {
    const auto ways = relief.ways_down(pass);
    if (ways.empty() || (!joins[pass] && below[pass] < options.persistence)) continue;
    for (const Vertex first : ways) {
      Vertex from = pass;
      for (std::optional<Vertex> to = first; to; from = *to, to = relief.down(from)) {
        if (ribbon.wall[from] || ribbon.wall[*to] || depth[from] < level || depth[*to] < level) continue;
        graph[from].insert(*to), graph[*to].insert(from);
      }
    }
  }
  prune(graph, ribbon, depth, options);

  constexpr double beside = 4e3;  // µm: as far as its banks
  const std::vector<double> below_banks = below_surroundings(ribbon, depth, beside);
  std::vector<Line> lines;
  std::set<std::pair<Vertex, Vertex>> used;
  const auto add = [&](Vertex from, Vertex to) {
    if (used.contains(std::minmax(from, to))) return;
    const auto vertices = way(graph, from, to);
    double deepest = 0., deeper = 0.;
    for (const Vertex v : vertices)
      deepest = std::max(deepest, depth[v] - level), deeper = std::max(deeper, below_banks[v]);
    Line line{.kind = Line::Kind::sulcus, .points = {}, .triangles = {}, .strength = 0., .closed = false};
    for (const Vertex v : vertices)
      line.points.push_back(ribbon.middle[v]), line.strength += depth[v] / double(vertices.size());
    for (std::size_t i = 1; i < vertices.size(); ++i) used.insert(std::minmax(vertices[i - 1], vertices[i]));
    // A ring that hangs at a node stays there.
    line.closed = vertices.front() == vertices.back() && graph.at(vertices.front()).size() == 2;
    // On a ball the least unevenness has passes and pits; there is no sulcus.
    if (deepest < options.persistence || deeper < options.persistence) return;
    lines.push_back(std::move(line));
  };
  for (const auto& [v, next] : graph)
    if (next.size() != 2)
      for (const Vertex u : next) add(v, u);
  for (const auto& [v, next] : graph)  // what is left are rings without a node
    if (next.size() == 2) add(v, *next.begin());
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Line& one, const Line& two) { return one.strength > two.strength; });
  const RibbonLocator locator(ribbon);
  parallel_for(lines.size(), 4, [&](std::size_t i) {
    lines[i] = faired(lines[i], ribbon, locator, options.smooth, ribbon.outer);
  });
  return lines;
}

double share_near(const Mesh& surface, std::span<const std::uint8_t> left_out, const TriangleTree& places,
                  double within) {
  constexpr int parts = 4;  // of a triangle's sides
  std::vector<double> near(surface.triangles.size(), 0.), whole(surface.triangles.size(), 0.);
  parallel_for(near.size(), 256, [&](std::size_t i) {
    const Triangle& t = surface.triangles[i];
    if (left_out[t[0]] || left_out[t[1]] || left_out[t[2]]) return;
    const Place a = surface.positions[t[0]].cast<double>(), u = surface.positions[t[1]].cast<double>() - a,
                v = surface.positions[t[2]].cast<double>() - a;
    whole[i] = u.cross(v).norm();
    int met = 0;
    for (int j = 0; j < parts; ++j)
      for (int k = 0; j + k < parts; ++k)  // the middles of the parts that stand as the triangle does
        met += places.nearest(a + (j + 1. / 3.) / parts * u + (k + 1. / 3.) / parts * v, within).has_value();
    near[i] = whole[i] * met / (.5 * parts * (parts + 1));
  });
  const double all = std::accumulate(whole.begin(), whole.end(), 0.);
  return all > 0. ? std::accumulate(near.begin(), near.end(), 0.) / all : 0.;
}

}  // namespace forest::cortex
