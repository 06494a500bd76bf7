// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

using Tensor = Eigen::Matrix3d;

// One value a vertex, towards the mean of its neighbours, `rounds` times.
template <class Value>
void smooth(std::vector<Value>& values, const Neighbours& near, int rounds) {
  std::vector<Value> next(values.size());
  for (int round = 0; round < rounds; ++round) {
    parallel_for(values.size(), 2048, [&](std::size_t v) {
      const auto around = near.of(v);
      if (around.empty()) return void(next[v] = values[v]);
      Value sum = values[around[0]];
      for (std::size_t i = 1; i < around.size(); ++i) sum += values[around[i]];
      next[v] = .5 * values[v] + (.5 / double(around.size())) * sum;
    });
    values.swap(next);
  }
}

// The tensor of a triangle by least squares of how the normal turns along its edges, as a matrix in space; zero without area.
Tensor tensor_of(const std::array<Place, 3>& p, const std::array<Place, 3>& n) {
  const Place across = (p[1] - p[0]).cross(p[2] - p[0]);
  if (across.norm() == 0. || (p[1] - p[0]).norm() == 0.) return Tensor::Zero();
  const Place u = (p[1] - p[0]).normalized(), v = across.normalized().cross(u);
  Eigen::Matrix<double, 6, 3> A = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 1> b;
  for (int e = 0; e < 3; ++e) {
    const auto i = std::size_t(e), j = std::size_t((e + 1) % 3);
    const Place edge = p[j] - p[i], turn = n[j] - n[i];
    A.row(2 * e) << edge.dot(u), edge.dot(v), 0.;
    A.row(2 * e + 1) << 0., edge.dot(u), edge.dot(v);
    b[2 * e] = turn.dot(u), b[2 * e + 1] = turn.dot(v);
  }
  const Eigen::Vector3d x = (A.transpose() * A).ldlt().solve(A.transpose() * b);
  if (!x.allFinite()) return Tensor::Zero();
  return x[0] * u * u.transpose() + x[1] * (u * v.transpose() + v * u.transpose()) + x[2] * v * v.transpose();
}

}  // namespace

std::vector<Curvature> curvatures(std::span<const Place> at, std::span<const Triangle> triangles,
                                  const Neighbours& near, double scale) {
  std::vector<Place> places(at.begin(), at.end());
  double square = 0., edges = 0.;
  for (const Triangle& t : triangles)
    for (std::size_t e = 0; e < 3; ++e)
      square += (places[t[e]] - places[t[(e + 1) % 3]]).squaredNorm(), edges += 1.;
  // A round spreads by half of the mean squared edge; half of the rounds go to the places, half to the tensors.
  const int rounds = edges == 0. ? 0 : int(std::lround(scale * scale / (square / edges) / 2.));
  smooth(places, near, rounds);
  const std::vector<Place> normals = normals_of(places, triangles);

  std::vector<Tensor> tensors(places.size(), Tensor::Zero());
  std::vector<double> areas(places.size(), 0.);
  for (const Triangle& t : triangles) {
    const std::array p{places[t[0]], places[t[1]], places[t[2]]};
    const Tensor tensor = tensor_of(p, {normals[t[0]], normals[t[1]], normals[t[2]]});
    const double area = (p[1] - p[0]).cross(p[2] - p[0]).norm();
    for (const std::uint32_t v : t) tensors[v] += area * tensor, areas[v] += area;
  }
  for (std::size_t v = 0; v < tensors.size(); ++v)
    if (areas[v] > 0.) tensors[v] /= areas[v];
  smooth(tensors, near, rounds);

  std::vector<Curvature> result(places.size());
  parallel_for(places.size(), 1024, [&](std::size_t v) {
    const Place n = normals[v];
    if (!(n.squaredNorm() > 0.)) return;
    const Place u = n.unitOrthogonal(), w = n.cross(u);
    const Tensor& T = tensors[v];
    const double a = u.dot(T * u), b = u.dot(T * w), c = w.dot(T * w);
    const double angle = .5 * std::atan2(2. * b, a - c), mean = .5 * (a + c),
                 spread = std::hypot(.5 * (a - c), b);
    const Place most = std::cos(angle) * u + std::sin(angle) * w;
    result[v] = {mean + spread, mean - spread, most, n.cross(most), n};
  });
  return result;
}

