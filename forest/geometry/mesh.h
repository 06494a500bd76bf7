// SPDX-License-Identifier: Apache-2.0
// Triangles and lines as plain indexed arrays: what a neuron looks like to programs that show models. What a vertex or
// a line belongs to is a small number, its *label*; who makes the mesh says what labels mean.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "forest/core/vec.h"

namespace forest {

using Triangle = std::array<std::uint32_t, 3>;  // counter-clockwise seen from outside

struct Mesh {
  std::vector<Vec3> positions;       // µm
  std::vector<std::uint8_t> labels;  // one a position
  std::vector<Triangle> triangles;   // into positions
};

/// Polylines, one after the other: line i has the positions from starts[i] up to starts[i + 1] or the end, at least two.
struct Lines {
  std::vector<Vec3> positions;        // µm
  std::vector<std::uint32_t> starts;  // ascending
  std::vector<std::uint8_t> labels;   // one a line

  void add(std::span<const Vec3> line, std::uint8_t label);
  std::span<const Vec3> line(std::size_t i) const;
};

void append(Mesh& mesh, const Mesh& other);

/// Whether every edge lies between exactly two triangles, which run along it in opposite directions: a surface without
/// border, of one or more pieces, each with an inside.
bool is_closed(const Mesh& mesh);
/// An edge where that is not so: its two vertices. The first in their order.
std::optional<std::array<std::uint32_t, 2>> open_edge(const Mesh& mesh);
/// A vertex of a closed mesh in which two of its parts touch: its triangles lie around it in several fans, not in one. The first.
std::optional<std::uint32_t> pinched_vertex(const Mesh& mesh);
/// Number of pieces that share no vertex; vertices of no triangle do not count.
std::size_t count_pieces(const Mesh& mesh);
/// Of a closed mesh, by the divergence theorem; µm³, positive when triangles face outwards.
double volume(const Mesh& mesh);
double area(const Mesh& mesh);       // µm²
double mean_edge(const Mesh& mesh);  // µm, over the sides of all triangles; 0 without

/// Unit normals of the vertices: the mean of their triangles' by area, so that slivers say little. (0, 1, 0) where the
/// triangles have no area.
std::vector<Vec3> vertex_normals(const Mesh& mesh);

/// An icosahedron whose edges were halved `halvings` times, vertices on the sphere: 20·4^halvings triangles.
Mesh icosphere(const Vec3& centre, float radius, int halvings, std::uint8_t label);

enum class Cap : std::uint8_t { flat, dome };

/// A closed tube of `sides` >= 3 around the polyline (x, y, z, radius), at least one vertex, radii > 0. Rings stand
/// across the mean of the directions before and behind and are turned least from one to the next: double reflection,
/// Wang, Jüttler, Zheng & Liu (2008), "Computation of rotation minimizing frames". A single place gives a sphere.
Mesh tube(std::span<const Vec4> axis, int sides, Cap first, Cap last, std::uint8_t label);

}  // namespace forest
