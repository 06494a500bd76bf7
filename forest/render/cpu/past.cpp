// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/past.h"

#include <algorithm>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"
#include "forest/render/cpu/arithmetic.h"

namespace forest::render::cpu {
namespace {

// Of planes: that nothing has been seen there, and that it was the sky.
constexpr std::uint32_t hole = FOREST_KEY_EMPTY, sky = FOREST_KEY_EMPTY - 1;

constexpr std::size_t at_once = 256;  // pixels

// How places of one picture become places of another: the depth along the view times (x, y, 1), turned, and moved.
struct Move {
  float m[3][3], t[3];
  float from_x, from_y, per_focal, from_converge, from_parallel;  // pixel to slope
  float to_x, to_y, focal, converge, parallel, near;
  std::int32_t width, height;
};

// Of pixels that follow one another in a row, where each is and its key there; beyond the picture the number of pixels.
FOREST_CLONES void move_row(const Move& move, const std::uint32_t* __restrict keys, std::size_t count,
                            std::int32_t x, std::int32_t y, std::int32_t* __restrict places,
                            std::uint32_t* __restrict moved) {
  const float m00 = move.m[0][0], m01 = move.m[0][1], m02 = move.m[0][2], m10 = move.m[1][0], m11 = move.m[1][1],
              m12 = move.m[1][2], m20 = move.m[2][0], m21 = move.m[2][1], m22 = move.m[2][2], tx = move.t[0],
              ty = move.t[1], tz = move.t[2];
  const float sy = (move.from_y - float(y)) * move.per_focal, from_x = float(x) - move.from_x,
              per_focal = move.per_focal, from_converge = move.from_converge, from_parallel = move.from_parallel;
  const float to_x = move.to_x, to_y = move.to_y, focal = move.focal, converge = move.converge,
              parallel = move.parallel, near = move.near;
  const std::int32_t width = move.width, height = move.height, nowhere = width * height;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t key = keys[i];
    const float octave = (float(std::int32_t(key >> 12)) + .5f) * (1.f / float(FOREST_DEPTH_STEPS));
    const float z = exp2_of(octave - float(FOREST_DEPTH_BASE)), wide = from_converge * z + from_parallel;
    const float px = (from_x + float(std::int32_t(i))) * per_focal * wide, py = sy * wide;
    const float qx = m00 * px + m01 * py + m02 * z + tx, qy = m10 * px + m11 * py + m12 * z + ty,
                qz = m20 * px + m21 * py + m22 * z + tz;
    const float depth = larger(qz, near), scale = focal / (converge * depth + parallel);
    const float at_x = to_x + scale * qx, at_y = to_y - scale * qy;
    const bool inside = (at_x >= 0.f) & (at_y >= 0.f) & (at_x < float(width)) & (at_y < float(height)) & (qz > near);
    const std::int32_t ix = std::int32_t(smaller(larger(at_x, 0.f), 32767.f)),
                       iy = std::int32_t(smaller(larger(at_y, 0.f), 32767.f));
    places[i] = inside ? iy * width + ix : nowhere;
    moved[i] = key == sky ? sky : key_of(depth_code(depth), key & 4095u);
  }
}

}  // namespace

bool Past::serves(const frame::Frame& f) {
  const std::uint32_t drawn = std::min(f.last_subframe, f.subframes) - f.first_subframe;
  return f.past != 0 && f.subframes == samples && (drawn == 1 || drawn == 4) && f.first_subframe % drawn == 0 &&
         !f.area && f.unwanted.empty();
}

void Past::forget() {
  for (Plane& plane : planes_) plane.known = false;
  number_ = 0;
}

