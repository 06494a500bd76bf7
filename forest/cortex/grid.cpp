// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/cortex/grid_generators.h"
#include "forest/cortex/grid_quality.h"
#include "forest/cortex/named_row.h"

namespace forest::cortex {

std::array<Eigen::Vector3d, 8> Grid::corners(std::size_t cell) const {
  const std::size_t wide = std::size_t(size[0] - 1), high = std::size_t(size[1] - 1);
  const int i = int(cell % wide), j = int(cell / wide % high), k = int(cell / (wide * high));
  std::array<Eigen::Vector3d, 8> result;
  for (int c = 0; c < 8; ++c)
    result[std::size_t(c)] =
        plane() && c > 3 ? result[std::size_t(c - 4)] : point(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
  return result;
}

void check(const Grid& grid) {
  if (grid.size[0] < 2 || grid.size[1] < 2 || grid.size[2] < 1)
    throw Error(fmt::format(
        "a grid of {}x{}x{} points has no cells; give at least 2 along each direction, or 1 along the third",
        grid.size[0], grid.size[1], grid.size[2]));
  const std::size_t wanted =
      std::size_t(grid.size[0]) * std::size_t(grid.size[1]) * std::size_t(grid.size[2]);
  if (grid.points.size() != wanted)
    throw Error(fmt::format("a grid of {}x{}x{} points was given {} of them; give {}", grid.size[0],
                            grid.size[1], grid.size[2], grid.points.size(), wanted));
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        if (grid.on_boundary(i, j, k) && !grid.point(i, j, k).allFinite())
          throw Error(
              fmt::format("the boundary point ({}, {}, {}) of a grid is not a number; correct it", i, j, k));
}

Grid sample(const Hexahedron& hexahedron, const std::array<int, 3>& size) {
  Grid grid{size,
            std::vector<Eigen::Vector3d>(std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]))};
  const auto share = [&](int n, std::size_t axis) {
    return size[axis] > 1 ? double(n) / (size[axis] - 1) : 0.;
  };
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        grid.point(i, j, k) = hexahedron.at(share(i, 0), share(j, 1), share(k, 2));
  return grid;
}

std::span<const Generator> generators() {
  static constexpr auto table = std::to_array<Generator>({
      {"transfinite", "linear Boolean sum of the interpolations between opposite sides (Gordon & Hall 1973)",
       false, transfinite},
      {"tricubic", "Hermite's Boolean sum: also slopes at the boundary are interpolated, normal to it", false,
       tricubic},
      {"length", "shortest edges: Laplace's equation in (ξ, η, ζ)", true, length},
      {"area-orthogonality", "even areas and right angles (Knupp & Steinberg 1993)", true,
       area_orthogonality},
      {"liao", "least ‖JᵀJ‖² (Liao's functional)", true, liao},
      {"winslow", "ξ, η, ζ are harmonic functions of the place (Winslow 1967, Thompson)", true, winslow},
      {"foldover-free",
       "even shapes and volumes behind a barrier that folded cells cross outwards (Garanzha et al. 2021)",
       true, foldover_free},
  });
  return table;
}

const Generator& generator(std::string_view name) {
  return named_row(generators(), name, "generator of grids");
}

Grid generate(const Grid& boundary, std::string_view name, const GridOptions& options) {
  const Generator& row = generator(name);
  check(boundary);
  return row.fill(row.smooths ? transfinite(boundary, options) : boundary, options);
}

Validity validity(const Grid& grid) {
  const CellMeasure& corners = cell_measure("jacobian");
  Validity result;
  for (std::size_t n = 0; n < grid.cells(); ++n) {
    const Corners cell = grid.corners(n);
    bool good = corners.of(cell, grid.dimensions(), 1.) > 0.;
    if (good && !grid.plane()) good = certify(from_corners(cell)).positive();
    if (!good && result.bad++ == 0) result.first = n;
  }
  return result;
}

Best best_grid(const Grid& boundary, double enough, const GridOptions& options) {
  static constexpr std::array order{"transfinite", "tricubic", "winslow", "area-orthogonality",
                                    "foldover-free"};
  Best best;
  for (const char* name : order) {
    Grid grid = generate(boundary, name, options);
    if (!validity(grid).valid()) continue;
    const std::vector<double> values = measure(grid, cell_measure("scaled-jacobian"));
    const double least = *std::ranges::min_element(values);
    if (best.generator.empty() || least > best.least_scaled_jacobian) best = {std::move(grid), name, least};
    if (best.least_scaled_jacobian >= enough) break;
  }
  if (best.generator.empty())
    throw Error(
        "no generator fills this block without folds; its boundary crosses itself, or has too few points "
        "where it bends");
  return best;
}

}  // namespace forest::cortex
