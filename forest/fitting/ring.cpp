// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/ring.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "forest/statistics/summary.h"

namespace forest::fitting {
namespace {

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  return std::sqrt(std::transform_reduce(a.begin(), a.end(), b.begin(), 0., std::plus<>(),
                                         [](double x, double y) { return (x - y) * (x - y); }));
}

// A neuron grown of this one, kind by kind: each number of its style is that of the traced neuron it will have it from; then how many
// stems it has, of how many tips, and where these lie.
std::vector<double> description(const Traced& traced, std::span<const Mixed> mixed, std::size_t neuron) {
  const Mixed& of = mixed[neuron];
  std::vector<double> all;
  for (const auto& [kind, unused] : traced.deviations) {
    const std::size_t stems_of = kind == int(SectionKind::basal) ? of.basal_as : of.others_as;
    for (std::size_t s = 0; s < trait::count; ++s) {
      const bool thickness = s == trait::girth || s == trait::thinning;
      const auto& kinds = traced.cells[of_dealt(s) ? neuron : thickness ? of.thin_as : stems_of].kinds;
      const auto found = kinds.find(kind);
      all.push_back(found == kinds.end() ? 0. : found->second.style[s]);
    }
    double stems = 0., tips = 0., farthest = 0.;
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
    for (const Stem* stem : of.stems) {
      if (stem->kind != kind) continue;
      const Vec3 there = stem->place + stem->aim;
      stems += 1., tips += stem->tips, farthest = std::max(farthest, stem->ahead);
      sum += float(stem->tips) * there, squares += float(stem->tips) * there.cwiseAbs2();
    }
    const Vec3 middle = sum / float(std::max(1., tips)),
               spread = (squares / float(std::max(1., tips))).cwiseSqrt();
    for (const double number : {stems, std::log1p(tips), std::log1p(farthest), double(middle.y()),
                                double(spread.x()), double(spread.z())})
      all.push_back(number);
  }
  all.push_back(traced.cells[neuron].soma);
  return all;
}

// In standard deviations from the mean, column by column.
void standardise(std::vector<std::vector<double>>& points) {
  for (std::size_t c = 0; c < points.front().size(); ++c) {
    std::vector<double> values;
    for (const auto& point : points) values.push_back(point[c]);
    const statistics::Summary of = statistics::summarize(values);
    for (auto& point : points) point[c] = of.sd > 1e-9 ? (point[c] - of.mean) / of.sd : 0.;
  }
}

}  // namespace

std::vector<std::size_t> tour(const std::vector<std::vector<double>>& points) {
  const std::size_t count = points.size();
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto apart = [&](std::size_t i, std::size_t j) {
    return distance(points[order[i % count]], points[order[j % count]]);
  };
  for (std::size_t i = 0; i + 2 < count; ++i) {
    std::size_t nearest = i + 1;
    double least = apart(i, nearest);
    for (std::size_t j = i + 2; j < count; ++j)
      if (const double far = apart(i, j); far < least) least = far, nearest = j;
    std::swap(order[i + 1], order[nearest]);
  }
  // What is turned around is no longer than this, so that thousands of neurons take seconds.
  constexpr std::size_t longest = 1000, most_rounds = 100;
  constexpr double rounding = 1e-9;
  bool shorter = true;
  for (std::size_t round = 0; shorter && round < most_rounds; ++round) {
    shorter = false;
    for (std::size_t i = 0; i + 2 < count; ++i) {
      double step = apart(i, i + 1);
      for (std::size_t j = i + 2; j < std::min(count, i + longest); ++j) {
        if ((j + 1) % count == i) continue;
        if (apart(i, j) + apart(i + 1, j + 1) + rounding >= step + apart(j, j + 1)) continue;
        std::reverse(order.begin() + std::ptrdiff_t(i) + 1, order.begin() + std::ptrdiff_t(j) + 1);
        step = apart(i, i + 1), shorter = true;
      }
    }
  }
  return order;
}

std::vector<std::size_t> ring(const Traced& traced, std::span<const Mixed> mixed) {
  std::vector<std::vector<double>> points;
  for (std::size_t i = 0; i < traced.cells.size(); ++i) points.push_back(description(traced, mixed, i));
  standardise(points);
  return tour(points);
}

}  // namespace forest::fitting