void Past::take(const Canvas& canvas, const frame::Frame& f, std::uint32_t first) {
  if (f.past != number_ || f.width != width_ || f.height != height_) forget();
  number_ = f.past, width_ = f.width, height_ = f.height;
  first_ = first, count_ = std::uint32_t(canvas.samples());
  const std::size_t pixels = std::size_t(width_) * height_;
  for (std::uint32_t k = 0; k < count_; ++k) {
    Plane& plane = planes_[first + k];
    plane.known = true, plane.moved = false, plane.camera = f.camera;
    plane.seen.resize(pixels);
  }
  parallel_for(height_, 16, [&](std::size_t y) {
    thread_local std::vector<std::uint32_t> keys;
    keys.resize(std::size_t(width_) * count_);
    canvas.read_row(std::int32_t(y), 0, std::int32_t(width_), keys.data());
    for (std::uint32_t k = 0; k < count_; ++k) {
      std::uint32_t* to = &planes_[first + k].seen[y * width_];
      const std::uint32_t* from = keys.data() + k;
      for (std::size_t x = 0; x < width_; ++x) to[x] = std::min(from[x * count_], sky);
    }
  });
  parallel_for(samples, 1, [&](std::size_t k) {
    Plane& plane = planes_[k];
    if (k - first < count_ || !plane.known) return;
    plane.moved = !(plane.camera == f.camera);
    if (plane.moved) bring(plane, std::uint32_t(k), f.camera);
  });
}

void Past::bring(Plane& plane, std::uint32_t sample, const frame::Camera& now) const {
  const std::size_t pixels = std::size_t(width_) * height_;
  plane.brought.assign(pixels + 1, hole);
  const Mat3 from_axes = plane.camera.axes(), to_axes = now.axes();
  const Vec3 flip(1.f, 1.f, -1.f);  // axes look backward
  const Mat3 turn = flip.asDiagonal() * to_axes.transpose() * from_axes * flip.asDiagonal();
  const Vec3 way = flip.asDiagonal() * to_axes.transpose() * (plane.camera.eye - now.eye);
  const Vec2 place = frame::sample_place(sample, samples);
  Move move;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) move.m[i][j] = turn(i, j);
    move.t[i] = way[i];
  }
  const float half_x = .5f * float(width_), half_y = .5f * float(height_);
  move.from_x = half_x + place.x() - .5f, move.from_y = half_y + place.y() - .5f;
  move.per_focal = 1.f / plane.camera.focal(float(height_));
  move.from_converge = plane.camera.orthographic() ? 0.f : 1.f, move.from_parallel = 1.f - move.from_converge;
  move.to_x = half_x, move.to_y = half_y, move.focal = now.focal(float(height_));
  move.converge = now.orthographic() ? 0.f : 1.f, move.parallel = 1.f - move.converge;
  move.near = now.near;
  move.width = std::int32_t(width_), move.height = std::int32_t(height_);
  std::int32_t places[at_once];
  std::uint32_t moved[at_once];
  std::uint32_t* to = plane.brought.data();
  for (std::uint32_t y = 0; y < height_; ++y)
    for (std::uint32_t x = 0; x < width_; x += at_once) {
      const std::size_t count = std::min<std::size_t>(at_once, width_ - x);
      move_row(move, &plane.seen[std::size_t(y) * width_ + x], count, std::int32_t(x), std::int32_t(y), places, moved);
      for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t& there = to[places[i]];
        there = moved[i] < there ? moved[i] : there;
      }
    }
}

void Past::read_row(std::int32_t y, std::int32_t from, std::int32_t to, std::uint32_t* keys) const {
  const std::size_t begin = std::size_t(y) * width_ + std::size_t(from), count = std::size_t(to - from);
  for (std::uint32_t k = 0; k < samples; ++k) {
    const std::uint32_t* instead = &planes_[first_ + k % count_].seen[begin];
    const Plane& plane = planes_[k];
    const std::uint32_t* own = !plane.known ? instead : plane.moved ? &plane.brought[begin] : &plane.seen[begin];
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t key = own[i] == hole ? instead[i] : own[i];
      keys[i * samples + k] = key == sky ? FOREST_KEY_EMPTY : key;
    }
  }
}

}  // namespace forest::render::cpu