namespace {

// Where the extremality of one kind of line vanishes on an edge of the mesh.
struct Crossing {
  Place at;
  double bend, other;  // the curvatures there, across the line and along it, 1/µm
};

// A line is bent no more than this share of its own bend the other way: on a ball, bent alike in all directions, any unevenness would
// make lines. Of folds it is .6 at the most.
constexpr double most_along = .8;

std::vector<Line> lines_of(Line::Kind kind, const Ribbon& ribbon, std::span<const Curvature> curvature,
                           const LineOptions& options) {
  const bool crest = kind == Line::Kind::crest;
  const auto bend = [&](std::uint32_t v) { return crest ? curvature[v].most : -curvature[v].least; };
  const auto other = [&](std::uint32_t v) { return crest ? curvature[v].least : -curvature[v].most; };
  const auto across = [&](std::uint32_t v) {
    return crest ? curvature[v].along_most : curvature[v].along_least;
  };

  // How the bend grows along its own direction, by the slopes of the triangles around.
  const std::vector<Place>& at = ribbon.middle;
  std::vector<Place> slopes(at.size(), Place::Zero());
  std::vector<double> areas(at.size(), 0.);
  for (const Triangle& t : ribbon.triangles) {
    const Place n = (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]);
    const double square = n.squaredNorm();
    if (square == 0.) continue;
    Place slope = Place::Zero();
    for (std::size_t e = 0; e < 3; ++e)
      slope += bend(t[e]) * n.cross(at[t[(e + 2) % 3]] - at[t[(e + 1) % 3]]) / square;
    const double area = std::sqrt(square);
    for (const std::uint32_t v : t) slopes[v] += area * slope, areas[v] += area;
  }
  std::vector<double> growth(at.size(), 0.);
  for (std::uint32_t v = 0; v < at.size(); ++v)
    if (areas[v] > 0.) growth[v] = slopes[v].dot(across(v)) / areas[v];

  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  const auto crossing = [&](std::uint32_t a, std::uint32_t b) -> std::optional<Crossing> {
    if (a > b) std::swap(a, b);
    if (bend(a) <= std::abs(other(a)) || bend(b) <= std::abs(other(b))) return std::nullopt;
    const Place ta = across(a);
    const double ea = growth[a], eb = across(b).dot(ta) < 0. ? -growth[b] : growth[b];
    if ((ea < 0.) == (eb < 0.)) return std::nullopt;
    // A greatest bend, not a least one: it grows from each end towards the middle of the edge.
    if ((ea - eb) * (at[b] - at[a]).dot(ta) <= 0.) return std::nullopt;
    const double share = ea / (ea - eb);
    return Crossing{at[a] + share * (at[b] - at[a]), bend(a) + share * (bend(b) - bend(a)),
                    other(a) + share * (other(b) - other(a))};
  };

  // Pieces, one in each triangle that two of them cross; they join at the edges.
  std::map<Edge, Crossing> crossings;
  std::map<Edge, std::vector<std::pair<std::uint32_t, Edge>>>
      joins;  // by way of which triangle to which edge
  for (std::uint32_t i = 0; i < ribbon.triangles.size(); ++i) {
    const Triangle& t = ribbon.triangles[i];
    if (ribbon.is_wall(t)) continue;
    std::vector<Edge> met;
    for (std::size_t e = 0; e < 3; ++e) {
      const Edge edge = std::minmax(t[e], t[(e + 1) % 3]);
      if (const auto c = crossing(edge.first, edge.second)) met.push_back(edge), crossings.insert({edge, *c});
    }
    if (met.size() != 2) continue;
    joins[met[0]].push_back({i, met[1]}), joins[met[1]].push_back({i, met[0]});
  }

