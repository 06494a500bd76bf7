// SPDX-License-Identifier: Apache-2.0
// Depth in the cortex by volume: as much of an element lies above depth 0.3 as it should, three tenths (Waehnert et al. 2014, "Anatomically
// motivated modeling of cortical laminae", NeuroImage 93:210). The parameter w of an element is nearly that, but a cubic: where
// tissue narrows to an edge, as above the white matter of a sharp gyrus, depth is more like a root of w. So each element has
//
//     w(u, v, depth) = table of the four corners, interpolated  +  its own table · 16 u (1 − u) v (1 − v)
//
// Corners share their table with the elements around, and an element's own adds nothing on its sides: layers go on from one element to
// the next without a step, and share every element exactly.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "forest/core/progress.h"

namespace forest::cortex {

struct Elements;
struct Hexahedron;

struct Depth {
  static constexpr int steps = 20;             // between 0 and 1; tables have what lies within
  using Table = std::array<float, steps - 1>;  // w at depths 1/20, 2/20, …

  std::vector<Table> corners;   // of every corner curve; none: depth is w
  std::vector<Table> elements;  // of every element
};

/// Of all elements, so that the volume above each depth of the tables is the share it says, wherever w can grow with depth everywhere.
Depth even_depth(const Elements& elements, Progress& progress);

/// The layers of one element.
class Layers {
 public:
  Layers() = default;  // without tables: depth is w
  Layers(const Elements& elements, std::size_t element);
  Layers(const Elements& elements, const Depth& depth, std::size_t element);  // by tables of their own

  double w(double u, double v, double depth) const;
  double depth(double u, double v, double w) const;
  /// Between these values lies w from one depth to another, anywhere in the element.
  std::pair<double, double> range(double from_depth, double to_depth) const;
  /// µm³ between two depths of the element; with tables, to half a percent of it.
  double volume(const Hexahedron& element, double from_depth, double to_depth) const;

 private:
  using Knots = std::array<double, Depth::steps + 1>;
  friend class DepthError;
  Knots knots(double u, double v) const;

  bool plain_ = true;  // there are no tables
  std::array<Knots, 4> corners_;
  Knots own_;
};

/// The largest |V(0 → depth) / V − depth| of an element, over 23 depths, three of which its tables know.
double depth_error(const Elements& elements, std::size_t element);

/// How far in the middle of an element, at most, its own table carries a depth, µm: by so much its layers bulge between its corners.
double layer_bulge(const Elements& elements, std::size_t element);

}  // namespace forest::cortex
