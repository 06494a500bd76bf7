// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scale_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/round_numbers.h"
#include "forest/scene/colour_bar.h"

namespace forest::scene {

ScaleBar scale_bar(const frame::Camera& camera, float height, float most) {
  const double pixel = double(camera.pixel_size(height, (camera.eye - camera.target).norm()));
  const double length = round_below(pixel * double(most));
  return {float(length / pixel),
          length < 1000. ? fmt::format("{:.6g} µm", length) : fmt::format("{:.6g} mm", length / 1000.)};
}

bool paint_scale(frame::Image& image, const frame::Camera& camera, Background background) {
  // In heights of a letter, as colour bars have them.
  constexpr float margin = 1.6f, padding = 1.1f, most = 16.f;
  const Writing writing = writing_in(image, background);
  const float h = writing.letters.height;
  if (h * (most + 2.f * (margin + padding)) > .8f * float(image.width) || 12.f * h > float(image.height))
    return false;
  const ScaleBar bar = scale_bar(camera, float(image.height), h * most);
  const float left = h * (margin + padding), bottom = float(image.height) - h * (margin + padding);
  const float wide = std::max(bar.length, writing.letters.width(bar.label)), thick = std::max(1.5f, .18f * h);
  const float tick = .35f * h;
  const auto ink = [&](const Box& box) { fill(image, box, writing.letters.colour); };
  fill(image,
       {left - h * padding, bottom - h * (2.2f + padding), left + wide + h * padding, bottom + h * padding},
       writing.ground, .62f);
  writing.letters.write(image, bar.label, left, bottom - h);
  ink({left, bottom - thick, left + bar.length, bottom});
  for (const float end : {left, left + bar.length - thick})
    ink({end, bottom - thick - tick, end + thick, bottom + tick});
  return true;
}

}  // namespace forest::scene
