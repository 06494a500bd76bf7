// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/borders.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/elements.h"
#include "forest/cortex/gauss.h"
#include "forest/cortex/ribbon.h"

namespace forest::cortex {
namespace {

// Gauss and Legendre on [0, 1].
const GaussRule& rule() {
  static const GaussRule result = [] {
    GaussRule rule = gauss_rule();
    for (double& at : rule.at) at = .5 + .5 * at;
    for (double& weight : rule.weight) weight /= 2.;
    return rule;
  }();
  return result;
}

// The cubic through the four places of a curve.
Place on_curve(const Depths& curve, double w) {
  const double t = 3. * w;
  return -(t - 1.) * (t - 2.) * (t - 3.) / 6. * curve[0] + t * (t - 2.) * (t - 3.) / 2. * curve[1] -
         t * (t - 1.) * (t - 3.) / 2. * curve[2] + t * (t - 1.) * (t - 2.) / 6. * curve[3];
}

}  // namespace

Borders::Borders(const Layers& layers, std::span<const double> depths)
    : layers_(layers), depths_(depths.begin(), depths.end()) {}

Borders::Borders(const std::array<std::vector<double>, 4>& ends) : ends_(ends) {}

double Borders::end(double u, double v, std::size_t layer) const {
  if (!depths_.empty()) return layers_.w(u, v, depths_[layer]);
  return (1. - v) * ((1. - u) * ends_[0][layer] + u * ends_[1][layer]) +
         v * ((1. - u) * ends_[2][layer] + u * ends_[3][layer]);
}

std::pair<double, double> Borders::range(std::size_t layer) const {
  if (!depths_.empty()) return layers_.range(layer ? depths_[layer - 1] : 0., depths_[layer]);
  std::pair result{1., 0.};
  for (const auto& corner : ends_) {
    result.first = std::min(result.first, layer ? corner[layer - 1] : 0.);
    result.second = std::max(result.second, corner[layer]);
  }
  return result;
}

double Borders::volume(const Hexahedron& element, std::size_t layer) const {
  if (!depths_.empty()) return layers_.volume(element, layer ? depths_[layer - 1] : 0., depths_[layer]);
  double sum = 0.;
  for (std::size_t j = 0; j < 5; ++j)
    for (std::size_t i = 0; i < 5; ++i) {
      const double u = rule().at[i], v = rule().at[j], from = begin(u, v, layer), to = end(u, v, layer);
      for (std::size_t k = 0; k < 5; ++k)
        sum += rule().weight[i] * rule().weight[j] * rule().weight[k] * (to - from) *
               element.jacobian(u, v, from + (to - from) * rule().at[k]).determinant();
    }
  return sum;
}

LayerShares shares_of(const Mesh& surface, std::span<const std::vector<float>> thickness) {
  const std::size_t n = surface.positions.size();
  LayerShares result;
  result.of_layers.assign(thickness.size(), std::vector<double>(n, 0.));
  std::vector<std::uint8_t> known(n, 0);
  for (std::size_t v = 0; v < n; ++v) {
    double sum = 0.;
    for (std::size_t l = 0; l < thickness.size(); ++l) {
      if (thickness[l][v] < 0.f)
        throw Error(fmt::format("layer {} has a thickness of {:.3g} at vertex {}; give maps of thickness",
                                l + 1, thickness[l][v], v));
      sum += double(thickness[l][v]);
    }
    if (!(sum > 0. && std::isfinite(sum))) continue;
    known[v] = 1;
    for (std::size_t l = 0; l < thickness.size(); ++l) result.of_layers[l][v] = double(thickness[l][v]) / sum;
  }
  result.measured = known;
  if (std::ranges::count(known, 1) == 0)
    throw Error("no thickness of any layer is above 0; give maps of thickness");

  // Into what is not measured from its rim, ring by ring.
  const Neighbours near = neighbours(n, surface.triangles);
  std::vector<std::uint32_t> ring;
  do {
    ring.clear();
    for (std::uint32_t v = 0; v < n; ++v) {
      if (known[v]) continue;
      double count = 0.;
      for (const std::uint32_t u : near.of(v))
        if (known[u] == 1) {
          count += 1.;
          for (auto& layer : result.of_layers) layer[v] += layer[u];
        }
      if (count > 0.) ring.push_back(v);
      for (auto& layer : result.of_layers)
        if (count > 0.) layer[v] /= count;
    }
    for (const std::uint32_t v : ring) known[v] = 1;
  } while (!ring.empty());
  return result;
}

MeasuredBorders::MeasuredBorders(const Elements& elements, const Mesh& outer, const LayerShares& shares)
    : layers_(shares.of_layers.size()),
      ends_(std::size_t(elements.corners) * layers_),
      measured_(elements.corners) {
  constexpr double near = 300.;  // µm: faces lie a few tens from the surface that they were built from
  constexpr int steps = 48;
  const TriangleTree tree(outer);
  std::vector<double> off(elements.corners, INFINITY);
  parallel_for(elements.corners, 256, [&](std::size_t c) {
    const Depths& curve = elements.curves[c];
    const auto hit = tree.nearest(curve[0]);
    if (!hit) return;
    off[c] = hit->distance;
    const Triangle& triangle = outer.triangles[hit->triangle];
    measured_[c] =
        shares.measured[triangle[0]] && shares.measured[triangle[1]] && shares.measured[triangle[2]];
    const auto at = [&](std::size_t k) -> Place { return outer.positions[triangle[k]].cast<double>(); };
    const Place weights = barycentric(at(0), at(1), at(2), hit->at);
    std::vector<double> share(layers_, 0.);
    double all = 0.;
    for (std::size_t l = 0; l < layers_; ++l) {
      for (std::size_t k = 0; k < 3; ++k) share[l] += weights[int(k)] * shares.of_layers[l][triangle[k]];
      all += share[l];
    }
    // Lengths up to each step, and the w at which a share of all is reached.
    std::array<double, steps + 1> way{};
    Place before = curve[0];
    for (int s = 1; s <= steps; ++s) {
      const Place next = on_curve(curve, double(s) / steps);
      way[std::size_t(s)] = way[std::size_t(s) - 1] + (next - before).norm(), before = next;
    }
    double sum = 0.;
    for (std::size_t l = 0, s = 0; l < layers_; ++l) {
      sum += share[l];
      const double wanted = all > 0. ? way[steps] * std::min(1., sum / all) : 0.;
      while (s + 1 < steps && way[s + 1] < wanted) ++s;
      const double piece = way[s + 1] - way[s];
      const double w = (double(s) + (piece > 0. ? std::min(1., (wanted - way[s]) / piece) : 1.)) / steps;
      ends_[c * layers_ + l] = l + 1 == layers_ ? 1.f : float(w);
    }
  });
  const auto farthest = std::ranges::max_element(off);
  std::size_t away = 0;
  for (const double d : off) away += !(d <= near);
  if (away > 0 && away * 100 > off.size()) {
    const Place& at = elements.curves[std::size_t(farthest - off.begin())][0];
    throw Error(
        fmt::format("{} of {} corners of elements lie more than .3 mm from the surface of the maps, that at "
                    "({:.1f}, {:.1f}, "
                    "{:.1f}) mm by {:.1f} mm; give the outer surface that the elements were built from",
                    away, off.size(), at.x() / 1e3, at.y() / 1e3, at.z() / 1e3, *farthest / 1e3));
  }
}

Borders MeasuredBorders::of(const Elements& elements, std::size_t element) const {
  std::array<std::vector<double>, 4> ends;
  const auto corners = elements.corners_of(element);
  for (std::size_t c = 0; c < 4; ++c) {
    const auto first = ends_.begin() + std::ptrdiff_t(corners[c] * layers_);
    ends[c].assign(first, first + std::ptrdiff_t(layers_));
  }
  return Borders(ends);
}

bool MeasuredBorders::measured(const Elements& elements, std::size_t element) const {
  return std::ranges::all_of(elements.corners_of(element),
                             [&](std::uint32_t c) { return measured_[c] != 0; });
}

}  // namespace forest::cortex
