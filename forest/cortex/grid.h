// SPDX-License-Identifier: Apache-2.0
// Structured grids within a block, in the plane or in space, from the points of its boundary. Generators fill the inside and
// never move a boundary point. After P. Knupp & S. Steinberg (1993), "Fundamentals of Grid Generation".
//
//        η = 1  ╭─┬──┬──╮           Parameters (ξ, η, ζ) run from 0 to 1 in even steps. Algebraic generators blend opposite
//               ├─┼──┼──┤           sides; smoothers solve an equation, or minimise a functional of the Jacobian J, whose
//        η = 0  ╰─┴──┴──╯           columns are ∂x/∂ξ, ∂x/∂η, ∂x/∂ζ, with G = JᵀJ.
//             ξ = 0    ξ = 1
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

struct Grid {
  std::array<int, 3> size{
      2, 2, 1};  // points along ξ, η, ζ, at least 2; one along ζ: a plane grid, of which z is ignored
  std::vector<Eigen::Vector3d> points;  // ξ runs fastest; any unit of length

  bool plane() const { return size[2] == 1; }
  int dimensions() const { return plane() ? 2 : 3; }
  std::size_t index(int i, int j, int k = 0) const {
    return std::size_t(i) + std::size_t(size[0]) * (std::size_t(j) + std::size_t(size[1]) * std::size_t(k));
  }
  const Eigen::Vector3d& point(int i, int j, int k = 0) const { return points[index(i, j, k)]; }
  Eigen::Vector3d& point(int i, int j, int k = 0) { return points[index(i, j, k)]; }
  bool on_boundary(int i, int j, int k = 0) const {
    return i == 0 || j == 0 || i == size[0] - 1 || j == size[1] - 1 ||
           (!plane() && (k == 0 || k == size[2] - 1));
  }
  std::size_t cells() const {
    return std::size_t(size[0] - 1) * std::size_t(size[1] - 1) * std::size_t(plane() ? 1 : size[2] - 1);
  }
  /// The corners of a cell (cells are counted with ξ fastest) in the order of Hexahedron::corner; of a plane grid the first four.
  std::array<Eigen::Vector3d, 8> corners(std::size_t cell) const;
};

/// Throws Error that names what is wrong: a size below 2, the number of points, or the first boundary point that is not finite.
void check(const Grid& grid);

/// The element at even steps of (u, v, w).
Grid sample(const Hexahedron& hexahedron, const std::array<int, 3>& size);

struct GridOptions {
  int iterations = 3000;  // of a smoother, at most
  double tolerance =
      1e-7;  // a smoother ends when no point moves further than this, over the diagonal of the block
  double orthogonality =
      .3;  // tricubic: 0, slopes at the boundary are the transfinite grid's; 1, they stand normal to it, which
           // folds blocks that are much sheared
};

/// A way to fill a block. `fill` reads the boundary points of its argument (smoothers start from its inside) and returns the
/// same grid with another inside.
struct Generator {
  const char* name;
  const char* what;
  bool smooths;  // starts from the inside that is given
  Grid (*fill)(Grid start, const GridOptions& options);
};
/// transfinite, tricubic, length, area-orthogonality, liao, winslow, foldover-free.
std::span<const Generator> generators();
/// Throws Error that lists the names there are.
const Generator& generator(std::string_view name);

/// The inside by the generator of that name; smoothers start from the transfinite grid. Throws Error.
Grid generate(const Grid& boundary, std::string_view generator, const GridOptions& options = {});

/// Whether det J > 0 everywhere in every cell, where a cell is the bilinear (trilinear) map of its corners: in the plane exactly by
/// the corners, in space by Bernstein coefficients.
struct Validity {
  std::size_t bad = 0;    // cells of which it is not so
  std::size_t first = 0;  // the first of them
  bool valid() const { return bad == 0; }
};
Validity validity(const Grid& grid);

/// Tries generators in their order, until one gives a valid grid with scaled Jacobians of at least `enough`; otherwise the valid
/// one whose least is best. Throws Error where none is valid.
struct Best {
  Grid grid;
  std::string generator;
  double least_scaled_jacobian = 0.;
};
Best best_grid(const Grid& boundary, double enough = .2, const GridOptions& options = {});

}  // namespace forest::cortex
