// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/bok.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"
#include "forest/cortex/depth.h"
#include "forest/cortex/human_layers.h"

namespace forest::cortex {
namespace {

constexpr double l1_end = layer_top(1), l6_begin = layer_top(5);

std::vector<double> areas_around(std::span<const Place> places, std::span<const Triangle> triangles,
                                 const Neighbours& near, int rounds) {
  std::vector<double> areas(places.size(), 0.), next(places.size());
  for (const Triangle& t : triangles) {
    const double area = (places[t[1]] - places[t[0]]).cross(places[t[2]] - places[t[0]]).norm() / 6.;
    for (const std::uint32_t v : t) areas[v] += area;
  }
  // Half of what a vertex has goes to its neighbours in equal parts: a sum of areas, whatever the mesh.
  for (int round = 0; round < rounds; ++round) {
    parallel_for(areas.size(), 2048, [&](std::size_t v) {
      next[v] = .5 * areas[v];
      for (const std::uint32_t u : near.of(v)) next[v] += .5 * areas[u] / double(near.of(u).size());
    });
    areas.swap(next);
  }
  return areas;
}

}  // namespace

std::vector<double> folds(std::span<const Place> outer, std::span<const Place> inner,
                          std::span<const Triangle> triangles, double scale) {
  double square = 0.;  // of the edges half way
  for (const Triangle& t : triangles)
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t[e], b = t[(e + 1) % 3];
      square += .25 * (outer[a] + inner[a] - outer[b] - inner[b]).squaredNorm();
    }
  square /= std::max(1., 3. * double(triangles.size()));
  // A round spreads by half of the mean squared edge.
  const int rounds = square > 0. ? int(std::lround(2. * scale * scale / square)) : 0;
  const Neighbours near = neighbours(outer.size(), triangles);
  const auto out = areas_around(outer, triangles, near, rounds),
             in = areas_around(inner, triangles, near, rounds);
  std::vector<double> folds(outer.size(), 0.);
  for (std::size_t v = 0; v < folds.size(); ++v)
    if (out[v] > 0. && in[v] > 0.) folds[v] = std::log(out[v] / in[v]);
  return folds;
}

double way_of_volume(double fold, double share) {
  // Cross-section a at the outside, 1 inside: a x + (1 − a) x² / 2 = share (a + 1) / 2, solved without cancellation.
  const double a = std::exp(fold);
  return share * (a + 1.) / (a + std::sqrt(a * a + share * (1. - a) * (1. + a)));
}

double crown_over_fundus(std::span<const double> folds, std::span<const double> values) {
  const std::size_t tenth = folds.size() / 10;
  if (tenth == 0) return 0.;
  std::vector<std::size_t> order(folds.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return folds[a] < folds[b]; });
  double crown = 0., fundus = 0.;
  for (std::size_t i = 0; i < tenth; ++i)
    fundus += values[order[i]], crown += values[order[order.size() - 1 - i]];
  return fundus > 0. ? crown / fundus : 0.;
}

Bok bok(std::span<const double> folds, Shares shares) {
  std::vector<double> l1(folds.size(), l1_end), l6(folds.size(), 1. - l6_begin);
  for (std::size_t i = 0; shares == Shares::of_volume && i < folds.size(); ++i)
    l1[i] = way_of_volume(folds[i], l1_end), l6[i] = 1. - way_of_volume(folds[i], l6_begin);
  return {crown_over_fundus(folds, l1), crown_over_fundus(folds, l6)};
}

MeasuredBok bok(std::span<const Place> outer, std::span<const Place> inner,
                std::span<const Triangle> triangles, std::span<const std::vector<float>> layers) {
  const std::vector<double> all = folds(outer, inner, triangles);
  std::vector<double> fold, l1, l6;
  for (std::size_t v = 0; v < all.size(); ++v) {
    double sum = 0.;
    for (const auto& layer : layers) sum += double(layer[v]);
    if (!(sum > 0.)) continue;  // the wall
    fold.push_back(all[v]);
    l1.push_back(double(layers.front()[v]) / sum), l6.push_back(double(layers.back()[v]) / sum);
  }
  return {{crown_over_fundus(fold, l1), crown_over_fundus(fold, l6)}, bok(fold), fold.size()};
}

Bok bok(const Elements& elements, Shares shares) {
  std::vector<Place> outer, inner;
  std::vector<Triangle> triangles;
  for (std::uint32_t c = 0; c < elements.corners; ++c)
    outer.push_back(elements.curves[c][0]), inner.push_back(elements.curves[c][3]);
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const auto c = elements.corners_of(e);
    triangles.push_back({c[0], c[1], c[3]}), triangles.push_back({c[0], c[3], c[2]});
  }
  const std::vector<double> of_corners = folds(outer, inner, triangles);
  std::vector<double> fold(elements.size()), l1(elements.size()), l6(elements.size());
  parallel_for(elements.size(), 256, [&](std::size_t e) {
    for (const std::uint32_t c : elements.corners_of(e)) fold[e] += .25 * of_corners[c];
    const Hexahedron h = elements.hexahedron(e);
    const auto length = [&](double from, double to) {
      constexpr int steps = 8;
      double sum = 0.;
      Place before = h.at(.5, .5, from);
      for (int i = 1; i <= steps; ++i) {
        const Place next = h.at(.5, .5, from + (to - from) * i / steps);
        sum += (next - before).norm(), before = next;
      }
      return sum;
    };
    const Layers layers(elements, e);
    const double top = layers.w(.5, .5, l1_end), bottom = layers.w(.5, .5, l6_begin);
    const double first = length(0., top), middle = length(top, bottom), last = length(bottom, 1.);
    const double all = first + middle + last;
    const bool by_volume = shares == Shares::of_volume && all > 0.;
    l1[e] = by_volume ? first / all : l1_end, l6[e] = by_volume ? last / all : 1. - l6_begin;
  });
  return {crown_over_fundus(fold, l1), crown_over_fundus(fold, l6)};
}

}  // namespace forest::cortex
