// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/matte.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"

namespace forest::frame {

Image matted(const Image& on_black, const Image& on_white) {
  Image image{on_black.width, on_black.height, std::vector<std::uint8_t>(on_black.pixels.size()),
              on_black.covered};
  parallel_for(image.pixels.size() / 4, 4096, [&](std::size_t i) {
    const std::uint8_t *black = &on_black.pixels[4 * i], *white = &on_white.pixels[4 * i];
    float through = 0.f;  // of the ground, 0–255
    for (int c = 0; c < 3; ++c) through += float(int(white[c]) - int(black[c])) / 3.f;
    const float opacity = std::round(255.f - std::clamp(through, 0.f, 255.f));
    std::uint8_t* pixel = &image.pixels[4 * i];
    pixel[3] = std::uint8_t(opacity);
    if (opacity == 0.f) return;
    // The least squares of what differs on either ground.
    for (int c = 0; c < 3; ++c) {
      const float shown = .5f * (float(black[c]) + float(white[c]) - (255.f - opacity));
      pixel[c] = std::uint8_t(std::lround(std::clamp(255.f * shown / opacity, 0.f, 255.f)));
    }
  });
  return image;
}

}  // namespace forest::frame
