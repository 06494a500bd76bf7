// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/resolve.h"

#include <array>
#include <atomic>
#include <cmath>
#include <cstring>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"
#include "forest/core/srgb.h"
#include "forest/frame/constants.h"
#include "forest/render/cpu/window.h"

namespace forest::render::cpu {
namespace {

constexpr std::int32_t beside = 2;  // pixels that the rim reaches
constexpr std::int32_t rows_at_once = 24;
constexpr std::int32_t row_at_once = 1024;  // of a row
constexpr std::size_t steps = 4096;         // of the table from light to sRGB
constexpr float unit = float(1 << 17);      // of fixed point: 1,024 samples of a light of 8 fit
constexpr float brightest = 8.f;

// 255 × sRGB of light 0–1 in even steps: of each step the value it begins with, above the lower 12 bits, and in these how
// much it rises, both in units of 2⁻¹². One look gives both.
using Codes = std::array<std::uint32_t, steps + 1>;
const Codes& codes() {
  static const Codes table = [] {
    const auto code = [](std::size_t step) {
      return std::uint32_t(std::lround(4096. * 255. * std::min(1., to_srgb(double(step) / double(steps)))));
    };
    Codes t{};
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = code(i) << 12 | (code(i + 1) - code(i));
    return t;
  }();
  return table;
}

// That of a light, in units of 2⁻²⁰. In whole numbers, whose limits stay without branches.
[[gnu::always_inline]] inline std::int32_t encoded(const std::uint32_t* table, float light) {
  constexpr std::int32_t bits = 8;  // within a step
  const std::int32_t at =
      std::clamp(std::int32_t(light * float(steps << bits)), 0, std::int32_t(steps << bits));
  const auto code = std::int32_t(table[at >> bits]), value = std::int32_t(table[at >> bits] >> 12);
  return (value << bits) + (code & 4095) * (at & ((1 << bits) - 1));
}

constexpr float whole_code = float(1 << 20);
[[gnu::always_inline]] inline std::int32_t byte_of(std::int32_t code) { return std::min(code >> 20, 255); }

// Sums of pixels that follow one another, a plane for each channel and one for coverage.
struct Planes {
  std::int32_t* first;
  std::size_t size;
  std::int32_t* operator[](std::size_t channel) const { return first + channel * size; }
};

// Pixels that follow one another in a row, to be shown: what their samples' light and coverage are multiplied by.
struct Exposed {
  std::size_t pixels;
  std::int32_t x, y;  // of the first
  std::uint32_t subframe;
  float exposure, share;
};

// From sums to pixels of four bytes, the first the lowest.
FOREST_CLONES void show(const Exposed& e, const std::uint32_t* table, const Planes& sums,
                        std::uint32_t* __restrict shown) {
  const float exposure = e.exposure, share = e.share;
  const std::int32_t *red = sums[0], *green = sums[1], *blue = sums[2], *coverage = sums[3];
  for (std::size_t i = 0; i < e.pixels; ++i) {
    const auto noise = std::int32_t(whole_code * noise_at(e.x + std::int32_t(i), e.y, e.subframe));
    const auto byte = [&](const std::int32_t* channel) __attribute__((always_inline)) {
      return std::uint32_t(byte_of(encoded(table, float(channel[i]) * exposure) + noise));
    };
    const auto alpha = std::uint32_t(std::int32_t(255.f * float(coverage[i]) * share + .5f));
    shown[i] = byte(red) | byte(green) << 8 | byte(blue) << 16 | alpha << 24;
  }
}

// The same of pixels that show nothing but a sky of one light, whose codes are told.
FOREST_CLONES void show_sky(const Exposed& e, std::int32_t red, std::int32_t green, std::int32_t blue,
                            std::uint32_t* __restrict shown) {
  for (std::size_t i = 0; i < e.pixels; ++i) {
    const auto noise = std::int32_t(whole_code * noise_at(e.x + std::int32_t(i), e.y, e.subframe));
    shown[i] = std::uint32_t(byte_of(red + noise)) | std::uint32_t(byte_of(green + noise)) << 8 |
               std::uint32_t(byte_of(blue + noise)) << 16;
  }
}

// Which pixels have nothing at any sample that is wanted.
template <int S>
[[gnu::always_inline]] inline void find_empty_of(const std::uint32_t* keys, std::size_t pixels,
                                                 const std::uint32_t* ignored, std::uint8_t* empty) {
  for (std::size_t x = 0; x < pixels; ++x, keys += S) {
    std::uint32_t all = FOREST_KEY_EMPTY;
    FOREST_LANES
    for (int k = 0; k < S; ++k) all &= keys[k] | ignored[k];
    empty[x] = all == FOREST_KEY_EMPTY;
  }
}
FOREST_CLONES void find_empty(int samples, const std::uint32_t* keys, std::size_t pixels,
                              const std::uint32_t* ignored, std::uint8_t* empty) {
  if (samples == 1)
    find_empty_of<1>(keys, pixels, ignored, empty);
  else if (samples == 4)
    find_empty_of<4>(keys, pixels, ignored, empty);
  else
    find_empty_of<16>(keys, pixels, ignored, empty);
}

// What rims compare of a key: the upper 16 bits, of which 2,700 are an octave.
using Far = std::uint16_t;
FOREST_CLONES void fars_of(const std::uint32_t* __restrict keys, std::size_t count, Far* __restrict fars) {
  for (std::size_t i = 0; i < count; ++i) fars[i] = Far(keys[i] >> 16);
}

constexpr Far full_rim = 68;  // a fortieth of an octave before its neighbour
[[gnu::always_inline]] inline Far nearer(Far far, Far other) {
  const Far by = Far((far > other ? far : other) - other);
  return by < full_rim ? by : full_rim;
}

// Of samples that follow one another: how much light each keeps, and how much fog lies before it.
struct Shading {
  const Far* rows[5];  // of the rows around
  const std::uint32_t* keys;
  std::ptrdiff_t pixel;  // samples
  float halo, fog_start, fog_length;
};

// How far its neighbours lie before each sample.
FOREST_CLONES void find_rims(const Shading& s, std::size_t begin, std::size_t end, Far* __restrict rims) {
  const Far *up2 = s.rows[0], *up = s.rows[1], *here = s.rows[2], *down = s.rows[3], *down2 = s.rows[4];
  const std::ptrdiff_t p = s.pixel, p2 = 2 * p;
  for (std::size_t i = begin; i < end; ++i) {
    const Far far = here[i];
    Far rim = nearer(far, *(here + i + p));
    rim = Far(rim + nearer(far, *(here + i - p)));
    rim = Far(rim + nearer(far, down[i]));
    rim = Far(rim + nearer(far, up[i]));
    rim = Far(rim + nearer(far, *(down2 + i + p2)));
    rim = Far(rim + nearer(far, *(down2 + i - p2)));
    rim = Far(rim + nearer(far, *(up2 + i + p2)));
    rim = Far(rim + nearer(far, *(up2 + i - p2)));
    rims[i] = rim;
  }
}

FOREST_CLONES void shade(const Shading& s, std::size_t begin, std::size_t end, const Far* __restrict rims,
                         float* __restrict lit, float* __restrict fog) {
  const float strength = -1.1f * s.halo / (8.f * float(full_rim)) * 1.44269504f,
              per_length = -1.44269504f / s.fog_length, fog_start = s.fog_start;
  for (std::size_t i = begin; i < end; ++i) {
    const float light = float(std::int32_t(s.keys[i] & 31)) * (1.f / 31.f);
    const float octave =
        float(std::int32_t(s.keys[i] >> 12)) * (1.f / float(FOREST_DEPTH_STEPS)) - float(FOREST_DEPTH_BASE);
    lit[i] = (.16f + 1.05f * light * light) * roughly_exp2_of(strength * float(std::int32_t(rims[i])));
    fog[i] =
        1.f - roughly_exp2_of(larger(larger(0.f, roughly_exp2_of(octave) - fog_start) * per_length, -126.f));
  }
}

using Channels = std::array<std::array<float, 128>, 3>;  // of the palette

[[gnu::always_inline]] inline std::int32_t fixed(float light) {
  return std::int32_t(smaller(light, brightest) * unit + .5f);
}

// The sums of a pixel's samples.
template <int S>
[[gnu::always_inline]] inline void sum_samples(const std::uint32_t* keys, std::uint32_t wanted,
                                               const float* lit, const float* fog, const Channels& palette,
                                               const Vec3& mist, const Vec3& sky, std::int32_t (&sums)[4]) {
  std::int32_t covered[S];
  std::uint32_t entry[S];
  FOREST_LANES
  for (int k = 0; k < S; ++k) {
    covered[k] = keys[k] != FOREST_KEY_EMPTY;
    entry[k] = keys[k] >> 5 & 127;
  }
  std::int32_t mask[S];
  FOREST_LANES
  for (int k = 0; k < S; ++k) mask[k] = wanted >> k & 1 ? -1 : 0;
  for (int i = 0; i < 3; ++i) {
    const float* of = palette[std::size_t(i)].data();
    const float mist_i = mist[i], sky_i = sky[i];
    std::int32_t sum = 0;
    FOREST_LANES
    for (int k = 0; k < S; ++k) {
      const float base = of[entry[k]] * lit[k];
      const float colour = covered[k] ? base + fog[k] * (mist_i - base) : sky_i;
      sum += fixed(colour) & mask[k];
    }
    sums[i] = sum;
  }
  std::int32_t sum = 0;
  FOREST_LANES
  for (int k = 0; k < S; ++k) sum += covered[k] & mask[k];
  sums[3] = sum;
}

struct Row {
  std::size_t pixels;
  const std::uint32_t* keys;
  const float *lit, *fog;
  Planes sums;
};

template <int S>
[[gnu::always_inline]] inline void set_row(const Row& row, std::uint32_t wanted, const Channels& palette,
                                           const Vec3& mist, const Vec3& sky) {
  std::int32_t* __restrict red = row.sums[0], * __restrict green = row.sums[1], * __restrict blue = row.sums[2], * __restrict coverage = row.sums[3];
  for (std::size_t x = 0; x < row.pixels; ++x) {
    std::int32_t sums[4];
    sum_samples<S>(row.keys + x * S, wanted, row.lit + x * S, row.fog + x * S, palette, mist, sky, sums);
    red[x] = sums[0], green[x] = sums[1], blue[x] = sums[2], coverage[x] = sums[3];
  }
}

// Of one sample each: a channel after the other, pixels beside one another.
FOREST_CLONES void set_1(const Row& row, std::uint32_t, const Channels& palette, const Vec3& mist,
                         const Vec3& sky) {
  const std::uint32_t* keys = row.keys;
  const float *lit = row.lit, *fog = row.fog;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::int32_t* __restrict sums = row.sums[channel];
    const float* of = palette[channel].data();
    const float mist_i = mist[Eigen::Index(channel)], sky_i = sky[Eigen::Index(channel)];
    for (std::size_t x = 0; x < row.pixels; ++x) {
      const float base = of[keys[x] >> 5 & 127] * lit[x], seen = base + fog[x] * (mist_i - base);
      sums[x] = fixed(keys[x] != FOREST_KEY_EMPTY ? seen : sky_i);
    }
  }
  std::int32_t* __restrict coverage = row.sums[3];
  for (std::size_t x = 0; x < row.pixels; ++x) coverage[x] = keys[x] != FOREST_KEY_EMPTY;
}
FOREST_CLONES void set_4(const Row& row, std::uint32_t wanted, const Channels& palette, const Vec3& mist,
                         const Vec3& sky) {
  set_row<4>(row, wanted, palette, mist, sky);
}
FOREST_CLONES void set_16(const Row& row, std::uint32_t wanted, const Channels& palette, const Vec3& mist,
                          const Vec3& sky) {
  set_row<16>(row, wanted, palette, mist, sky);
}

// Adds to a pixel's sums what glass before its samples changes, sample by sample.
void tint(const frame::Constants& c, const std::uint32_t* keys, std::uint32_t wanted, int samples,
          std::int32_t x, std::int32_t y, const float* lit, const float* fog, const Channels& palette,
          const Vec3& mist, const Vec3& sky, const Planes& sums, std::size_t pixel) {
  const Vec3 glass(c.glass_red, c.glass_green, c.glass_blue);
  FOREST_LANES
  for (int k = 0; k < samples; ++k) {
    if (!(wanted >> k & 1)) continue;
    const Vec2 place = frame::sample_place(c.subframe + std::uint32_t(k), c.subframes);
    const bool empty = keys[k] == FOREST_KEY_EMPTY;
    const float z = frame::glass_depth(c, float(x) + .5f - place.x(), float(y) + .5f - place.y());
    if (!(empty ? std::isfinite(z) : z < frame::depth_of_code(keys[k] >> 12))) continue;
    for (int i = 0; i < 3; ++i) {
      const float base = palette[std::size_t(i)][keys[k] >> 5 & 127] * lit[k];
      const float colour = empty ? sky[i] : base + fog[k] * (mist[i] - base);
      sums[std::size_t(i)][pixel] += fixed(colour + c.glass_opacity * (glass[i] - colour)) - fixed(colour);
    }
  }
}

// What a block of pixels is worked out in; each thread keeps its own from picture to picture.
struct Scratch {
  std::vector<Far> fars, rims;
  std::vector<float> lit, fog;
  std::vector<std::uint32_t> keys, shown;
  std::vector<std::int32_t> row_sums;
  std::vector<std::uint8_t> empty;
};

}  // namespace

