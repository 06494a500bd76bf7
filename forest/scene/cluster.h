// SPDX-License-Identifier: Apache-2.0
// The levels of detail of one neuron: a binary tree of clusters. A leaf holds a run of at most 32 original segments in
// depth-first order; a parent draws what its two children draw with at most 64 segments again and states how far, at
// most, anything has moved. A set of clusters in which every leaf has exactly one ancestor (or itself) is a *cut*, and
// draws the whole neuron once.
//
//             root (32 segments, error 30 µm)          Coarsening: tips shorter than the error are dropped, and what
//            /                               \         stays is widened so that the area is kept; the rest is
//      ≤ 32, 9 µm                         ≤ 32, 7 µm   simplified (Douglas & Peucker). Points where two clusters join
//      /        \                         /        \   are never moved or dropped: no cut comes apart.
//   leaf, 0   leaf, 0                  leaf, 0   leaf, 0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/layout.h"
#include "forest/morphology/morphology.h"
#include "forest/reports/layout.h"
#include "forest/scene/group.h"
#include "forest/scene/order.h"

namespace forest::scene {

/// Laid out for the forest file: 192 bytes, of which a walk reads the first 64. Its segments come in groups of 8 that follow one another along the branches, so
/// that what is hidden, or beside the picture, can be told from what is not without a look at single segments.
struct Cluster {
  static constexpr std::uint32_t group_size = 8, group_count = frame::cluster_size / group_size;

  float x = 0.f, y = 0.f, z = 0.f, radius = 0.f;  // bounding sphere of all that is below, µm
  float error = 0.f;                              // µm; 0 for a leaf, never less than a child's
  float thickness = 0.f;  // largest radius of a segment drawn, the soma's sphere aside, µm
  std::uint32_t first_segment = 0;
  std::uint32_t segment_count : 8 = 0;
  // Of a leaf: the clusters that something of it grows into lie within so many leaves after it; all ones: or farther.
  std::uint32_t outgrowth : 24 = 0;
  std::uint32_t children[2] = {0, 0};  // clusters; both 0 for a leaf
  std::uint32_t leaf_first = 0;        // original segments below: the first, among the neuron's leaves …
  std::uint32_t leaf_count = 0;        // … and how many
  std::uint32_t groups[group_count] = {};  // the sphere around each group: see group()
  // From which step of magnification on each segment shows, in each order in which branches may come (order.h).
  std::uint8_t appears[order_count][frame::cluster_size] = {};

  Sphere sphere() const { return {{x, y, z}, radius}; }
  bool is_leaf() const { return children[0] == 0; }

  /// A thin branch shows from the magnification on, pixels a µm, at which its width reaches its rank, and none before the
  /// branch that it grows out of. Which segments show where one pixel is the thinnest line.
  std::uint32_t visible_at(float magnification, std::size_t order) const {
    constexpr std::uint64_t ones = 0x0101010101010101ull, high = 0x80 * ones;
    const std::uint64_t step = step_of(magnification) * ones | high;
    std::uint32_t shown = 0;
    for (std::uint32_t i = 0; i < frame::cluster_size; i += 8) {  // eight at a time
      std::uint64_t at;
      std::memcpy(&at, appears[order] + i, sizeof at);
      shown |= std::uint32_t((((step - at) & high) >> 7) * 0x0102040810204080ull >> 56) << i;
    }
    return shown & all();
  }
  std::uint32_t all() const { return frame::first_segments(segment_count); }
  /// The sphere around the segments [8 i, 8 i + 8) drawn.
  Sphere group(std::uint32_t i) const { return unpacked_group(groups[i], sphere()); }
  static constexpr std::uint32_t no_end = (1u << 24) - 1;

  /// Eight steps an octave, from 1/2048 pixel a µm on.
  static constexpr std::uint8_t step_of(float magnification) {
    constexpr std::int32_t first = (127 - 11) * 8;
    const auto step = std::int32_t(std::bit_cast<std::uint32_t>(magnification) >> 20);
    return std::uint8_t(std::clamp(step - first, 0, 127));
  }
};
static_assert(sizeof(Cluster) == 192);

struct ClusterTree {
  std::vector<frame::Segment> segments;  // the leaves' first (original_count), then the coarser ones
  std::vector<reports::Place> places;    // of every segment: the middle of what it stands for
  std::vector<Cluster> clusters;         // [0] is the root
  std::vector<std::uint32_t> section;    // of every original segment: the section it shows, or soma_section
  std::uint32_t original_count = 0;
  float soma_radius = 0.f;  // 0 when there is none
};

inline constexpr std::uint32_t soma_section = 0xffffffffu;

/// The branch number of every section (GabrielStudio): the longest path from the soma to a tip is branch 0, the longest
/// of what remains branch 1, and so on; a section keeps the number of the longest path that runs through it.
std::vector<std::uint32_t> branch_numbers(const Morphology& morphology);

/// Positions are relative to the centre of the soma (or the first point when there is none). The soma is one segment,
/// the very first, when it has a size: a sphere; where it has a shape of its own (morphology/soma_shape.h), cones beside it. Each
/// stem is joined to it by a cone. A neuron without any segment has no cluster.
ClusterTree build_clusters(const Morphology& morphology);

}  // namespace forest::scene
