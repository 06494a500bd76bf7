// SPDX-License-Identifier: Apache-2.0
// Where the layers of an element end: by shares of volume as the elements know it (depth.h), or where they were measured.
//
// Measured layers come as thicknesses at the vertices of a surface, one map a layer: BigBrain's by Wagstyl et al. 2020, for instance. What
// holds is their ratio, as brains are of various sizes and shrink when they are cut: a layer has the share of a w-curve's length that it has
// of the sum of all thicknesses at the place where the curve leaves the outer surface. Within an element the w at which
// a layer ends is bilinear in (u, v) between its four corners, and so the same on both sides of a face.
//
//       ●───────●  pia         a corner's share is that of the triangle of the maps' surface that it lies on
//       ╲_ _ _ _╱  end of L1
//        ╲_____╱   end of L2
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "forest/cortex/depth.h"

namespace forest {
struct Mesh;
}

namespace forest::cortex {

/// The layers of one element, counted from 0 at the pia.
class Borders {
 public:
  /// By volume: the depths at which layers end, ascending, the last one 1.
  Borders(const Layers& layers, std::span<const double> depths);
  /// Of each corner, (u, v) = (0, 0), (1, 0), (0, 1), (1, 1), the w at which layers end, ascending, the last one 1.
  explicit Borders(const std::array<std::vector<double>, 4>& ends);

  std::size_t size() const { return depths_.empty() ? ends_[0].size() : depths_.size(); }
  double begin(double u, double v, std::size_t layer) const { return layer ? end(u, v, layer - 1) : 0.; }
  double end(double u, double v, std::size_t layer) const;  // w
  /// Between these values of w lies a layer, anywhere in the element.
  std::pair<double, double> range(std::size_t layer) const;
  double volume(const Hexahedron& element, std::size_t layer) const;  // µm³, to half a percent of the element

 private:
  Layers layers_;
  std::vector<double> depths_;  // empty: as measured
  std::array<std::vector<double>, 4> ends_;
};

/// Shares of thickness at every vertex of a surface; those of a vertex add up to 1.
struct LayerShares {
  std::vector<std::vector<double>> of_layers;
  std::vector<std::uint8_t> measured;  // of every vertex; 0: it has what the nearest measured ones have
};
/// @param thickness  of each layer at every vertex of the mesh, in any unit, >= 0; not measured: all 0, or one of them no number
/// Throws Error: a thickness below 0, with its place, or none measured at all.
LayerShares shares_of(const Mesh& surface, std::span<const std::vector<float>> thickness);

/// Of every corner curve of elements the w at which layers end there.
class MeasuredBorders {
 public:
  /// @param outer   the surface on whose vertices shares are known: the outer one that the elements were built from
  /// Throws Error when corners do not lie on it, with the place of the farthest.
  MeasuredBorders(const Elements& elements, const Mesh& outer, const LayerShares& shares);

  Borders of(const Elements& elements, std::size_t element) const;
  /// Whether layers were measured around each of its corners; else by the wall, they are those of the nearest place.
  bool measured(const Elements& elements, std::size_t element) const;

 private:
  std::size_t layers_;
  std::vector<float> ends_;             // of a corner all layers, one after the other
  std::vector<std::uint8_t> measured_;  // of corners
};

}  // namespace forest::cortex