void resolve(const Canvas& canvas, const Picture& picture, const frame::Palette& palette,
             const frame::Area& area, std::uint32_t so_far, bool last, Sums& sums, frame::Image& image) {
  const frame::Constants& c = picture.constants;
  const std::int32_t width = canvas.width(), height = canvas.height(), samples = canvas.samples();
  const std::uint32_t wanted = canvas.wanted();
  const bool first = so_far <= std::uint32_t(std::popcount(wanted)), at_once = so_far == c.subframes && first;
  if (!at_once) sums.resize(std::size_t(width) * std::size_t(height) * 4);
  image.width = c.width, image.height = c.height;
  image.pixels.resize(std::size_t(width) * std::size_t(height) * 4);
  const Vec3 top(c.top_red, c.top_green, c.top_blue), bottom(c.bottom_red, c.bottom_green, c.bottom_blue),
      mist(c.fog_red, c.fog_green, c.fog_blue);
  Channels channels{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t e = 0; e < palette.size(); ++e) channels[i][e] = palette[e][Eigen::Index(i)];
  const bool tinted = c.glass_opacity > 0.f;
  const float share = 1.f / float(so_far), exposure = c.exposure * share / unit;
  const std::uint32_t* table = codes().data();
  std::array<std::uint32_t, most_samples> ignored{};
  for (int k = 0; k < samples; ++k) ignored[std::size_t(k)] = wanted >> k & 1 ? 0u : ~0u;
  const std::int32_t left = std::int32_t(area.left), right = std::int32_t(area.right),
                     high = std::int32_t(area.bottom - area.top),
                     columns = std::max(row_at_once / samples, 64),
                     blocks_high = (high + rows_at_once - 1) / rows_at_once,
                     blocks_wide = (right - left + columns - 1) / columns;
  std::atomic<std::uint64_t> covered = 0;
  parallel_for(std::size_t(blocks_high) * std::size_t(blocks_wide), 1, [&](std::size_t block) {
    const std::int32_t begin_y = std::int32_t(area.top) + std::int32_t(block) / blocks_wide * rows_at_once,
                       end_y = std::min(std::int32_t(area.bottom), begin_y + rows_at_once),
                       begin_x = left + std::int32_t(block) % blocks_wide * columns,
                       end_x = std::min(right, begin_x + columns);
    const auto S = std::size_t(samples), pixels = std::size_t(end_x - begin_x),
               row_size = (pixels + 2 * beside) * S;
    thread_local Scratch scratch;
    auto& [fars, rims, lit, fog, keys, shown, row_sums, empty] = scratch;
    fars.resize((rows_at_once + 2 * beside) * row_size), keys.resize(fars.size());
    rims.resize(pixels * S), lit.resize(pixels * S), fog.resize(pixels * S);
    shown.resize(pixels), row_sums.resize(4 * pixels), empty.resize(pixels);
    // Rows and columns around the block; the picture's edges are repeated.
    const std::int32_t low = std::max(begin_x - beside, 0), up = std::min(end_x + beside, width);
    for (std::int32_t k = 0; k < end_y - begin_y + 2 * beside; ++k) {
      const std::int32_t y = std::clamp(begin_y + k - beside, 0, height - 1);
      std::uint32_t* row = &keys[std::size_t(k) * row_size];
      const auto at = [&](std::int32_t x) { return row + std::size_t(x - begin_x + beside) * S; };
      canvas.read_row(y, low, up, at(low));
      for (std::int32_t x = begin_x - beside; x < low; ++x) std::copy(at(low), at(low) + S, at(x));
      for (std::int32_t x = up; x < end_x + beside; ++x) std::copy(at(up - 1), at(up - 1) + S, at(x));
      fars_of(row, row_size, &fars[std::size_t(k) * row_size]);
    }
    std::uint64_t alpha = 0;
    for (std::int32_t y = begin_y; y < end_y; ++y) {
      const auto k = std::size_t(y - begin_y);
      const std::uint32_t* row_keys = &keys[(k + beside) * row_size + beside * S];
      Shading shading{{}, row_keys, samples, c.halo, c.fog_start, c.fog_length};
      for (std::size_t i = 0; i < 5; ++i) shading.rows[i] = &fars[(k + i) * row_size + beside * S];
      find_empty(samples, row_keys, pixels, ignored.data(), empty.data());
      const Vec3 sky = top + (float(y) + .5f) / float(height) * (bottom - top);
      std::int32_t sky_sum[4] = {};
      for (int i = 0; i < 3; ++i) sky_sum[i] = fixed(sky[i]) * std::popcount(wanted);
      std::int32_t sky_code[3];
      for (int i = 0; i < 3; ++i) sky_code[i] = encoded(table, float(sky_sum[i]) * exposure);
      const auto row_at = std::size_t(y) * std::size_t(width) + std::size_t(begin_x);
      // Runs of pixels in which something is drawn, and what lies between.
      for (std::size_t x = 0; x < pixels;) {
        const std::size_t from = x;
        const bool nothing = empty[x];
        std::size_t gap = 0;
        if (nothing)
          while (x < pixels && empty[x]) ++x;
        else
          for (; x < pixels && gap < 16; ++x) gap = empty[x] ? gap + 1 : 0;
        if (nothing && at_once && !tinted) {
          show_sky({x - from, begin_x + std::int32_t(from), y, so_far - 1, exposure, share}, sky_code[0],
                   sky_code[1], sky_code[2], shown.data());
          std::memcpy(&image.pixels[4 * (row_at + from)], shown.data(), 4 * (x - from));
          continue;
        }
        const std::size_t count = x - from;
        const Planes to{row_sums.data(), pixels};
        if (nothing && !tinted) {
          for (std::size_t i = 0; i < 4; ++i) std::fill_n(to[i], count, sky_sum[i]);
        } else {
          find_rims(shading, from * S, x * S, rims.data());
          shade(shading, from * S, x * S, rims.data(), lit.data(), fog.data());
          const Row row{count, row_keys + from * S, &lit[from * S], &fog[from * S], to};
          (samples == 1 ? set_1 : samples == 4 ? set_4 : set_16)(row, wanted, channels, mist, sky);
          for (std::size_t i = from; tinted && i < x; ++i)
            tint(c, row_keys + i * S, wanted, samples, begin_x + std::int32_t(i), y, &lit[i * S], &fog[i * S],
                 channels, mist, sky, to, i - from);
        }
        if (!at_once) {
          const Planes before{&sums[4 * std::size_t(y) * std::size_t(width) + std::size_t(begin_x) + from],
                              std::size_t(width)};
          for (std::size_t channel = 0; channel < 4; ++channel)
            for (std::size_t i = 0; i < count; ++i)
              to[channel][i] = before[channel][i] = (first ? 0 : before[channel][i]) + to[channel][i];
        }
        if (!last) continue;
        show({count, begin_x + std::int32_t(from), y, so_far - 1, exposure, share}, table, to, shown.data());
        std::memcpy(&image.pixels[4 * (row_at + from)], shown.data(), 4 * count);
        for (std::size_t i = 0; i < count; ++i) alpha += shown[i] >> 24;
      }
    }
    covered += alpha;
  });
  image.covered = double(covered) / 255. / double(std::max(1, high * (right - left)));
}

}  // namespace forest::render::cpu
