// SPDX-License-Identifier: Apache-2.0
// The forest as one section of a series shows it: what a plane cuts of every neurite, at full detail.
#pragma once

#include <cmath>
#include <vector>

#include "forest/geometry/cross_section.h"
#include "forest/scene/forest.h"

namespace forest::scene {

/// A profile: what the plane cuts of one segment (the word of stereology). Profiles of one neuron overlap at joints.
struct Profile {
  std::uint32_t instance = 0;
  std::uint32_t segment = 0;  // in Forest::segments()
  std::uint32_t kind = 0;     // 1 for the soma, else as SectionKind
  CrossSection shape;
};

struct Slice {
  Plane plane;
  std::vector<Profile> profiles;  // by neuron, then by segment
};

/// A part of a plane, along its right and up, µm.
struct Sheet {
  Place low{-INFINITY, -INFINITY}, high{INFINITY, INFINITY};
};

/// Found through the clusters' bounds, on all cores; the same at any number of threads.
/// @param sheet  profiles wholly beside it are left out
Slice slice(const Forest& forest, const Plane& plane, const Sheet& sheet = {});

struct ProfileArea {
  std::uint32_t instance = 0, kind = 0;
  std::uint32_t profiles = 0;  // of segments
  double area = 0.;  // µm², of their union; what two kinds share belongs to that of the smaller number
};
/// By neuron and kind, in this order.
std::vector<ProfileArea> areas(const Slice& slice);

/// The rectangle that holds all profiles; none, low beyond high, without any.
Sheet bounds_of(const Slice& slice);

/// The rectangle that holds all that a plane may cut of the forest's somata and a margin, along its right and up.
Sheet sheet_of(const Forest& forest, const Plane& plane);

}  // namespace forest::scene
