// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/laplace.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

enum Surface : std::uint8_t { outer_surface, inner_surface };

struct Crossing {
  double at;  // in spacings from the first node
  std::uint8_t surface;
  std::int8_t turn;  // +1: into what the surface encloses, -1: out of it
};

// All crossings of the lattice's lines along one axis, line by line and in order.
struct Lines {
  int rows = 0;  // lines along the first of the other two axes
  std::vector<std::uint32_t> starts;
  std::vector<Crossing> crossings;

  std::span<const Crossing> line(int a, int b) const {
    const std::size_t i = std::size_t(b) * std::size_t(rows) + std::size_t(a);
    return std::span(crossings).subspan(starts[i], starts[i + 1] - starts[i]);
  }
};

// The triangles of a mesh over the lines along an axis. Each triangle decides with the same numbers as its neighbour on
// which side of their edge a line lies, so that a closed surface is crossed as often inwards as outwards.
template <class Visit>
void cross_lines(const Mesh& mesh, const Place& origin, double spacing, int axis,
                 const std::array<int, 3>& counts, Visit&& visit) {
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  std::vector<Place> places;
  places.reserve(mesh.positions.size());
  for (const Vec3& p : mesh.positions) places.push_back((p.cast<double>() - origin) / spacing);
  for (const Triangle& t : mesh.triangles) {
    const std::array<const Place*, 3> p{&places[t[0]], &places[t[1]], &places[t[2]]};
    const auto range = [&](int k) {
      const auto [low, high] = std::minmax({(*p[0])[k], (*p[1])[k], (*p[2])[k]});
      return std::pair(std::max(0, int(std::ceil(low))),
                       std::min(counts[std::size_t(k)] - 1, int(std::floor(high))));
    };
    const auto [a0, a1] = range(a);
    const auto [b0, b1] = range(b);
    for (int y = b0; y <= b1; ++y)
      for (int x = a0; x <= a1; ++x) {
        std::array<double, 3> side{};
        int positive = 0;
        for (std::size_t e = 0; e < 3; ++e) {
          std::size_t from = e, to = (e + 1) % 3;
          const bool swapped = t[from] > t[to];
          if (swapped) std::swap(from, to);
          const double s = ((*p[to])[a] - (*p[from])[a]) * (y - (*p[from])[b]) -
                           ((*p[to])[b] - (*p[from])[b]) * (x - (*p[from])[a]);
          const bool left = s >= 0.;
          side[e] = swapped ? -s : s;
          positive += left != swapped;
        }
        if (positive != 0 && positive != 3) continue;
        const double all = side[0] + side[1] + side[2];
        if (all == 0.) continue;
        const double at = (side[1] * (*p[0])[axis] + side[2] * (*p[1])[axis] + side[0] * (*p[2])[axis]) / all;
        visit(x, y, at, std::int8_t(positive == 3 ? -1 : 1));
      }
  }
}

Lines lines_along(int axis, const Mesh& outer, const Mesh& inner, const Place& origin, double spacing,
                  const std::array<int, 3>& counts) {
  Lines lines;
  lines.rows = counts[std::size_t((axis + 1) % 3)];
  const auto slot = [&](int x, int y) { return std::size_t(y) * std::size_t(lines.rows) + std::size_t(x); };
  std::vector<std::pair<std::uint32_t, Crossing>> found;
  for (const Surface surface : {outer_surface, inner_surface})
    cross_lines(surface == outer_surface ? outer : inner, origin, spacing, axis, counts,
                [&](int x, int y, double at, std::int8_t turn) {
                  found.push_back({std::uint32_t(slot(x, y)), {at, surface, turn}});
                });
  lines.starts.assign(std::size_t(lines.rows) * std::size_t(counts[std::size_t((axis + 2) % 3)]) + 1, 0);
  for (const auto& [line, crossing] : found) ++lines.starts[line + 1];
  for (std::size_t i = 1; i < lines.starts.size(); ++i) lines.starts[i] += lines.starts[i - 1];
  lines.crossings.resize(found.size());
  std::vector<std::uint32_t> next(lines.starts.begin(), lines.starts.end() - 1);
  for (const auto& [line, crossing] : found) lines.crossings[next[line]++] = crossing;
  parallel_for(lines.starts.size() - 1, 1024, [&](std::size_t i) {
    std::sort(lines.crossings.begin() + lines.starts[i], lines.crossings.begin() + lines.starts[i + 1],
              [](const Crossing& one, const Crossing& other) {
                return std::tuple(one.at, one.surface, one.turn) <
                       std::tuple(other.at, other.surface, other.turn);
              });
  });
  return lines;
}

