// SPDX-License-Identifier: Apache-2.0
// The segments of one item on their way to pixels, in arrays that the compiler makes vector instructions of.
#pragma once

#include <span>

#include "forest/frame/frame.h"

namespace forest::render::cpu {

/// One picture's constants in the form that drawing needs.
struct Picture {
  frame::Geometry geometry;
  std::span<const frame::State> states;
  frame::Opacities opacities;
  bool transparent = false;  // something may be
  /// Of the first of the subframes that are drawn together, but that `centre` is where the view meets the picture with
  /// none of their offsets (Samples).
  frame::Constants constants;
  float spread = 0.f;  // pixels that samples lie beside the middle of theirs at most
  Mat3 to_camera;      // rows: right, up, forward
  Vec3 eye, light;

  frame::State state_of(const frame::Item& item) const {
    return item.state ? frame::unpacked(item.state) : states[item.instance];
  }
  /// Where an item's neuron stands, as camera = turn · p + at.
  struct Standing {
    Mat3 turn;
    Vec3 at;
  };
  Standing standing(const frame::Item& item) const {
    if (geometry.straw(item)) return {to_camera, to_camera * -eye};
    const frame::Instance& i = geometry.instances[item.instance];
    return {to_camera * Quat(i.qw, i.qx, i.qy, i.qz).toRotationMatrix(),
            to_camera * (Vec3(i.x, i.y, i.z) - eye)};
  }
};

inline constexpr std::size_t run = FOREST_CLUSTER_SIZE;

class Crop;

/// The segments of an item in camera coordinates (x right, y up, z depth), cut at the near distance, and in pixels.
struct Run {
  std::size_t count = 0;
  float ax[run], ay[run], az[run], ra[run], bx[run], by[run], bz[run], rb[run];
  float px[run], py[run], qx[run], qy[run];  // pixels of both ends
  float code_a[run], code_b[run];            // of their depths
  // As a line: along the axis of the screen that it runs along more, from `first` to before `last`, where there is one.
  float left[run], right[run], top[run], bottom[run];  // pixels around it
  std::int32_t tile_left[run], tile_right[run], tile_top[run],
      tile_bottom[run];                                                // as a line: of the picture's tiles
  std::uint32_t nearest[run];                                          // key of its nearest depth
  float line_width[run];                                               // across the axis; 0: nothing to draw
  float first[run], last[run], y[run], slope[run], z[run], rise[run];  // y and z at the first step
  float begin[run], length[run];  // from its end to the middle of the first step, to its other end
  std::uint32_t steep[run], payload[run];
  float lit_side[run],
      lit_front[run];  // half the light on what faces across, downwards or to the right, and to the eye
  float width[run];    // pixels; below 0: nothing of it lies before the eye
  float widest[run];   // half the width of the wider end, pixels
  float reach[run];    // as a capsule: pixels around both ends of its axis that it is seen in
  float front[run];  // as a capsule: code of its nearest depth, 0 where it may reach before the near distance
  float mean_width[run], rank[run];  // of its branch; in [0, 1)
  std::uint32_t entry[run];          // of the palette
  std::uint32_t meta[run];           // as frame::Segment's
  std::uint32_t opacity[run],
      key[run];  // 0: left out; below 255: a screen door with this key (frame/layout.h)
};

/// What is drawn of an item.
/// @param entries  of its segments; null: the colour class says
void load(const Picture& picture, const frame::Item& item, const std::uint8_t* entries, Run& r);
void load(const frame::Overlay& overlay, const Picture& picture, Run& r);

/// From the coordinates of their neuron to pixels: camera = turn · p + at.
/// @param least  pixels: radii are no smaller
void place(const frame::Constants& c, const Mat3& turn, const Vec3& at, float least, Run& r);

/// Where they reach as capsules: `reach`, `front` and the box around each.
/// @param margin  pixels that are added around the box
void surround(const frame::Constants& c, float margin, Run& r);

/// Light on them as lines, which are prepared: their payload and what the rims get.
/// @param towards  the light, in camera coordinates
void light(const frame::Constants& c, const Vec3& towards, Run& r);

/// Cuts segment `i`, as a capsule, at the edges of the picture where it reaches far beyond them (capsule.h).
/// @returns false where nothing is left
bool trim(const frame::Constants& c, const Crop& crop, Run& r, std::size_t i);

/// Straws shorter than FOREST_STRAW_LENGTH times what the thinnest line is wide get as long, and fewer of them are drawn.
void lengthen(const frame::Constants& c, Run& r);

/// Pixels: what the thinnest line measures, or the thinnest straw.
inline float thinnest_of(const frame::Constants& c, bool straws) {
  return (straws ? float(FOREST_STRAW_WIDTH) : 1.f) * c.thinnest;
}
/// What lines need, after draw_line in render/opengl/shaders/common.glsl.
void prepare_lines(const frame::Constants& c, bool straws, float spread, Run& r);

/// What a length at this depth is divided by to be seen.
inline float lens(const frame::Constants& c, float z) { return c.converge * z + c.parallel; }

/// A segment of a branch as a string of beads: spheres that cover as much of the picture together, a bead for two
/// diameters of its length, none shorter than two pixels. A soma is one already.
struct Beads {
  Vec3 a, b;
  std::uint32_t count;
  float radius;

  Beads(const Run& r, float pixels_a_unit);
  /// Bead `k` as the one segment of a run.
  void put(std::uint32_t k, Run& r) const;
};

}  // namespace forest::render::cpu
