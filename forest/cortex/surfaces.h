// SPDX-License-Identifier: Apache-2.0
// From contours of sections to the closed surfaces that they are cuts of. In each section the signed distance from the
// contours is known everywhere; between sections it is interpolated (by cubics through four sections: Catmull & Rom 1974),
// the inside is made a topological ball, and where the distance is 0 the surface is.
#pragma once

#include <cstdint>
#include <string>

#include "forest/cortex/contours.h"
#include "forest/geometry/mesh.h"

namespace forest::cortex {

struct SurfaceOptions {
  double voxel = 0.;    // µm, in the sections; 0: a quarter of their distance
  int between = 2;      // grid points a section: 2 puts one in the middle of each two sections
  double margin = 20.;  // µm, about: what the outer surface keeps from the inner one
  double error = 20.;   // µm: triangles are made fewer by so much (decimate.h); 0: all are kept
  std::string outer = "outer", inner = "inner";  // objects
};

/// Where the most of a section did not come into a surface: a piece apart, or what hangs together by a handle.
struct Unjoined {
  std::size_t section = 0;  // index in the stack
  double area = 0.;         // µm²
  double share = 0.;        // of what lies within the object's contours in the median section
};

struct Surfaces {
  Mesh outer, inner;  // closed, genus 0, one piece each, without self-intersections; inner within outer
  /// Points of the grid that were moved outside, so that it is so: bridges over sulci, pieces apart.
  std::size_t outer_cut = 0, inner_cut = 0;
  /// Points of the grid where the contours had the inner surface outside the outer one: the outer one was moved.
  std::size_t pushed = 0;
  /// Points of the grid that came outside since two banks meet there, which no section shows (hidden_sulci.h).
  std::size_t opened = 0;
  Unjoined outer_unjoined, inner_unjoined;
  std::size_t triangles = 0;  // of both, before they were made fewer
};

/// @param given  sections at equal distances (to 1 %), none between two missing; objects other than the two are not looked at
/// Throws Error: sections too few or not at equal distances, an object missing, contours that cross (fault_of), an inner
/// contour wholly outside the outer ones, an object that a section lacks between two that have it. On all cores; the same bytes at any number of threads.
Surfaces surfaces_from(const ContourStack& given, const SurfaceOptions& options, Progress& progress);

/// Signed distances from an object's contours in a section, µm, negative within, at `width` × `height` points `step` apart,
/// row by row from `origin`; none larger than `band`.
std::vector<float> signed_distances(const Section& section, std::uint32_t object, const Place& origin,
                                    double step, std::size_t width, std::size_t height, double band);

}  // namespace forest::cortex
