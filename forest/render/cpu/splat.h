// SPDX-License-Identifier: Apache-2.0
// Runs of segments drawn into a canvas, in two steps: every segment is brought to the picture once and sorted into the
// squares that it touches, then every square is drawn by one thread, which shares its pixels with nobody.
#pragma once

#include <memory>
#include <span>

#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/run.h"

namespace forest::render::cpu {

/// Holds the memory that drawing needs, from picture to picture.
class Splatter {
 public:
  Splatter();
  ~Splatter();

  /// Draws the lists from near to far; the picture is the same in any order and at any number of threads. Returns how many
  /// segments were neither beside the picture nor hidden by those of the bands before.
  /// @param clear    empties the canvas before
  /// @param reached  one an instance: set to 1 where any of them is its
  std::uint64_t draw(const Picture& picture, const frame::Lists& lists, Canvas& canvas, bool clear,
                     std::span<std::uint8_t> reached);
  /// Overlays: at least two pixels wide, in the world.
  void draw(const Picture& picture, std::span<const frame::Overlay> overlays, Canvas& canvas);
  /// Balls, in the world.
  void draw(const Picture& picture, std::span<const frame::Ball> balls, Canvas& canvas);

  class Sorted;

 private:
  std::unique_ptr<Sorted> sorted_;
};

}  // namespace forest::render::cpu
