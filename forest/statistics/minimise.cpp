// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/minimise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace forest::statistics {
namespace {

struct Corner {
  std::vector<double> x;
  double cost;
};

}  // namespace

std::vector<double> minimise(const std::function<double(std::span<const double>)>& cost,
                             std::vector<double> begin, const std::vector<double>& steps) {
  const std::size_t n = begin.size();
  const auto at = [&](std::vector<double> x) {
    const double value = cost(x);
    return Corner{std::move(x), std::isfinite(value) ? value : std::numeric_limits<double>::max()};
  };
  for (int round = 0; round < 2; ++round) {  // a simplex that fell flat on the way gets its width back
    std::vector<Corner> corners{at(begin)};
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<double> x = begin;
      x[i] += steps[i];
      corners.push_back(at(std::move(x)));
    }
    for (std::size_t turn = 0; turn < 300 * n; ++turn) {
      std::ranges::sort(corners, {}, &Corner::cost);
      if (corners.back().cost - corners.front().cost <= 1e-13 * (1. + std::abs(corners.front().cost))) break;
      std::vector<double> centre(n, 0.);
      for (std::size_t c = 0; c < n; ++c)
        for (std::size_t i = 0; i < n; ++i) centre[i] += corners[c].x[i] / double(n);
      const auto along = [&](double by) {
        std::vector<double> x(n);
        for (std::size_t i = 0; i < n; ++i) x[i] = centre[i] + by * (corners.back().x[i] - centre[i]);
        return at(std::move(x));
      };
      Corner reflected = along(-1.);
      if (reflected.cost < corners.front().cost) {
        Corner further = along(-2.);
        corners.back() = further.cost < reflected.cost ? std::move(further) : std::move(reflected);
      } else if (reflected.cost < corners[n - 1].cost) {
        corners.back() = std::move(reflected);
      } else {
        Corner inside = along(reflected.cost < corners.back().cost ? -0.5 : 0.5);
        if (inside.cost < std::min(reflected.cost, corners.back().cost)) {
          corners.back() = std::move(inside);
        } else {
          for (std::size_t c = 1; c <= n; ++c) {
            std::vector<double> x = corners[c].x;
            for (std::size_t i = 0; i < n; ++i) x[i] = 0.5 * (x[i] + corners[0].x[i]);
            corners[c] = at(std::move(x));
          }
        }
      }
    }
    begin = std::ranges::min_element(corners, {}, &Corner::cost)->x;
  }
  return begin;
}

}  // namespace forest::statistics
