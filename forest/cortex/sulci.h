// SPDX-License-Identifier: Apache-2.0
// The floors of sulci as a graph: the valley lines of a Morse-Smale complex of sulcal depth (Edelsbrunner, Harer & Zomorodian
// 2003, "Hierarchical Morse-Smale complexes for piecewise linear 2-manifolds"). From every pass between two pits the steepest
// ways go down to either; a pass that only parts a crown from a crown hardly higher than itself is none.
//
//       ^ crown ^            x  pit: deeper than all around it
//    x----o----x---o--x      o  pass between two pits
//       ^ crown ^            -  line: the steepest way from the pass into the pit
//
// Lines of lines.h run where the surface is bent most; these go on where a floor is flat, and over what bridges a sulcus.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/cortex/lines.h"

namespace forest::cortex {

/// How far each vertex of the middle is carried outwards as that is smoothed until everything smaller than the scale is gone
/// (what Fischl, Sereno & Dale 1999 call average convexity), µm; a crown is carried inwards.
std::vector<double> sulcal_depth(const Ribbon& ribbon, double scale);

struct SulcusOptions {
  double scale = 18e3;  // µm, of the depth: the standard deviation of the smoothing
  double persistence =
      300.;  // µm: a pass lies lower than both crowns that it parts by so much, and a line somewhere deeper
             // than what lies around it
  double shallowest =
      .4;  // share of the vertices outside the wall; a line ends where it is less deep than these
  double shortest_spur =
      4e3;  // µm: shorter ways that end freely are left out, as are such that go straight up a bank
  double smooth = 3e3;  // µm, along the way from node to node: steepest ways turn with the triangles
};

/// Lines of the kind `sulcus`, on the outer surface and from node to node of the graph; their strength is their mean depth, µm.
std::vector<Line> sulci(const Ribbon& ribbon, const SulcusOptions& options);

/// Share of a surface, by area, that lies within a distance (µm) of places: what points drawn at random would reach.
/// @param left_out  of every vertex; triangles with such a one do not count
double share_near(const Mesh& surface, std::span<const std::uint8_t> left_out, const TriangleTree& places,
                  double within);

}  // namespace forest::cortex