// What a node meets in one direction: another node, or a surface.
struct Link {
  std::int32_t node = -1;  // of the unknowns; below 0: a surface
  float distance = 1.f;    // in spacings, (0, 1]
  float value = 0.f;       // of the surface
};

constexpr float least_distance = 1e-3f;

}  // namespace

struct Laplace::Crossings {
  std::array<Lines, 3> along;

  Link link(const Laplace& field, const std::array<int, 3>& at, int axis, int step) const {
    const std::size_t k = std::size_t(axis);
    const auto line = along[k].line(at[std::size_t((axis + 1) % 3)], at[std::size_t((axis + 2) % 3)]);
    const double here = at[k];
    const auto above = std::upper_bound(line.begin(), line.end(), here,
                                        [](double value, const Crossing& c) { return value < c.at; });
    const Crossing* met = nullptr;
    if (step > 0 && above != line.end() && above->at <= here + 1.) met = &*above;
    if (step < 0 && above != line.begin() && std::prev(above)->at >= here - 1.) met = &*std::prev(above);
    if (met)
      return {-1, std::max(least_distance, float(std::abs(met->at - here))),
              met->surface == outer_surface ? 1.f : 0.f};
    std::array<int, 3> to = at;
    to[k] += step;
    if (const auto node = field.node(to[0], to[1], to[2])) return {std::int32_t(*node), 1.f, 0.f};
    return {-1, 1.f, 1.f};  // surfaces that cut themselves or each other
  }
};

std::optional<std::uint32_t> Laplace::node(int i, int j, int k) const {
  if (i < 0 || j < 0 || k < 0 || i >= counts_[0] || j >= counts_[1] || k >= counts_[2]) return std::nullopt;
  const std::int32_t index =
      index_[(std::size_t(k) * std::size_t(counts_[1]) + std::size_t(j)) * std::size_t(counts_[0]) +
             std::size_t(i)];
  return index < 0 ? std::nullopt : std::optional(std::uint32_t(index));
}

// Those between the surfaces, the even ones first and then the odd ones: what is even is surrounded by what is odd.
struct Laplace::Nodes {
  std::vector<std::array<std::uint16_t, 3>> places;
  std::array<std::size_t, 3> colours{0, 0, 0};  // where each kind begins, and the last ends

  std::size_t size() const { return places.size(); }
  std::array<int, 3> at(std::size_t n) const { return {places[n][0], places[n][1], places[n][2]}; }
};

Laplace::Laplace(const Mesh& outer, const Mesh& inner, const Options& options, Progress& progress)
    : spacing_(options.spacing) {
  lay(outer, inner);
  progress.begin("laying the lattice", 0);
  Crossings crossings;
  for (int axis = 0; axis < 3; ++axis)
    crossings.along[std::size_t(axis)] = lines_along(axis, outer, inner, origin_, spacing_, counts_);
  const Nodes nodes = number(crossings);
  progress.end();
  if (nodes.size() == 0)
    throw Error("no tissue lies between the surfaces; check that the outer one encloses the inner one");
  find_slopes(nodes, crossings, solve(nodes, crossings, options, progress));
}

