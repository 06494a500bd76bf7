// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scale_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/round_numbers.h"

namespace forest::scene {

ScaleBar scale_bar(const frame::Camera& camera, float height, float most) {
  const double pixel = double(camera.pixel_size(height, (camera.eye - camera.target).norm()));
  const double length = round_below(pixel * double(most));
  return {float(length / pixel),
          length < 1000. ? fmt::format("{:.6g} µm", length) : fmt::format("{:.6g} mm", length / 1000.)};
}

std::optional<Block> scale_block(const frame::Camera& camera, const frame::Viewport& picture,
                                 Background background) {
  // In heights of a letter, as colour bars have them.
  constexpr float margin = 1.6f, padding = 1.1f, most = 16.f, above = 2.2f;
  const Lettering letters = letters_in(picture, background);
  const float h = letters.height;
  if (h * (most + 2.f * (margin + padding)) > .8f * picture.width || 12.f * h > picture.height)
    return std::nullopt;
  const ScaleBar bar = scale_bar(camera, picture.height, h * most);
  const float width = std::max(bar.length, letters.width(bar.label)) + 2.f * h * padding;
  const auto paint = [bar, letters, h](frame::Image& image, float left, float top) {
    left += h * padding;
    const float bottom = top + h * (above + padding), thick = std::max(1.5f, .18f * h), tick = .35f * h;
    const auto ink = [&](const Box& box) { fill(image, box, letters.colour); };
    letters.write(image, bar.label, left, bottom - h);
    ink({left, bottom - thick, left + bar.length, bottom});
    for (const float end : {left, left + bar.length - thick})
      ink({end, bottom - thick - tick, end + thick, bottom + tick});
  };
  return Block{Block::scale, Spot::bottom_left, width, h * (above + 2.f * padding), h * margin, paint};
}

}  // namespace forest::scene