  std::vector<Line> lines;
  std::map<Edge, bool> used;
  const auto follow = [&](const Edge& start) {
    Line line{.kind = kind, .points = {}, .triangles = {}, .strength = 0., .closed = false};
    Edge here = start;
    double along = 0.;  // of the strength, what it would be the other way
    std::optional<std::uint32_t> by;
    for (;;) {
      line.points.push_back(crossings.at(here).at);
      used[here] = true;
      const auto& ways = joins.at(here);
      const auto way = std::find_if(ways.begin(), ways.end(), [&](const auto& w) { return w.first != by; });
      if (way == ways.end()) break;
      const Crossing &a = crossings.at(here), &b = crossings.at(way->second);
      line.strength += .5 * (a.bend + b.bend) * (b.at - a.at).norm();
      along += .5 * (a.other + b.other) * (b.at - a.at).norm();
      line.triangles.push_back(way->first);
      by = way->first, here = way->second;
      if (here == start) {
        line.points.push_back(crossings.at(here).at), line.closed = true;
        break;
      }
    }
    if (along > most_along * line.strength) line.strength = 0.;
    return line;
  };
  const auto keep = [&](Line line) {
    if (line.points.size() > 1 && line.length() >= options.least_length &&
        line.strength >= options.least_strength)
      lines.push_back(std::move(line));
  };
  for (const auto& [edge, ways] : joins)
    if (ways.size() == 1 && !used[edge]) keep(follow(edge));
  for (const auto& [edge, ways] : joins)
    if (!used[edge]) keep(follow(edge));
  return lines;
}

}  // namespace

