// SPDX-License-Identifier: Apache-2.0
// Fewer triangles for the same surface. Edges are drawn together to a point (Hoppe 1996), the cheapest first by the squared
// distances from the planes around them as they are now (without memory: Lindstrom & Turk 1998). What is ours is that every
// vertex of what was given is kept in mind (as by Ciampalini, Cignoni, Montani & Scopigno 1997) and that nothing comes to cut.
#pragma once

#include "forest/geometry/mesh.h"

namespace forest {

class Progress;

struct DecimateOptions {
  double error =
      20.;  // µm, > 0: so near the result every vertex of the mesh stays, and its vertices the mesh
  double longest = 1500.;  // µm: no edge becomes longer than this
};

/// The same surfaces, of the same topology, with fewer triangles; vertices keep the labels of those that they come from.
/// Triangles that did not cut one another do not afterwards: several surfaces in one mesh stay apart, or within one another.
/// @param mesh  closed, of one orientation (is_closed)
/// On all cores, in boxes whose borders wait for the next round; the same bytes at any number of threads.
Mesh decimated(const Mesh& mesh, const DecimateOptions& options, Progress& progress);

}  // namespace forest
