// SPDX-License-Identifier: Apache-2.0
// Bricks of far tissue. From afar the branches of many neurons are a density with directions and colours. A *straw* is a
// straight piece of a branch, drawn at random with a chance in proportion to area and as wide as needed to cover what it
// stands for; all straws of a level have the same area (after Cook, Halstead, Planck & Ryu 2007, "Stochastic simplification
// of aggregate detail"). A brick holds 32 straws that are neighbours. Every straw has a rank, and the farther the eye, the fewer
// are drawn, each wider: where a quarter are left, the brick above, which holds just those of four, takes their place.
//
//   neurons ─▶ bricks of 32 straws, each of a width w  ─▶ … 4 w ─▶ … 16 w ─▶ one brick
//
// A neuron is drawn by its clusters or by its straws, never by both: that is a matter of it and the eye alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/layout.h"
#include "forest/scene/group.h"

namespace forest::scene {

/// Laid out for the forest file: 64 bytes.
struct Brick {
  static constexpr std::uint32_t straws = 32, group_size = 8, group_count = straws / group_size;

  float x = 0.f, y = 0.f, z = 0.f,
        radius = 0.f;               // around all of its straws, those of its children as well, µm
  float width = 0.f, length = 0.f;  // of a straw, µm
  std::uint32_t first_segment = 0, segment_count = 0;
  std::uint32_t first_child = 0, child_count = 0;  // bricks; 0 for the finest
  std::uint32_t groups[group_count] = {};          // the sphere around each eight of the straws
  float neurons =
      0.f;  // radius of a sphere around its centre that holds the neurons of all of its straws, whole, µm
  std::uint32_t reserved = 0;

  /// How large what a straw stands for may look, µm: all straws are drawn where the thinnest line is as wide.
  float error() const {
    return std::min(width / float(FOREST_STRAW_WIDTH),
                    std::sqrt(width * length / float(FOREST_STRAW_WIDTH * FOREST_STRAW_LENGTH)));
  }
  Sphere sphere() const { return {{x, y, z}, radius}; }
  Sphere group(std::uint32_t i) const { return unpacked_group(groups[i], sphere()); }
  std::uint32_t all() const { return segment_count >= 32 ? 0xffffffffu : (1u << segment_count) - 1u; }
  /// Those that may be drawn where 1 µm covers so many times the width of the thinnest line: bit i is straw i.
  std::uint32_t shown(float magnification) const;
};
static_assert(sizeof(Brick) == 64);

/// What straws of one distinct neuron are made of: pieces of its branches, in its own coordinates.
struct Pieces {
  struct Piece {
    Vec3 at = Vec3::Zero(), along = Vec3::Zero();  // its middle, µm; unit
    std::uint32_t segment = 0;                     // of the neuron's original ones
    std::uint32_t kind = 0;                        // as in Segment::meta
  };
  std::vector<Piece> pieces;  // along the branches
  float area = 0.f;           // µm², length × diameter of all branches; of a soma what looks as large
  Sphere sphere;              // around the neuron
};
Pieces pieces_of(std::span<const frame::Segment> originals, std::size_t count);

/// The bricks of many neurons, the one around all first; children come later.
struct Bricks {
  std::vector<Brick> bricks;
  std::vector<frame::Segment> straws;
  std::vector<frame::Owner> owners;  // of each straw
};
/// @param pieces          of every distinct neuron
/// @param first_segments  of every distinct neuron: its first original segment
/// @param first_straw     number that the first straw will have as a segment
Bricks build_bricks(std::span<const frame::Instance> instances, std::span<const Pieces> pieces,
                    std::span<const std::uint32_t> first_segments, std::uint32_t first_straw);

}  // namespace forest::scene