// Around both surfaces.
void Laplace::lay(const Mesh& outer, const Mesh& inner) {
  Place low = Place::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Mesh* mesh : {&outer, &inner})
    for (const Triangle& t : mesh->triangles)  // a vertex of none is no part of the surface
      for (const std::uint32_t v : t) {
        const Place p = mesh->positions[v].cast<double>();
        low = low.cwiseMin(p), high = high.cwiseMax(p);
      }
  if (!(low.array() <= high.array()).all())
    throw Error("there is no surface; give an outer and an inner one");
  // Odd parts of a spacing, so that planes of whole numbers, in which people place things, hit no node.
  origin_ = low - spacing_ * Place(1.3717, 1.4142, 1.2679);
  double nodes = 1.;
  for (int k = 0; k < 3; ++k) {
    const double count = std::ceil((high[k] - origin_[k]) / spacing_) + 2.;
    nodes *= count;
    if (!(nodes < 2147483647.) || count > double(std::numeric_limits<std::uint16_t>::max()))
      throw Error(
          fmt::format("a lattice of {} mm would have too many nodes for surfaces of this size; give a larger "
                      "spacing, or check that the surfaces are in mm",
                      spacing_ / 1e3));
    counts_[std::size_t(k)] = int(count);
  }
}

Laplace::Nodes Laplace::number(const Crossings& crossings) {
  // Which nodes lie between the surfaces, by the lines along x.
  const std::size_t nx = std::size_t(counts_[0]), ny = std::size_t(counts_[1]), nz = std::size_t(counts_[2]);
  index_.assign(nx * ny * nz, -1);
  parallel_for(ny * nz, 64, [&](std::size_t row) {
    const auto line = crossings.along[0].line(int(row % ny), int(row / ny));
    std::array<int, 2> within{0, 0};
    std::size_t next = 0;
    for (std::size_t i = 0; i < nx && (next < line.size() || within[outer_surface] > 0); ++i) {
      for (; next < line.size() && line[next].at <= double(i); ++next)
        within[line[next].surface] += line[next].turn;
      if (within[outer_surface] > 0 && within[inner_surface] <= 0) index_[row * nx + i] = 0;
    }
  });
  Nodes nodes;
  for (const std::size_t parity : {0u, 1u}) {
    for (std::size_t k = 0; k < nz; ++k)
      for (std::size_t j = 0; j < ny; ++j)
        for (std::size_t i = (parity + j + k) % 2; i < nx; i += 2) {
          std::int32_t& index = index_[(k * ny + j) * nx + i];
          if (index < 0) continue;
          index = std::int32_t(nodes.size());
          nodes.places.push_back({std::uint16_t(i), std::uint16_t(j), std::uint16_t(k)});
        }
    nodes.colours[parity + 1] = nodes.size();
  }
  return nodes;
}

// Of every node, and behind them of a surface.
std::vector<float> Laplace::solve(const Nodes& nodes, const Crossings& crossings, const Options& options,
                                  Progress& progress) {
  struct Row {
    std::array<std::int32_t, 6> nodes;
    std::array<float, 6> weights;  // 0 for what is a surface, whose part is in `constant`
    float constant;
  };
  std::vector<Row> rows(nodes.size());
  parallel_for(nodes.size(), 4096, [&](std::size_t n) {
    Row& row = rows[n];
    double diagonal = 0., constant = 0.;
    std::array<double, 6> weights{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::array<Link, 2> links{crossings.link(*this, nodes.at(n), int(axis), -1),
                                      crossings.link(*this, nodes.at(n), int(axis), 1)};
      const double a = double(links[0].distance), b = double(links[1].distance);
      diagonal += 2. / (a * b);
      for (std::size_t side = 0; side < 2; ++side) {
        const double weight = 2. / ((a + b) * (side == 0 ? a : b));
        const std::size_t slot = 2 * axis + side;
        row.nodes[slot] = links[side].node < 0 ? std::int32_t(nodes.size()) : links[side].node;
        weights[slot] = links[side].node < 0 ? 0. : weight;
        if (links[side].node < 0) constant += weight * double(links[side].value);
      }
    }
    for (std::size_t s = 0; s < 6; ++s) row.weights[s] = float(weights[s] / diagonal);
    row.constant = float(constant / diagonal);
  });

  // Successive over-relaxation, even and odd nodes in turn, which does not depend on the order within each.
  progress.begin("solving the field", 0);
  constexpr float over = 1.8f;
  constexpr std::size_t grain = 16384;
  std::vector<float> values(nodes.size() + 1, .5f);
  bool settled = false;
  for (int round = 0; !settled && round < options.most_rounds; ++round) {
    float change = 0.f;
    for (const std::size_t parity : {0u, 1u}) {
      const std::size_t begin = nodes.colours[parity], count = nodes.colours[parity + 1] - begin;
      std::vector<float> changes(count / grain + 1, 0.f);
      parallel_for((count + grain - 1) / grain, 1, [&](std::size_t block) {
        float most = 0.f;
        for (std::size_t n = begin + block * grain; n < std::min(begin + count, begin + (block + 1) * grain);
             ++n) {
          const Row& row = rows[n];
          float sum = row.constant;
          for (std::size_t s = 0; s < 6; ++s) sum += row.weights[s] * values[std::size_t(row.nodes[s])];
          const float delta = sum - values[n];
          values[n] += over * delta;
          most = std::max(most, std::abs(delta));
        }
        changes[block] = most;
      });
      change = std::max(change, *std::max_element(changes.begin(), changes.end()));
    }
    progress.advance();
    settled = double(change) < options.tolerance;
  }
  progress.end();
  if (!settled)
    throw Error(
        fmt::format("the field between the surfaces does not settle in {} rounds; give a larger spacing, or "
                    "check that they "
                    "are those of a cortex, a few millimetres apart",
                    options.most_rounds));
  return values;
}

