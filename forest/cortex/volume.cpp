// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/volume.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "forest/core/parallel.h"

namespace forest::cortex {

std::vector<std::vector<Place>> marching_squares(std::span<const float> values, std::size_t width,
                                                 std::size_t height, double threshold) {
  // One more pixel all around, outside; the grid of corners is (width + 2) × (height + 2).
  const std::size_t w = width + 2, h = height + 2;
  double low = threshold;
  for (const float value : values)
    if (std::isfinite(value)) low = std::min(low, double(value));
  const double outside = low - std::max(1., std::abs(threshold));
  const auto at = [&](std::size_t x, std::size_t y) {
    if (x == 0 || y == 0 || x + 1 == w || y + 1 == h) return outside - threshold;
    const float value = values[(y - 1) * width + x - 1];
    return std::isnan(value) ? outside - threshold : std::clamp(double(value), -1e30, 1e30) - threshold;
  };
  // Edges: from a corner to the right (even) or upwards (odd).
  const auto edge = [&](std::size_t x, std::size_t y, bool up) { return 2 * (y * w + x) + (up ? 1u : 0u); };
  std::unordered_map<std::size_t, std::size_t> next;
  std::vector<std::size_t> order;  // where steps begin
  for (std::size_t y = 0; y + 1 < h; ++y)
    for (std::size_t x = 0; x + 1 < w; ++x) {
      // Anticlockwise from the lower left; edge k goes from corner k to the next.
      const std::array<double, 4> corner{at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)};
      const std::array<std::size_t, 4> edges{edge(x, y, false), edge(x + 1, y, true), edge(x, y + 1, false),
                                             edge(x, y, true)};
      std::array<std::size_t, 4> leaving{},
          entering{};  // walking around, edges where the inside ends and begins
      std::size_t count = 0, begins = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const bool in = corner[k] > 0., after = corner[(k + 1) % 4] > 0.;
        if (in && !after) leaving[count++] = k;
        if (!in && after) entering[begins++] = k;
      }
      const auto join = [&](std::size_t from, std::size_t to) {
        next[edges[from]] = edges[to], order.push_back(edges[from]);
      };
      // The inside is to the left: the curve comes in where the inside ends and goes out where it began.
      if (count == 1) join(leaving[0], entering[0]);
      if (count == 2) {
        const double saddle =
            (corner[0] * corner[2] - corner[1] * corner[3]) / (corner[0] + corner[2] - corner[1] - corner[3]);
        // Each inside corner by itself, or both in one piece.
        for (std::size_t k = 0; k < 2; ++k) {
          const std::size_t before = (leaving[k] + 3) % 4, behind = (leaving[k] + 1) % 4;
          join(leaving[k], saddle > 0. ? behind : before);
        }
      }
    }
  const auto place = [&](std::size_t e) {
    const std::size_t x = e / 2 % w, y = e / 2 / w;
    const bool up = e % 2;
    const double a = at(x, y), b = up ? at(x, y + 1) : at(x + 1, y);
    const double share = a / (a - b);
    return Place(double(x) - 1. + (up ? 0. : share), double(y) - 1. + (up ? share : 0.));
  };
  std::vector<std::vector<Place>> polygons;
  for (const std::size_t first : order) {
    if (!next.contains(first)) continue;
    std::vector<Place> polygon;
    for (auto step = next.find(first); step != next.end(); step = next.find(first)) {
      std::size_t e = first;
      while (step != next.end()) {
        const Place here = place(e);
        if (polygon.empty() || here != polygon.back()) polygon.push_back(here);
        e = step->second;
        next.erase(step);
        step = next.find(e);
      }
    }
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    if (polygon.size() >= 3) polygons.push_back(std::move(polygon));
  }
  return polygons;
}

ContourStack contours_of(const Volume& volume, const std::string& object, Axis axis,
                         std::span<const double> planes, double threshold) {
  const int across = int(axis);
  const auto [right, up] = flat_axes(axis);
  const std::size_t width = volume.size[std::size_t(right)], height = volume.size[std::size_t(up)],
                    depth = volume.size[std::size_t(across)];
  ContourStack stack{.axis = axis, .objects = {object}, .sections = std::vector<Section>(planes.size())};
  parallel_for(planes.size(), 1, [&](std::size_t i) {
    Section& section = stack.sections[i];
    section.at = planes[i];
    const double place = (planes[i] - volume.origin[across]) / volume.step[across];
    if (!(place >= 0. && place <= double(depth - 1))) return;
    const auto below = std::min(std::size_t(place), depth - 1), above = std::min(below + 1, depth - 1);
    const auto share = float(place - double(below));
    std::vector<float> picture(width * height);
    for (std::size_t v = 0; v < height; ++v)
      for (std::size_t u = 0; u < width; ++u) {
        std::array<std::size_t, 3> voxel{};
        voxel[std::size_t(right)] = u, voxel[std::size_t(up)] = v, voxel[std::size_t(across)] = below;
        const float a = volume.at(voxel[0], voxel[1], voxel[2]);
        voxel[std::size_t(across)] = above;
        picture[v * width + u] = share == 0.f ? a : a + share * (volume.at(voxel[0], voxel[1], voxel[2]) - a);
      }
    for (auto& polygon : marching_squares(picture, width, height, threshold)) {
      for (Place& p : polygon)
        p = {volume.origin[right] + p.x() * volume.step[right], volume.origin[up] + p.y() * volume.step[up]};
      section.contours.push_back({.object = 0, .curve = straight_loop(polygon)});
    }
  });
  return stack;
}

}  // namespace forest::cortex
