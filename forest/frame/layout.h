// SPDX-License-Identifier: Apache-2.0
// What the graphics card reads, laid out once: this file is included by C++ and, as text, by every shader. Only 32-bit
// scalars, so that std430, std140 and C++ agree on every offset.
#ifdef __cplusplus
#pragma once
#include <cstdint>
#define FOREST_SHARED constexpr
namespace forest::frame {
using uint = std::uint32_t;
#else
#define FOREST_SHARED
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

/// Whose branch a straw stands for: a segment in the world that is drawn in place of many (scene/brick.h).
struct Owner {
  uint instance;
  uint segment;  // an original one
};

/// A run of segments of one neuron to be drawn, or of straws: one entry of a cut.
struct Item {
  uint instance;  // FOREST_IN_WORLD: straws, each of which has its Owner's state
  uint first_segment;
  uint drawn;             // bit i: segment first_segment + i is drawn
  uint state;             // 0: as its instance; else a State of its own, its bytes from the lowest on
  float x, y, z, radius;  // a sphere around all of it, in the world, µm
};

/// A corner of triangles.
struct Vertex {
  float x, y, z;
  uint openness;  // 0–255
  float nx, ny, nz;
  uint reserved;
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
  // A length at depth z covers focal × length / (converge × z + parallel) pixels: 1, 0 for a perspective camera, 0, 1 for an
  // orthographic one, whose focal is pixels a µm.
  float converge, parallel, glass_opacity,
      thinnest;  // pixels; lines that are thinner are drawn as wide, straws also not at all
  float glass_x, glass_y, glass_z,
      glass_at;  // glass: n · p = at, p in camera axes (z depth); opacity 0: none
  float glass_right_x, glass_right_y, glass_right_z,
      glass_left_edge;                                       // it reaches from here, along its right …
  float glass_up_x, glass_up_y, glass_up_z, glass_low_edge;  // … and its up
  float glass_right_edge, glass_high_edge;                   // … to here
  uint opacity, door;                        // 0–255, of the surface drawn, and the key of its screen door
  float glass_red, glass_green, glass_blue;  // linear light
  uint instance;                             // of the surface drawn; all ones: it lies in the world
  float least_radius, unused_1, unused_2, unused_3;  // pixels; what has a neuron is drawn no thinner
};

// A pixel's key: depth (20 bits, logarithmic), palette entry (7 bits), shade (5 bits). The smallest key wins, so the
// picture does not depend on the order of drawing, and one 32-bit atomicMin does the whole depth test.
// Depth: 43,240 steps an octave from 2^-4.32 µm (0.05 µm) on: neighbours differ by 1.6e-5 of their distance.
#define FOREST_DEPTH_STEPS 43240.0
#define FOREST_DEPTH_BASE 4.3219281
#define FOREST_DEPTH_MAX 1048574.0
#define FOREST_KEY_EMPTY 0xffffffffu

#define FOREST_IN_WORLD 0xffffffffu

// Lines are drawn across the axis of the screen that they run along less: in a direction between, they measure this many
// times their width there, on the mean over directions (4/pi ln(1 + sqrt 2)).
#define FOREST_MEAN_STRETCH 1.1222
// Ranks, which are 256ths, times this: their fractions follow one another as evenly spread as may be.
#define FOREST_SPREAD 97.0
// A straw that stands for many is drawn no thinner, and no shorter, than so many times the thinnest line: its area is that of
// a dot as wide, and it shows where branches run.
#define FOREST_STRAW_WIDTH 0.5
#define FOREST_STRAW_LENGTH 2.0
#define FOREST_CLUSTER_SIZE 32u
#define FOREST_GROUP 256u  // threads of a workgroup that draws

// Constants::flags
#define FOREST_OVERLAY 1u     // segments lie in the world and name their palette entry
#define FOREST_FIRST_BAND 4u  // nothing is hidden yet
#define FOREST_ENTRIES 8u     // every segment has a palette entry of its own …
#define FOREST_SINGLE 16u     // … and the list has one an item, not FOREST_CLUSTER_SIZE
#define FOREST_BALLS 32u      // of an overlay: spheres as large as they are

// Transparency is stochastic (Enderton, Sintorn, Shirley & Luebke 2010, "Stochastic transparency"): what is half
// transparent shows in half of the subframes, opaque there, so that the depth test is right without any order and the
// mean is the blend. In which subframes is drawn for every branch of every neuron by itself, so that layers behind one
// another are independent; with fewer subframes than this also for every pixel, so that a single one is a screen door.
#define FOREST_DOOR_SUBFRAMES 16u

FOREST_SHARED uint forest_mixed(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

FOREST_SHARED uint forest_reversed(uint x) {
  x = ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
  return (x << 16) | (x >> 16);
}

// Laine & Karras 2011: a bit of the result depends on that bit and those below it.
FOREST_SHARED uint forest_scrambled(uint x, uint seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  return x ^ (x * 0x8d22f6e6u);
}

// Rank of a dot, in [0, 1): a dot of less than a pixel is drawn where its area is more. The ranks of neurons with numbers in a row,
// and of the branches of one, are spread evenly (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"), and
// integers keep that for any number of them.
FOREST_SHARED float forest_dot_rank(uint instance, uint branch) {
  return float((instance * 0xc13fa9a9u + branch * 0x91e10da6u) >> 8) * 5.9604645e-8f;
}

FOREST_SHARED uint forest_branch_key(uint instance, uint meta) {
  return forest_mixed(forest_mixed(instance) + meta);
}

// Whether what has this opacity (0–255) shows in this subframe. The thresholds of one key are a shuffled and scrambled van
// der Corput sequence (Burley 2020, "Practical hash-based Owen scrambling"): of n subframes, n · opacity to within one.
FOREST_SHARED bool forest_shows(uint opacity, uint key, uint subframe) {
  uint place = forest_reversed(forest_scrambled(forest_reversed(subframe), key));
  uint threshold = forest_reversed(forest_scrambled(place, forest_mixed(key ^ 0x9e3779b9u)));
  return (threshold >> 16) * 255u < opacity << 16;
}

// A surface folds, so that one ray may meet it often: its two sides have doors of their own in every pixel, and what is half
// transparent shows half of the nearest front, and a quarter of the nearest back behind it.
FOREST_SHARED uint forest_surface_key(uint number, uint instance) {
  return forest_mixed(forest_mixed(number + 0x51ed270bu) + instance);
}
FOREST_SHARED uint forest_side_key(uint surface_key, bool front, uint pixel) {
  return surface_key ^ forest_mixed(front ? pixel : ~pixel);
}

// Occlusion: the farthest key of every square of 8 × 8 pixels, then of every 8 × 8 of those.
#define FOREST_TILE 8u

#ifdef __cplusplus
static_assert(sizeof(Segment) == 32 && sizeof(Instance) == 32 && sizeof(Item) == 32 && sizeof(Vertex) == 32 &&
              sizeof(Constants) == 272);
inline constexpr uint cluster_size = FOREST_CLUSTER_SIZE;
/// Item::drawn of all of so many segments, of cluster_size when they are more.
constexpr uint first_segments(std::uint64_t count) { return count < 32 ? (1u << count) - 1u : 0xffffffffu; }
}  // namespace forest::frame
#endif
