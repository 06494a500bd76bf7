// SPDX-License-Identifier: Apache-2.0
// From two surfaces to certified elements, and what can be said of them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/cortex/elements.h"
#include "forest/cortex/lines.h"
#include "forest/cortex/mending.h"

namespace forest::cortex {

struct BuildOptions {
  double volume = 1e9;        // µm³ of an element
  double spacing = 300.;      // µm between nodes of the field
  double line_scale = 3000.;  // µm, at which crests and valleys are looked for
};

/// Shares of many numbers.
struct Spread {
  double median = 0., p99 = 0.;
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

/// Throws Error, a sentence with a place, when a pair of surfaces cannot be that of a cortex: one is empty, has coordinates
/// that are no numbers, is open, in pieces, has handles, faces inwards, cuts itself at more than one triangle of 200; its
/// size is no hemisphere's in mm; the inner one is larger or lies outside. Returns what is odd, in sentences: triangles that cut
/// one another but are few.
std::vector<std::string> check_surfaces(const Mesh& outer, const Mesh& inner);

struct Report {
  std::size_t elements = 0, uncertified = 0;
  double volume_error = 0.;   // of elements and wall together, as a share of what lies between the surfaces
  double volume_mean = 0.;    // µm³
  double volume_within = 0.;  // share of elements of 0.8 to 1.25 of the wanted volume
  double equivolume_error = 0.;  // the largest |V(0 → w) / V − w| of any element
  double equivolume_p99 = 0.;    // and of 99 of 100 elements
  double jacobian_least = 0.,
         jacobian_p1 = 0.;  // scaled Jacobian: the least of each element over a lattice of places
  Spread crest_angle;       // degrees between v-isolines of elements by a crest and the right angle to it
  std::optional<double> outer_distance_p99,
      inner_distance_p99;  // µm from faces to surfaces; none where these are not given
};

/// @param volume  wanted of an element, µm³
/// @param outer, inner  for the distances; null: they are not measured
Report report(const Cortex& cortex, double volume, const TriangleTree* outer, const TriangleTree* inner,
              Progress& progress);

}  // namespace forest::cortex
