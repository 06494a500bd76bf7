// SPDX-License-Identifier: Apache-2.0
// Grids as drawings (SVG) and as meshes that other programs show (Wavefront OBJ).
#pragma once

#include <span>
#include <string>

#include "forest/cortex/grid.h"

namespace forest::cortex {

struct GridPanel {
  const Grid* grid = nullptr;
  std::string caption;
};

struct GridPicture {
  int columns = 4;      // panels side by side
  double panel = 220.;  // pixels, width and height of one
  bool opened = true;  // of a grid in space the corner nearest to the eye is cut out, so that one sees inside
  std::string up = "z";  // of grids in space: the axis that points up, x, y or z; "-z" turns it over
};

/// Every cell in the colour of its scaled Jacobian: red where it is folded, from orange over pale to blue where it is good.
std::string to_svg(std::span<const GridPanel> panels, const GridPicture& picture = {});

/// The grid's cells: of a plane one its quadrilaterals, otherwise those of its surface.
std::string to_obj(const Grid& grid);

}  // namespace forest::cortex
