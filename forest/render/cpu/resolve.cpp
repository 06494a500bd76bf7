// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/resolve.h"

#include <array>
#include <atomic>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/frame/constants.h"

namespace forest::render::cpu {
namespace {

constexpr std::size_t beside = 2;  // pixels that the rim reaches
constexpr std::size_t rows_at_once = 24;
constexpr std::size_t steps = 4096;  // of the table from light to sRGB

double srgb(double light) {
  return light <= .0031308 ? 12.92 * light : 1.055 * std::pow(light, 1. / 2.4) - .055;
}

// 255 × sRGB of light 0–1.
float encoded(float light) {
  static const auto table = [] {
    std::array<float, steps + 2> t{};
    for (std::size_t i = 0; i < t.size(); ++i)
      t[i] = float(255. * std::min(1., srgb(double(i) / double(steps))));
    return t;
  }();
  const float at = smaller(larger(light, 0.f), 1.f) * float(steps);
  const auto i = std::size_t(at);
  return table[i] + (at - float(i)) * (table[i + 1] - table[i]);
}

// Depths of a row in octaves, `beside` pixels more at both ends.
[[gnu::target_clones("default", "arch=haswell")]] void octaves_of(const std::uint32_t* keys,
                                                                  std::size_t width, float* octaves) {
  for (std::size_t x = 0; x < width; ++x)
    octaves[x + beside] = float(std::int32_t(keys[x] >> 12)) * (1.f / float(FOREST_DEPTH_STEPS));
  for (std::size_t i = 0; i < beside; ++i)
    octaves[i] = octaves[beside], octaves[width + beside + i] = octaves[width + beside - 1];
}

[[gnu::always_inline]] inline float nearer(float octave, float other) {
  return smaller(larger((octave - other) * 40.f, 0.f), 1.f);
}

// Of a row: how much light it keeps, and how much fog lies before it.
struct Shading {
  const float* rows[5];  // octaves of the rows around
  const std::uint32_t* keys;
  float halo, fog_start, fog_length;
};

[[gnu::target_clones("default", "arch=haswell")]] void shade(const Shading& s, std::size_t begin,
                                                             std::size_t end, float* __restrict lit,
                                                             float* __restrict fog) {
  const float *up2 = s.rows[0] + beside, *up = s.rows[1] + beside, *here = s.rows[2] + beside,
              *down = s.rows[3] + beside, *down2 = s.rows[4] + beside;
  const float strength = -1.1f * s.halo / 8.f * 1.44269504f, per_length = -1.44269504f / s.fog_length,
              fog_start = s.fog_start;
  for (std::size_t x = begin; x < end; ++x) {
    const float o = here[x];
    const float rim = nearer(o, here[x + 1]) + nearer(o, *(here + x - 1)) + nearer(o, down[x]) +
                      nearer(o, up[x]) + nearer(o, down2[x + 2]) + nearer(o, *(down2 + x - 2)) +
                      nearer(o, up2[x + 2]) + nearer(o, *(up2 + x - 2));
    const float light = float(std::int32_t(s.keys[x] & 31)) * (1.f / 31.f);
    const float z = exp2_of(o - float(FOREST_DEPTH_BASE));
    lit[x] = (.16f + 1.05f * light * light) * exp2_of(strength * rim);
    fog[x] = 1.f - exp2_of(larger(0.f, z - fog_start) * per_length);
  }
}

}  // namespace

void resolve(const Canvas& canvas, const frame::Constants& c, const frame::Palette& palette,
             const frame::Area& area, std::vector<float>& sums, frame::Image& image) {
  const auto width = std::size_t(canvas.width()), height = std::size_t(canvas.height());
  const bool first = c.subframe == 0, keep = c.subframe + 1 < c.subframes,
             show = c.subframe + 1 >= c.last_subframe;
  if (c.subframes > 1) sums.resize(width * height * 4);
  image.width = c.width, image.height = c.height;
  image.pixels.resize(width * height * 4);
  const float share = 1.f / float(c.subframe + 1), exposure = c.exposure * share;
  const Vec3 top(c.top_red, c.top_green, c.top_blue), bottom(c.bottom_red, c.bottom_green, c.bottom_blue),
      mist(c.fog_red, c.fog_green, c.fog_blue);
  const Vec3 glass(c.glass_red, c.glass_green, c.glass_blue);
  const bool tinted = c.glass_opacity > 0.f;
  std::atomic<std::uint64_t> covered = 0;
  const std::size_t high = area.bottom - area.top, chunks = (high + rows_at_once - 1) / rows_at_once,
                    padded = width + 2 * beside;
  parallel_for(chunks, 1, [&](std::size_t chunk) {
    const std::size_t begin = area.top + chunk * rows_at_once,
                      end = std::min<std::size_t>(area.bottom, begin + rows_at_once);
    std::vector<float> octaves((rows_at_once + 2 * beside) * padded), lit(width), fog(width);
    std::vector<std::uint32_t> all_keys((rows_at_once + 2 * beside) * width);
    const auto row_of = [&](std::size_t y) {
      return &octaves[(y + beside - begin) * padded];
    };  // y may be `beside` outside
    for (std::size_t k = 0; k < end - begin + 2 * beside; ++k) {
      const std::size_t y = std::min(std::max(begin + k, beside) - beside, height - 1);
      canvas.read_row(std::int32_t(y), &all_keys[k * width]);
      octaves_of(&all_keys[k * width], width, &octaves[k * padded]);
    }
    std::uint64_t alpha = 0;
    for (std::size_t y = begin; y < end; ++y) {
      const std::uint32_t* keys = &all_keys[(y + beside - begin) * width];
      Shading shading{{}, keys, c.halo, c.fog_start, c.fog_length};
      for (std::size_t k = 0; k < 5; ++k) shading.rows[k] = row_of(y + k - beside);
      // Only where something is drawn.
      for (std::size_t x = area.left; x < area.right;) {
        while (x < area.right && keys[x] == FOREST_KEY_EMPTY) ++x;
        const std::size_t from = x;
        std::size_t gap = 0;
        for (; x < area.right && gap < 16; ++x) gap = keys[x] == FOREST_KEY_EMPTY ? gap + 1 : 0;
        shade(shading, from, x, lit.data(), fog.data());
      }
      const Vec3 sky = top + (float(y) + .5f) / float(height) * (bottom - top);
      Vec3 sky_code;
      for (int i = 0; i < 3; ++i) sky_code[i] = encoded(sky[i] * c.exposure);
      for (std::size_t x = area.left; x < area.right; ++x) {
        const std::size_t at = y * width + x;
        const bool empty = keys[x] == FOREST_KEY_EMPTY;
        const float noise = noise_at(std::int32_t(x), std::int32_t(y), c.subframe);
        std::uint8_t* pixel = &image.pixels[4 * at];
        if (empty && c.subframes == 1 && !tinted) {
          for (int i = 0; i < 3; ++i) pixel[i] = std::uint8_t(smaller(sky_code[i] + noise, 255.f));
          pixel[3] = 0;
          continue;
        }
        Vec3 colour = sky;
        if (!empty) {
          const Vec3& base = palette[keys[x] >> 5 & 127];
          colour = base * lit[x] + fog[x] * (mist - base * lit[x]);
        }
        if (tinted) {
          const float z = frame::glass_depth(c, float(x) + .5f, float(y) + .5f);
          if (empty ? std::isfinite(z) : z < frame::depth_of_code(keys[x] >> 12))
            colour += c.glass_opacity * (glass - colour);
        }
        float sum[4] = {colour.x(), colour.y(), colour.z(), empty ? 0.f : 1.f};
        if (!first)
          for (std::size_t i = 0; i < 4; ++i) sum[i] += sums[4 * at + i];
        if (keep)
          for (std::size_t i = 0; i < 4; ++i) sums[4 * at + i] = sum[i];
        if (!show) continue;
        for (int i = 0; i < 3; ++i)
          pixel[i] = std::uint8_t(smaller(encoded(sum[i] * exposure) + noise, 255.f));
        pixel[3] = std::uint8_t(255.f * sum[3] * share + .5f);
        alpha += pixel[3];
      }
    }
    covered += alpha;
  });
  image.covered = double(covered) / 255. / double(std::max<std::size_t>(1, high * (area.right - area.left)));
}

}  // namespace forest::render::cpu
