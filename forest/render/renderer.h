// SPDX-License-Identifier: Apache-2.0
// The seam between pictures as data and pictures as pixels.
#pragma once

#include <cstdint>
#include <span>

#include "forest/frame/frame.h"

namespace forest::render {

class Renderer {
 public:
  virtual ~Renderer() = default;

  /// Takes the geometry that the following frames speak of.
  virtual void load(const frame::Geometry& geometry) = 0;
  /// Draws; throws Error when the frame violates its contract (frame::check) or the device fails.
  virtual frame::Timing draw(const frame::Frame& frame) = 0;
  /// The pixels of the last frame.
  virtual frame::Image read() = 0;
  /// Share of them that shows something of the forest, without a copy of them where that can be had. Waits until the frame is
  /// drawn.
  virtual double covered() { return read().covered; }
  /// The same without a copy, until the next frame is drawn; null where they lie elsewhere. Opacity is the share of a pixel
  /// that is covered.
  virtual const frame::Image* image() const { return nullptr; }
  /// How far one saw in the last subframe of the last frame, before its `rest` was drawn; empty when it had none.
  virtual const frame::DepthMap& seen() const = 0;
  /// One an instance: whether anything of it in the last frame's lists was neither beside the picture nor hidden by what had been
  /// drawn. Empty where nobody looks.
  virtual std::span<const std::uint8_t> reached() const { return {}; }
  /// Whether renderers of this kind may draw at the same time, each on any thread.
  virtual bool concurrent() const { return false; }
  /// Who draws, for people ("llvmpipe (LLVM 15.0.6, 256 bits)").
  virtual std::string name() const = 0;
};

}  // namespace forest::render
