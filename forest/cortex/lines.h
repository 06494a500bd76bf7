// SPDX-License-Identifier: Apache-2.0
// Crest and valley lines: where a surface is bent most across its own direction. A crest runs along the crown of a gyrus, a
// valley along the fundus of a sulcus; they are found as the places where the greater of the two principal curvatures is
// extreme along its own direction (Ohtake, Belyaev & Seidel 2004; Yoshizawa, Belyaev & Seidel 2005, "Fast and robust
// detection of crest lines on meshes"), on a surface smoothed to the scale asked for, and told from noise by the integral of
// the curvature along a line. Lines that are found triangle by triangle zigzag by as much as these are wide; they are made smooth
// over two thirds of that scale (as Hildebrandt, Polthier & Wardetzky 2005, "Smooth feature lines on surface meshes", do).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "forest/cortex/ribbon.h"

namespace forest::cortex {

/// How a surface is bent at a vertex.
struct Curvature {
  double most = 0., least = 0.;  // the principal curvatures, 1/µm; convex is positive; most >= least
  Place along_most = Place::Zero(), along_least = Place::Zero();  // unit, in the tangent plane
  Place normal = Place::Zero();
};

/// @param places  corners of the triangles, which face outwards
/// @param scale   µm: what is smaller is smoothed away; 0: the surface as it is
/// Tensors of triangles from the normals of their corners (Rusinkiewicz 2004).
std::vector<Curvature> curvatures(std::span<const Place> places, std::span<const Triangle> triangles,
                                  const Neighbours& near, double scale);

struct Line {
  enum class Kind : std::uint8_t { crest, valley, border, sulcus };  // border: of the wall; sulcus: sulci.h
  Kind kind = Kind::crest;
  std::vector<Place> points;             // on the surface, at least two
  std::vector<std::uint32_t> triangles;  // in which each piece lies: one fewer than points
  double strength =
      0.;  // of a crest and a valley the integral of the curvature along it, an angle in radians; of a
           // sulcus its mean depth, µm
  bool closed = false;  // it ends where it begins

  double length() const;  // µm
  /// Unit, of the line where piece i is, seen over `reach` µm to either side: single pieces turn with the triangles.
  Place direction(std::size_t piece, double reach = 1500.) const;
};

/// A line that is found triangle by triangle zigzags by as much as they are wide: even steps along it, smooth over `scale` (µm, the
/// standard deviation), and back on the ribbon. Ends stay where they are.
/// @param line   on the middle of the ribbon
/// @param level  of the ribbon: where the line is then, above or below where it runs along the middle
Line faired(const Line& line, const Ribbon& ribbon, const RibbonLocator& locator, double scale,
            const std::vector<Place>& level);

struct LineOptions {
  double scale = 1500.;        // µm
  double least_strength = 2.;  // radians; of what is bent as much the other way it is none
  double least_length = 4e3;   // µm
};

/// The borders of the wall on the middle of the ribbon, smooth.
std::vector<Line> borders(const Ribbon& ribbon);

/// Lines on the middle of the ribbon, outside the wall, the strongest first.
std::vector<Line> crests_and_valleys(const Ribbon& ribbon, std::span<const Curvature> curvatures,
                                     const LineOptions& options);

/// The pieces of all lines of a kind, one after the other, as triangles without area, for a TriangleTree to find them.
Mesh pieces(std::span<const Line> lines, Line::Kind kind);
/// Unit, the direction of each of these pieces.
std::vector<Place> directions(std::span<const Line> lines, Line::Kind kind);

}  // namespace forest::cortex
