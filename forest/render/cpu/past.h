// SPDX-License-Identifier: Apache-2.0
// What the pictures before have seen, brought to the camera of this one: a moving picture draws some of its sixteen samples a pixel
// anew and takes the others from what was drawn in the places of those samples a few pictures ago. Every sample that is kept is a
// place in the world with its colour, so it is brought to the new camera by its own depth, as in Walter, Drettakis & Parker 1999
// ("Interactive rendering using the render cache"), and not a mean of a pixel by one depth, as in temporal antialiasing (Yang, Liu &
// Salvi 2020, "A survey of temporal antialiasing techniques"): in a thicket a pixel shows things of many depths, each of which moves
// its own way. It is brought but once, from where it was drawn, so that nothing is blurred by being filtered again and again; and a
// camera at rest has all of its sixteen samples after as many pictures as they take: exactly those of a still picture.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/render/cpu/canvas.h"

namespace forest::render::cpu {

class Past {
 public:
  static constexpr std::uint32_t samples = most_samples;

  /// Whether a frame is one for which what was seen before counts.
  static bool serves(const frame::Frame& frame);
  /// Takes the samples of a canvas as those of the frame, and brings the others to its camera. Forgets all that was seen of something
  /// else, or at another size.
  /// @param first  the number of the canvas's first sample
  void take(const Canvas& canvas, const frame::Frame& frame, std::uint32_t first);
  void forget();

  /// The keys of all samples of pixels of one row. Of a sample that nobody has seen, or not where it is now, it has another one's.
  void read_row(std::int32_t y, std::int32_t from, std::int32_t to, std::uint32_t* keys) const;

 private:
  // The picture of a sample.
  struct Plane {
    bool known = false, moved = false;
    frame::Camera camera;
    std::vector<std::uint32_t> seen;     // keys in rows, where it was drawn
    std::vector<std::uint32_t> brought;  // … where this camera sees them, when it is another one
  };
  void bring(Plane& plane, std::uint32_t sample, const frame::Camera& now) const;

  std::uint64_t number_ = 0;
  std::uint32_t width_ = 0, height_ = 0, first_ = 0, count_ = 1;
  std::array<Plane, samples> planes_;
};

}  // namespace forest::render::cpu
