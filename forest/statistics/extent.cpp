// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/extent.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "forest/statistics/metric_table.h"

namespace forest::statistics {

// Only the segments in the first and last 1 - part of the length matter; they are found by a histogram and sorted.
double extent_holding(double part, const Arbors& arbors, const std::vector<double>& coordinate) {
  const std::vector<double>& length = arbors.columns().length;
  const double total = sum<statistics::length>(arbors);
  if (!(total > 0.)) return nan;
  const auto [low, high] = std::ranges::minmax(coordinate);
  if (low == high) return 0.;

  constexpr std::size_t bins = 512;
  const double scale = double(bins) / (high - low), spare = (1. - part) * total;
  const auto bin = [low = low, scale](double x) {
    return std::min(bins - 1, std::size_t((x - low) * scale));
  };
  std::array<double, bins> held{};
  for (std::size_t i = 0; i < length.size(); ++i) held[bin(coordinate[i])] += length[i];
  std::size_t first = 0, last = bins - 1;
  for (double sum = held[first]; sum <= spare && first + 1 < bins;) sum += held[++first];
  for (double sum = held[last]; sum <= spare && last > 0;) sum += held[--last];

  using Ends = std::vector<std::pair<double, double>>;  // coordinate, length
  Ends left, right;
  for (std::size_t i = 0; i < length.size(); ++i) {
    const std::size_t b = bin(coordinate[i]);
    if (b > first && b < last) continue;
    if (!(length[i] > 0.)) continue;
    if (b <= first) left.emplace_back(coordinate[i], length[i]);
    if (b >= last) right.emplace_back(-coordinate[i], length[i]);
  }
  std::ranges::sort(left), std::ranges::sort(right);

  // What is cut off on the left leaves so much to cut off on the right.
  double cut_right = 0.;
  std::size_t k = 0;
  while (k + 1 < right.size() && cut_right + right[k].second <= spare) cut_right += right[k++].second;
  double best = 1e300, cut_left = 0.;
  for (const auto& [x, l] : left) {
    while (k > 0 && cut_left + cut_right > spare) cut_right -= right[--k].second;
    best = std::min(best, -right[k].first - x);
    cut_left += l;
    if (cut_left > spare) break;
  }
  return std::max(best, 0.);
}

namespace {

constexpr int halvings = 6;
constexpr std::size_t boxes = std::size_t(1) << halvings;  // along an axis, at the finest

/// Which boxes hold something: a word a row of boxes along x.
using Occupied = std::array<std::uint64_t, boxes * boxes>;

struct Place {
  std::array<double, 3> at;  // in sides of the finest boxes
  std::array<int, 3> box;
};

void set(Occupied& occupied, const std::array<int, 3>& box) {
  occupied[std::size_t(box[2]) * boxes + std::size_t(box[1])] |= std::uint64_t(1) << box[0];
}

/// Marks the boxes that a segment passes after the one that it begins in (Amanatides & Woo 1987, "A fast voxel traversal
/// algorithm for ray tracing").
void mark(Occupied& occupied, const Place& from, const Place& to) {
  std::array<int, 3> box = from.box, step{};
  std::array<double, 3> next{}, width{};  // share of the segment up to the next wall, and between walls
  int walls = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    walls += std::abs(to.box[i] - box[i]);
    step[i] = to.at[i] < from.at[i] ? -1 : 1;
    const double way = std::abs(to.at[i] - from.at[i]);
    width[i] = way > 0. ? 1. / way : 1e300;
    next[i] = way > 0. ? std::abs(box[i] + (step[i] > 0) - from.at[i]) / way : 1e300;
  }
  for (; walls > 0; --walls) {
    std::size_t axis = 3;
    for (std::size_t i = 0; i < 3;
         ++i)  // an axis that is done keeps its box: rounding must not lead past the end
      if (box[i] != to.box[i] && (axis == 3 || next[i] < next[axis])) axis = i;
    box[axis] += step[axis];
    next[axis] += width[axis];
    set(occupied, box);
  }
}

std::size_t count(const Occupied& occupied, std::size_t side) {
  std::size_t n = 0;
  for (std::size_t z = 0; z < side; ++z)
    for (std::size_t y = 0; y < side; ++y) n += std::size_t(std::popcount(occupied[z * boxes + y]));
  return n;
}

/// Boxes of twice the side: eight become one.
void halve(Occupied& occupied, std::size_t side) {
  const int apart = int(boxes / side);  // bits between neighbours along x
  std::uint64_t kept = 0;
  for (int bit = 0; bit < int(boxes); bit += 2 * apart) kept |= std::uint64_t(1) << bit;
  for (std::size_t z = 0; z < side / 2; ++z)
    for (std::size_t y = 0; y < side / 2; ++y) {
      const std::uint64_t four = occupied[2 * z * boxes + 2 * y] | occupied[2 * z * boxes + 2 * y + 1] |
                                 occupied[(2 * z + 1) * boxes + 2 * y] |
                                 occupied[(2 * z + 1) * boxes + 2 * y + 1];
      occupied[z * boxes + y] = (four | four >> apart) & kept;
    }
}

}  // namespace

double box_dimension(const Arbors& arbors) {
  const Columns& c = arbors.columns();
  if (c.x.empty()) return nan;
  const auto [low_x, high_x] = std::ranges::minmax(c.x);
  const auto [low_y, high_y] = std::ranges::minmax(c.y);
  const auto [low_z, high_z] = std::ranges::minmax(c.z);
  const double extent = std::max({high_x - low_x, high_y - low_y, high_z - low_z});
  if (!(extent > 0.)) return nan;
  const double scale = double(boxes) / extent;

  Occupied occupied{};
  const auto place = [&, low_x = low_x, low_y = low_y, low_z = low_z](std::size_t i) {
    Place p{{(c.x[i] - low_x) * scale, (c.y[i] - low_y) * scale, (c.z[i] - low_z) * scale}, {}};
    for (std::size_t k = 0; k < 3; ++k) p.box[k] = std::min(int(p.at[k]), int(boxes) - 1);
    return p;
  };
  for (const Branch& b : arbors.sections()) {
    Place from = place(b.first_row);
    if (b.row_count > 1) set(occupied, from.box);
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
      const Place to = place(row);
      if (to.box != from.box) mark(occupied, from, to);
      from = to;
    }
  }
  std::array<double, halvings> finer{}, filled{};
  std::size_t side = boxes;
  for (int level = halvings; level > 0; --level, side /= 2) {
    finer[std::size_t(level - 1)] = level * std::numbers::ln2;
    filled[std::size_t(level - 1)] = std::log(double(count(occupied, side)));
    halve(occupied, side);
  }
  return regression_slope(finer, filled);
}

}  // namespace forest::statistics
