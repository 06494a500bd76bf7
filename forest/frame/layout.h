// SPDX-License-Identifier: Apache-2.0
// What the graphics card reads, laid out once: this file is included by C++ and, as text, by every shader. Only 32-bit
// scalars, so that std430, std140 and C++ agree on every offset.
#ifdef __cplusplus
#pragma once
#include <cstdint>
namespace forest::frame {
using uint = std::uint32_t;
#endif

/// A tapered capsule in the coordinates of its neuron (µm). Both ends equal: a sphere.
struct Segment {
  float ax, ay, az;
  uint radii;  // two half floats: radius at a (low), at b (high), µm
  float bx, by, bz;
  uint
      meta;  // bits 0–2 section kind (1 soma, else as SectionKind), 8–15 rank: which share of thin branches goes first,
             // 16–31 mean radius of its branch, a half float, µm: it goes as a whole
};

/// Where a neuron stands: position + rotation by the unit quaternion.
struct Instance {
  float x, y, z;
  uint morphology;
  float qx, qy, qz, qw;
};

/// A run of segments of one neuron to be drawn: one entry of a cut.
struct Item {
  uint instance;
  uint first_segment;
  uint segment_count;  // at most cluster_size
  uint padding;
  float x, y, z, radius;  // a sphere around all of it, in the world, µm
};

/// One picture's constants. Directions are the camera's axes in the world; z is the depth along `forward`.
struct Constants {
  float eye_x, eye_y, eye_z, focal;  // focal: pixels per unit slope
  float right_x, right_y, right_z, centre_x;
  float up_x, up_y, up_z, centre_y;  // centre: pixel that `forward` meets (jitter included)
  float forward_x, forward_y, forward_z, near;
  uint width, height, subframe, first_item;
  float light_x, light_y, light_z, halo;                  // light: in camera axes
  float fog_red, fog_green, fog_blue, fog_start;          // linear light; µm
  float top_red, top_green, top_blue, fog_length;         // background above; µm
  float bottom_red, bottom_green, bottom_blue, exposure;  // background below
  uint subframes, item_count, flags,
      last_subframe;  // the items first_item … first_item + item_count are drawn
};

// A pixel's key: depth (20 bits, logarithmic), palette entry (7 bits), shade (5 bits). The smallest key wins, so the
// picture does not depend on the order of drawing, and one 32-bit atomicMin does the whole depth test.
// Depth: 43,240 steps an octave from 2^-4.32 µm (0.05 µm) on: neighbours differ by 1.6e-5 of their distance.
#define FOREST_DEPTH_STEPS 43240.0
#define FOREST_DEPTH_BASE 4.3219281
#define FOREST_DEPTH_MAX 1048574.0
#define FOREST_KEY_EMPTY 0xffffffffu

// Lines are drawn across the axis of the screen that they run along less: in a direction between, they measure this many
// times their width there, on the mean over directions (4/pi ln(1 + sqrt 2)).
#define FOREST_MEAN_STRETCH 1.1222
#define FOREST_CLUSTER_SIZE 32u
#define FOREST_GROUP 256u  // threads of a workgroup that draws

// Constants::flags
#define FOREST_OVERLAY 1u     // segments lie in the world and name their palette entry
#define FOREST_COARSE 2u      // tiles of tiles
#define FOREST_FIRST_BAND 4u  // nothing is hidden yet
#define FOREST_ENTRIES 8u     // every segment has a palette entry of its own …
#define FOREST_SINGLE 16u     // … and the list has one an item, not FOREST_CLUSTER_SIZE

// Occlusion: the farthest key of every square of 8 × 8 pixels, then of every 8 × 8 of those.
#define FOREST_TILE 8u

#ifdef __cplusplus
static_assert(sizeof(Segment) == 32 && sizeof(Instance) == 32 && sizeof(Item) == 32 &&
              sizeof(Constants) == 160);
inline constexpr uint cluster_size = FOREST_CLUSTER_SIZE;
}  // namespace forest::frame
#endif