void Laplace::find_slopes(const Nodes& nodes, const Crossings& crossings, const std::vector<float>& values) {
  gradients_.resize(nodes.size());
  parallel_for(nodes.size(), 4096, [&](std::size_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      const Link before = crossings.link(*this, nodes.at(n), axis, -1),
                 behind = crossings.link(*this, nodes.at(n), axis, 1);
      const auto value = [&](const Link& link) {
        return double(link.node < 0 ? link.value : values[std::size_t(link.node)]);
      };
      const double a = double(before.distance), b = double(behind.distance), here = double(values[n]);
      gradients_[n][axis] =
          float(((value(behind) - here) * a / b + (here - value(before)) * b / a) / (a + b));
    }
  });
}

std::optional<Place> Laplace::gradient(const Place& place, const Place& heading) const {
  const Place x = (place - origin_) / spacing_;
  const std::array<int, 3> base{int(std::floor(x[0])), int(std::floor(x[1])), int(std::floor(x[2]))};
  const Place f = x - Place(base[0], base[1], base[2]);
  // The slope at a node, if it is one of this side.
  const auto slope = [&](int i, int j, int k) -> std::optional<Place> {
    const auto n = node(i, j, k);
    if (!n) return std::nullopt;
    const Place g = gradients_[*n].cast<double>();
    return g.dot(heading) > 0. ? std::optional(g) : std::nullopt;
  };
  Place sum = Place::Zero();
  double weights = 0.;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> c{base[0] + (corner & 1), base[1] + (corner >> 1 & 1),
                               base[2] + (corner >> 2 & 1)};
    const double weight =
        (corner & 1 ? f[0] : 1. - f[0]) * (corner & 2 ? f[1] : 1. - f[1]) * (corner & 4 ? f[2] : 1. - f[2]);
    std::optional<Place> g = slope(c[0], c[1], c[2]);
    if (!g) {  // beyond a surface: on from two nodes in a row, as an even slope would
      Place guesses = Place::Zero();
      double count = 0.;
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
          std::array<int, 3> one = c, two = c;
          one[axis] += step, two[axis] += 2 * step;
          const auto g1 = slope(one[0], one[1], one[2]);
          const auto g2 = g1 ? slope(two[0], two[1], two[2]) : std::nullopt;
          if (g2) guesses += 2. * *g1 - *g2, count += 1.;
        }
      if (count > 0. && guesses.dot(heading) > 0.) g = guesses / count;
    }
    if (g) sum += weight * *g, weights += weight;
  }
  if (weights < 1e-6 || sum.squaredNorm() == 0.) return std::nullopt;
  return sum / (weights * spacing_);
}

}  // namespace forest::cortex
