// SPDX-License-Identifier: Apache-2.0
// From two surfaces to certified elements.
#pragma once

#include <string>
#include <vector>

#include "forest/cortex/elements.h"
#include "forest/cortex/lines.h"
#include "forest/cortex/mending.h"
#include "forest/cortex/spread.h"

namespace forest::cortex {

struct BuildOptions {
  double volume = 1e9;        // µm³ of an element
  double spacing = 300.;      // µm between nodes of the field
  double line_scale = 3000.;  // µm, at which crests and valleys are looked for
  double thinnest = 500.;     // µm: what is thinner over an area is the medial wall (RibbonOptions)
};

struct Cortex {
  Elements elements;
  std::vector<Line> lines;
  double between = 0.;    // µm³ between the surfaces
  double wall = 0.;       // of it under the medial wall, where no elements are
  Spread w_angle;         // degrees between the curves of corners and the surfaces' normals, over both ends
  double w_reached = 0.;  // share of all curves that reach the inner surface
  Mending mending;
  LeftOut left_out;
  std::vector<std::string>
      oddities;  // sentences: what is not right with the surfaces and was taken all the same
};

/// Surfaces closed, whole and in µm, triangles outwards, the inner one within the outer.
/// Throws Error that says which of this does not hold, and where.
Cortex build_cortex(const Mesh& outer, const Mesh& inner, const BuildOptions& options, Progress& progress);

}  // namespace forest::cortex
