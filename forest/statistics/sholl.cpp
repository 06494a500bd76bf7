// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/sholl.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "forest/core/clones.h"

namespace forest::statistics {
namespace {

constexpr double most_spheres = 1e5;  // a stray point must not fill the memory

double sphere(double distance, double scale, double offset) {
  return std::floor(std::min(distance * scale + offset, most_spheres));
}

/// How many spheres are not further from the centre than each point: their numbers count from 1.
FOREST_CLONES void number_spheres(std::size_t count, const double* __restrict distance, double scale,
                                  double offset, std::int32_t* __restrict numbers) {
  for (std::size_t i = 0; i < count; ++i) {
    double number = distance[i] * scale + offset;
    number = number < most_spheres ? number : most_spheres;
    numbers[i] = std::int32_t(number > 0. ? number : 0.);
  }
}

}  // namespace

// Distance from the centre falls along a segment to its nearest point and rises after it; a rise or fall between d and D
// crosses the spheres of radius r with d < r <= D.
std::vector<double> sholl_crossings(const Arbors& arbors, double step, double first) {
  const Columns& c = arbors.columns();
  const double scale = 1. / step, offset = 1. - first / step;
  std::vector<std::int32_t> inside(c.distance.size());
  number_spheres(inside.size(), c.distance.data(), scale, offset, inside.data());
  const std::int32_t last = inside.empty() ? 0 : *std::ranges::max_element(inside);

  std::vector<std::int32_t> change(std::size_t(last) + 2,
                                   0);  // of the number of crossings, from sphere to sphere
  const auto cross = [&](std::int32_t low, std::int32_t high) {
    ++change[std::size_t(low) + 1], --change[std::size_t(high) + 1];
  };
  for (const Branch& b : arbors.sections())
    for (std::size_t i = b.first_row + 1; i <= b.last_row(); ++i) {
      const std::int32_t from = inside[i - 1], to = inside[i];
      const double d = c.distance[i - 1], e = c.distance[i], length = c.length[i];
      const double along =
          0.5 * (length * length + (d - e) * (d + e));  // length times the way to the nearest point
      if (along > 0. && along < length * length) {
        const double way = along / length;
        const double nearest = std::sqrt(std::max(0., (d - way) * (d + way)));
        const auto turn = std::int32_t(std::max(0., sphere(nearest, scale, offset)));
        if (turn < from) cross(turn, from);
        if (turn < to) cross(turn, to);
      } else if (from != to) {
        cross(std::min(from, to), std::max(from, to));
      }
    }
  std::vector<double> counts(std::size_t(last), 0.);
  std::int32_t now = 0;
  for (std::size_t k = 1; k <= counts.size(); ++k) counts[k - 1] = double(now += change[k]);
  return counts;
}

std::vector<double> sholl_crossings(const Arbors& arbors) {
  return sholl_crossings(arbors, sholl_step, sholl_step);
}

}  // namespace forest::statistics