double Line::length() const {
  double sum = 0.;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

Place Line::direction(std::size_t piece, double reach) const {
  const Place middle = .5 * (points[piece] + points[piece + 1]);
  const auto walk = [&](std::size_t from, int step) {
    double way = 0.;
    Place at = middle;
    for (std::size_t i = from;; i += std::size_t(step)) {
      const double next = (points[i] - at).norm();
      if (way + next >= reach) return Place(at + (reach - way) / next * (points[i] - at));
      way += next, at = points[i];
      if (step < 0 ? i == 0 : i + 1 == points.size()) return at;
    }
  };
  const Place along = walk(piece + 1, 1) - walk(piece, -1);
  return along.norm() > 0. ? Place(along.normalized()) : Place(Place::Zero());
}

namespace {

// A round draws every point half way to the middle of its neighbours; ends stay where they are.
void fair(std::vector<Place>& points, bool closed, int rounds) {
  const std::size_t n = points.size() - 1;  // of a closed line the last point is the first one again
  for (int round = 0; round < rounds; ++round) {
    std::vector<Place> next = points;
    for (std::size_t i = closed ? 0 : 1; i < n; ++i)
      next[i] = .5 * points[i] + .25 * (points[(i + n - 1) % n] + points[i + 1]);
    if (closed) next[n] = next[0];
    points = std::move(next);
  }
}

}  // namespace

Line faired(const Line& line, const Ribbon& ribbon, const RibbonLocator& locator, double scale,
            const std::vector<Place>& level) {
  const double length = line.length();
  const auto pieces = std::size_t(std::max(4., std::round(length / 200.)));
  const double step = length / double(pieces);
  Line result{line.kind, {line.points.front()}, {}, line.strength, line.closed};
  double way = 0.;
  for (std::size_t i = 1; i < line.points.size() && result.points.size() < pieces; ++i) {
    const Place &a = line.points[i - 1], &b = line.points[i];
    const double along = (b - a).norm();
    for (double next;
         (next = step * double(result.points.size())) <= way + along && result.points.size() < pieces;)
      result.points.push_back(a + (next - way) / std::max(along, 1e-9) * (b - a));
    way += along;
  }
  result.points.push_back(line.points.back());
  fair(result.points, line.closed, int(std::lround(2. * scale * scale / (step * step))));
  std::vector<Place> middle;
  for (Place& point : result.points) {
    const RibbonPoint found = locator.nearest(point);
    middle.push_back(on(ribbon.middle, ribbon, found)), point = on(level, ribbon, found);
  }
  if (line.closed) middle.back() = middle.front(), result.points.back() = result.points.front();
  for (std::size_t i = 1; i < middle.size(); ++i)
    result.triangles.push_back(locator.nearest(.5 * (middle[i - 1] + middle[i])).triangle);
  return result;
}

std::vector<Line> borders(const Ribbon& ribbon) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::map<Edge, std::pair<int, std::uint32_t>> edges;  // times met, the triangle
  for (std::uint32_t i = 0; i < ribbon.triangles.size(); ++i) {
    const Triangle& t = ribbon.triangles[i];
    if (ribbon.is_wall(t)) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      auto& met = edges[std::minmax(t[e], t[(e + 1) % 3])];
      ++met.first, met.second = i;
    }
  }
  std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, std::uint32_t>>>
      next;  // vertex → (vertex, triangle)
  for (const auto& [edge, met] : edges)
    if (met.first == 1) {
      next[edge.first].push_back({edge.second, met.second});
      next[edge.second].push_back({edge.first, met.second});
    }
  std::vector<Line> lines;
  std::map<Edge, bool> used;
  for (const auto& [start, ways] : next) {
    Line line{.kind = Line::Kind::border,
              .points = {ribbon.middle[start]},
              .triangles = {},
              .strength = 0.,
              .closed = false};
    for (std::uint32_t here = start;;) {
      const auto& on = next.at(here);
      const auto way = std::find_if(on.begin(), on.end(),
                                    [&](const auto& w) { return !used[std::minmax(here, w.first)]; });
      if (way == on.end()) break;
      used[std::minmax(here, way->first)] = true;
      line.triangles.push_back(way->second);
      here = way->first;
      line.points.push_back(ribbon.middle[here]);
    }
    if (line.points.size() < 4) continue;
    line.closed = line.points.front() == line.points.back();
    fair(line.points, line.closed, 30);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<Line> crests_and_valleys(const Ribbon& ribbon, std::span<const Curvature> curvature,
                                     const LineOptions& options) {
  std::vector<Line> lines = lines_of(Line::Kind::crest, ribbon, curvature, options);
  for (Line& line : lines_of(Line::Kind::valley, ribbon, curvature, options))
    lines.push_back(std::move(line));
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Line& one, const Line& two) { return one.strength > two.strength; });
  constexpr double smooth = 2. / 3.;
  const RibbonLocator locator(ribbon);
  parallel_for(lines.size(), 4, [&](std::size_t i) {
    lines[i] = faired(lines[i], ribbon, locator, smooth * options.scale, ribbon.middle);
  });
  return lines;
}

Mesh pieces(std::span<const Line> lines, Line::Kind kind) {
  Mesh mesh;
  for (const Line& line : lines) {
    if (line.kind != kind) continue;
    for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
      const auto first = std::uint32_t(mesh.positions.size());
      mesh.positions.push_back(line.points[i].cast<float>());
      mesh.positions.push_back(line.points[i + 1].cast<float>());
      mesh.triangles.push_back({first, first + 1, first + 1});
    }
  }
  return mesh;
}

std::vector<Place> directions(std::span<const Line> lines, Line::Kind kind) {
  std::vector<Place> result;
  for (const Line& line : lines)
    for (std::size_t i = 0; line.kind == kind && i + 1 < line.points.size(); ++i)
      result.push_back(line.direction(i));
  return result;
}

}  // namespace forest::cortex
