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

#include <cstdint>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/layout.h"
#include "forest/morphology/morphology.h"
#include "forest/reports/layout.h"
#include "forest/scene/group.h"

namespace forest::scene {

/// Laid out for the forest file: 96 bytes. Its segments come in groups of 8 that follow one another along the branches, so
/// that what is hidden, or beside the picture, can be told from what is not without a look at single segments.
struct Cluster {
  static constexpr std::uint32_t group_size = 8, group_count = frame::cluster_size / group_size;

  float x = 0.f, y = 0.f, z = 0.f, radius = 0.f;  // bounding sphere of all that is below, µm
  float error = 0.f;                              // µm; 0 for a leaf, never less than a child's
  float thickness = 0.f;  // largest radius of a segment drawn, the soma's sphere aside, µm
  std::uint32_t first_segment = 0, segment_count = 0;
  std::uint32_t children[2] = {0, 0};  // clusters; both 0 for a leaf
  std::uint32_t leaf_first = 0;        // original segments below: the first, among the neuron's leaves …
  std::uint32_t leaf_count = 0;        // … and how many
  std::uint32_t groups[group_count] = {};  // the sphere around each group: see group()
  std::uint32_t visible[8] = {};  // which segments show at each of `magnifications`: bit i is segment i

  Sphere sphere() const { return {{x, y, z}, radius}; }
  bool is_leaf() const { return children[0] == 0; }

  /// A branch thinner than a pixel shows from the magnification (pixels a µm) on at which its width reaches its rank. Which
  /// segments may show.
  std::uint32_t visible_at(float magnification) const {
    for (int i = 0; i < 8; ++i)
      if (magnification <= magnifications[i]) return visible[i] & all();
    return all();
  }
  std::uint32_t all() const { return frame::first_segments(segment_count); }
  /// The sphere around the segments [8 i, 8 i + 8) drawn.
  Sphere group(std::uint32_t i) const { return unpacked_group(groups[i], sphere()); }
  static constexpr float magnifications[8] = {.05f, .1f, .17f, .25f, .35f, .5f, .8f, 1.5f};
};
static_assert(sizeof(Cluster) == 96);

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
/// the very first, when it has a size; each stem is joined to it by a cone. A neuron without any segment has no cluster.
ClusterTree build_clusters(const Morphology& morphology);

}  // namespace forest::scene
