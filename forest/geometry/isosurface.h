// SPDX-License-Identifier: Apache-2.0
// Surfaces out of a grid of numbers, with a say in their topology. Each box of the grid is six tetrahedra around its
// diagonal (Freudenthal 1942, Kuhn 1960), so that every point has fourteen neighbours, and the surface within each
// tetrahedron is flat (Doi & Koide 1991): it never cuts itself, and what is connected to what is decided by the signs alone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "forest/geometry/mesh.h"

namespace forest {

/// Numbers at the points of a grid. The inside is where they are negative.
struct ScalarGrid {
  std::array<std::size_t, 3> size{0, 0, 0};  // points along each axis, at least two
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), step = Eigen::Vector3d::Ones();  // µm
  std::vector<float> values;                                                         // the first axis fastest

  std::size_t count() const { return size[0] * size[1] * size[2]; }
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const {
    return (z * size[1] + y) * size[0] + x;
  }
};

/// Where the numbers are 0, facing outwards. Closed when the points on the border are outside; two pieces or two sheets of
/// it touch nowhere. 0 counts as outside. The same bytes at any number of threads.
Mesh isosurface(const ScalarGrid& grid);

/// What `grow_ball` changed, in points of the grid.
struct BallChange {
  std::size_t cut = 0;      // to the outside: bridges that would make a handle, and pieces of their own
  std::size_t largest = 0;  // points of the ball
};

/// Makes the inside a topological ball (so that its surface has genus 0 and one piece) by moving as few and as shallow points
/// as it finds to the outside: from what is in `ball` already, or the deepest point where that is empty, the deepest points
/// come first, each only if it changes no topology: what it touches of the ball is one piece without hole (a simple point:
/// Bertrand & Malandain 1994; here in a grid of fourteen neighbours, whose links are spheres, so that inside and outside are
/// judged alike). Where two fronts meet a sheet stays outside, as a closed sulcus should.
/// @param ball  one a point, 1 in the ball; a topological ball, within the border; afterwards that of the result
/// @param least  what cut points become, > 0
BallChange grow_ball(ScalarGrid& grid, std::vector<std::uint8_t>& ball, float least);

/// Vertices - edges + triangles: 2 for a sphere, 2 less a handle. Of a closed mesh.
long euler_number(const Mesh& mesh);

}  // namespace forest
