// SPDX-License-Identifier: Apache-2.0
// Some elements of a cortex: which they are, and how they lie.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/vec.h"
#include "forest/cortex/warp.h"
#include "forest/geometry/mesh.h"

namespace forest::cortex {

/// Of each element where (½, ½, ½) is, µm.
std::vector<Eigen::Vector3d> middles_of(std::span<const Hexahedron> elements);

/// Of each element the value at the vertex nearest to the middle of its outer face; none (NaN) where the surface is more than
/// .3 mm away. Throws Error where that is so of more than a few: the values are of another surface.
/// @param outer  that the elements were built from
/// @param values  one a vertex
std::vector<float> values_at(std::span<const Hexahedron> elements, const Mesh& outer,
                             std::span<const float> values);

/// So many elements in a row, across the fold (along u), with this one in the middle; fewer where the sheet ends or the row would
/// meet itself.
/// @param sheet  with junctions
std::vector<std::uint32_t> row_through(const Sheet& sheet, std::uint32_t middle, std::size_t count);

/// Towards the pia, in the mean over some elements; y where they nearly cancel out, as over a whole hemisphere.
Vec3 towards_pia(std::span<const Hexahedron> elements, std::span<const std::uint32_t> chosen);

}  // namespace forest::cortex
