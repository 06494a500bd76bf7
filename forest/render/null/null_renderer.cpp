// SPDX-License-Identifier: Apache-2.0
#include "forest/render/null/null_renderer.h"

namespace forest::render {

void NullRenderer::load(const frame::Geometry& geometry) { geometry_ = geometry; }

frame::Timing NullRenderer::draw(const frame::Frame& frame) {
  frame::check(frame, geometry_);
  if (frame.rest) frame::check(frame.rest({}, 0), geometry_);
  width_ = frame.width, height_ = frame.height;
  return {};
}

frame::Image NullRenderer::read() {
  frame::Image image{width_, height_, std::vector<std::uint8_t>(std::size_t(width_) * height_ * 4)};
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}

}  // namespace forest::render
