// SPDX-License-Identifier: Apache-2.0
// Lines drawn on a surface, as Connectome Workbench writes them (.border, version 3):
//
//   <BorderFile SurfaceNumberOfVertices="32492"><Class><Border Name="CS"><BorderPart Closed="False">
//     <Vertices>5777 5734 5776 …</Vertices>   three corners a point
//     <Weights>.80 .23 .03 …</Weights>        and how much each counts
//
// Lines drawn in older programs have the areas of triangles as weights, whose sum is anything; here it is 1.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/vec.h"

namespace forest::io {

struct BorderPoint {
  std::array<std::uint32_t, 3> vertices{};
  std::array<double, 3> weights{};  // 0 or more, in sum 1
};

struct Border {
  std::string name;                 // "CS"; borders of several parts come as several of one name
  std::vector<BorderPoint> points;  // along the line, at least one
  std::string group = {};           // the class that it belongs to
  Vec3 colour = Vec3::Zero();       // sRGB, 0–1
  bool closed = false;
};

struct Borders {
  std::size_t surface_vertices = 0;  // of the surface on which they are drawn
  std::vector<Border> borders;       // at least one
  std::string structure =
      "CORTEX";  // as surface_structure: Workbench draws borders on surfaces of their structure only
};

/// Throws InputError: what is no such file, is cut off, or names vertices that are not there.
Borders read_borders(std::string_view bytes, const std::string& name);
/// Groups stand in the order of their first borders, and have the colour of these.
std::string write_borders(const Borders& borders);

}  // namespace forest::io
