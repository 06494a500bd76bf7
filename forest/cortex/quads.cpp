// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/quads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/collapse.h"
#include "forest/cortex/crosses.h"
#include "forest/cortex/lattice.h"
#include "forest/cortex/valence.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

// Volume under a unit of area of the middle, µm, at every vertex: of the triangles within three rings, about as many as one
// element has, since that of single ones on a crumpled surface says nothing.
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
  const Neighbours near = neighbours(ribbon.size(), ribbon.triangles);
  for (int round = 0; round < 2; ++round)
    for (std::vector<double>* all : {&volumes, &areas}) {
      std::vector<double> sums = *all;
      for (std::size_t v = 0; v < sums.size(); ++v)
        for (const std::uint32_t other : near.of(std::uint32_t(v))) sums[v] += (*all)[other];
      all->swap(sums);
    }
  for (std::size_t v = 0; v < volumes.size(); ++v)
    volumes[v] = areas[v] > 0. ? std::clamp(volumes[v] / areas[v], 200., 1e4) : 0.;
  return volumes;
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
  std::vector<double> areas(ribbon.size(), 0.);
  for (const Triangle& t : ribbon.triangles)
    for (const std::uint32_t v : t)
      areas[v] += (ribbon.middle[t[1]] - ribbon.middle[t[0]])
                      .cross(ribbon.middle[t[2]] - ribbon.middle[t[0]])
                      .norm() /
                  6.;

  progress.begin("laying the lattice of elements", 0);
  Level finest;
  finest.starts = own.starts, finest.list = own.list, finest.weights.assign(own.list.size(), 1.f);
  for (const std::uint32_t v : vertices)
    finest.sites.push_back({.at = ribbon.middle[v],
                            .normal = curvature[v].normal,
                            .along = arms[v],
                            .spacing = 0.,
                            .area = areas[v],
                            .point = ribbon.middle[v],
                            .line = by[v]});
  Lattice lattice(std::move(finest));
  progress.end();

  Quads quads;
  const double count = std::round(volume / options.volume);
  double factor = 1., nearest = 1e300;
  for (int attempt = 0; attempt < 6; ++attempt) {
    progress.begin("laying the lattice of elements", 0);
    std::vector<double> spacings;
    for (const std::uint32_t v : vertices)
      spacings.push_back(2. * std::sqrt(factor * options.volume / height[v]));
    const Level& settled = lattice.settle(spacings);
    progress.end();
    progress.begin("collapsing triangles to the lattice", 0);
    Quads laid = halved(collapsed(settled, triangles));
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
      border_tree(pieces(lines, Line::Kind::border)), crest_tree(pieces(lines, Line::Kind::crest));
  std::vector<Place> crest_along;  // of every piece in the tree
  for (const Line& line : lines)
    for (std::size_t i = 0; line.kind == Line::Kind::crest && i + 1 < line.points.size(); ++i)
      crest_along.push_back(line.direction(i));

  const std::size_t n = quads.middle.size();
  quads.points.resize(n);
  std::vector<double> under(n), held(n);  // held: to the directions of a line
  std::vector<Place> up(n), arm(n);
  std::vector<std::uint8_t> border(n, 0);  // sides that only one face has, of every vertex
  constexpr double hold = .6;

  constexpr double evenly = .65;  // stronger, sides turn from crests; weaker, volumes stay uneven
  const double by_a_crest = std::cbrt(options.volume);
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
    held[v] = by[c[main]] ? hold : 0.;
    // By a crest sides run along it and across it, the more so the nearer.
    if (const auto hit = border[v] ? std::nullopt : crest_tree.nearest(quads.middle[v], by_a_crest)) {
      const Place& normal = curvature[c[main]].normal;
      const double share = std::min(1., 2. * (1. - hit->distance / by_a_crest));
      Place along = crest_along[hit->triangle];
      if (std::abs(along.dot(normal.cross(arm[v]))) > std::abs(along.dot(arm[v])))
        along = along.cross(normal);
      arm[v] = ((1. - share) * arm[v] + std::copysign(share, along.dot(arm[v])) * along).normalized();
      held[v] = std::max(held[v], share * hold);
    }
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
      Place step = (last ? 1. - bent : 1. - .7 * bent) * evenly * sum + pull;
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
