// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/quads.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/cortex/collapse.h"
#include "forest/cortex/crosses.h"
#include "forest/cortex/evening.h"
#include "forest/cortex/lattice.h"
#include "forest/cortex/valence.h"

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
  if (triangles.empty())
    throw Error(fmt::format(
        "nowhere are there {:g} mm between the surfaces, so there is no cortex; check that they are "
        "an outer and an inner one",
        RibbonOptions{}.least_thickness / 1e3));
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
  // How many elements a lattice has jumps with its spacing, by some percent where there are few. So steps by what lies under the ribbon,
  // as spacings are, are followed by tries about the mean of what all before them say.
  const double wanted = (options.whole > 0. ? options.whole : volume) / options.volume;
  constexpr int steps = 6;
  double factor = 1., nearest = 1e300, sum = 0.;
  for (int attempt = 0; nearest >= options.volume_within && attempt < options.attempts; ++attempt) {
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
    const double elements = double(laid.quads.size()), off = std::abs(elements / wanted - 1.);
    if (off < nearest) nearest = off, quads = std::move(laid);
    sum += std::log(factor * elements / wanted);
    factor = attempt + 1 < steps ? factor * elements / std::round(volume / options.volume)
                                 : std::exp(sum / (attempt + 1));
  }

  const Guides guides{.curvatures = curvature, .arms = arms, .by = by, .heights = height, .lines = lines};
  even_volumes(quads, ribbon, guides, volume, options.relaxations, progress);
  return quads;
}

}  // namespace forest::cortex
