// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/gauge.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

#define FOREST_INLINE [[gnu::always_inline]] inline

using Places = Lanes[3][64];

FOREST_INLINE void root(Lanes& x) {
  float each[lanes];
  std::memcpy(each, &x, sizeof x);
  for (float& one : each) one = std::sqrt(one);
  std::memcpy(&x, each, sizeof x);
}

// By the four places of a line, the place and the slope of the cubic through them at each sample; and of the volume, what det J there
// counts (Boole's rule), and how far it is from the middle.
template <int samples>
struct Line {
  float value[samples][4], slope[samples][4], share[samples], lever[samples];
};
template <int samples>
constexpr Line<samples> make_line() {
  Line<samples> line{};
  constexpr double boole[] = {14. / 90., 32. / 90., 12. / 90., 32. / 90.};  // and the first one again
  for (int s = 0; s < samples; ++s) {
    constexpr int parts = (samples - 1) / 4;
    line.share[s] = float(boole[s % 4] / (s == 0 || s == samples - 1 ? 2. * parts : double(parts)));
    const double t = double(s) / (samples - 1);
    line.lever[s] = float(1. - 2. * t);
    for (int m = 0; m < 4; ++m) {
      double under = 1., value = 1., slope = 0.;
      for (int n = 0; n < 4; ++n)
        if (n != m) under *= double(m - n) / 3., value *= t - double(n) / 3.;
      for (int n = 0; n < 4; ++n) {
        double rest = n == m ? 0. : 1.;
        for (int o = 0; o < 4; ++o)
          if (o != m && o != n) rest *= t - double(o) / 3.;
        slope += rest;
      }
      line.value[s][m] = float(value / under), line.slope[s][m] = float(slope / under);
    }
  }
  return line;
}
template <int samples>
constexpr Line<samples> line = make_line<samples>();

// Values and slopes along w at each of its samples, of all sixteen lines of places.
template <int samples>
struct AlongW {
  Lanes value[3][samples][16], slope[3][samples][16];
};

template <int samples>
FOREST_INLINE void go_along_w(const Places& places, AlongW<samples>& out) {
  constexpr const Line<samples>& w = line<samples>;
  for (int one = 0; one < 3; ++one)
    for (int s = 0; s < samples; ++s)
      for (int p = 0; p < 16; ++p) {
        const Lanes &a = places[one][p], &b = places[one][16 + p], &c = places[one][32 + p],
                    &d = places[one][48 + p];
        out.value[one][s][p] = w.value[s][0] * a + w.value[s][1] * b + w.value[s][2] * c + w.value[s][3] * d;
        out.slope[one][s][p] = w.slope[s][0] * a + w.slope[s][1] * b + w.slope[s][2] * c + w.slope[s][3] * d;
      }
}

// The columns of J, for u, v and w, by coordinate, at all samples along u.
template <int samples>
using Row = Lanes[3][3][samples];

template <int samples>
FOREST_INLINE void go_along_u(const AlongW<samples>& along, int at_w, int at_v, Row<samples>& j) {
  constexpr const Line<samples>& by = line<samples>;
  const float *const value = by.value[at_v], *const slope = by.slope[at_v];
  for (int one = 0; one < 3; ++one) {
    const auto &values = along.value[one][at_w], &slopes = along.slope[one][at_w];
    Lanes place[4], by_v[4], by_w[4];
    for (int i = 0; i < 4; ++i) {
      place[i] = value[0] * values[i] + value[1] * values[4 + i] + value[2] * values[8 + i] +
                 value[3] * values[12 + i];
      by_v[i] = slope[0] * values[i] + slope[1] * values[4 + i] + slope[2] * values[8 + i] +
                slope[3] * values[12 + i];
      by_w[i] = value[0] * slopes[i] + value[1] * slopes[4 + i] + value[2] * slopes[8 + i] +
                value[3] * slopes[12 + i];
    }
    for (int s = 0; s < samples; ++s) {
      const float *const v = by.value[s], *const d = by.slope[s];
      j[0][one][s] = d[0] * place[0] + d[1] * place[1] + d[2] * place[2] + d[3] * place[3];
      j[1][one][s] = v[0] * by_v[0] + v[1] * by_v[1] + v[2] * by_v[2] + v[3] * by_v[3];
      j[2][one][s] = v[0] * by_w[0] + v[1] * by_w[1] + v[2] * by_w[2] + v[3] * by_w[3];
    }
  }
}

// The other way: what is asked of slopes at all samples along u is asked of places.
template <int samples>
FOREST_INLINE void back_along_u(const Row<samples>& j, int at_w, int at_v, AlongW<samples>& along) {
  constexpr const Line<samples>& by = line<samples>;
  const float *const value = by.value[at_v], *const slope = by.slope[at_v];
  for (int one = 0; one < 3; ++one) {
    Lanes place[4]{}, by_v[4]{}, by_w[4]{};
    for (int s = 0; s < samples; ++s)
      for (int i = 0; i < 4; ++i)
        place[i] += by.slope[s][i] * j[0][one][s], by_v[i] += by.value[s][i] * j[1][one][s],
            by_w[i] += by.value[s][i] * j[2][one][s];
    auto &values = along.value[one][at_w], &slopes = along.slope[one][at_w];
    for (int m = 0; m < 4; ++m)
      for (int i = 0; i < 4; ++i)
        values[4 * m + i] += value[m] * place[i] + slope[m] * by_v[i],
            slopes[4 * m + i] += value[m] * by_w[i];
  }
}

template <int samples>
FOREST_INLINE void back_along_w(const AlongW<samples>& along, Places& gradient) {
  constexpr const Line<samples>& w = line<samples>;
  for (int one = 0; one < 3; ++one)
    for (int k = 0; k < 4; ++k)
      for (int p = 0; p < 16; ++p) {
        Lanes sum{};
        for (int s = 0; s < samples; ++s)
          sum += w.value[s][k] * along.value[one][s][p] + w.slope[s][k] * along.slope[one][s][p];
        gradient[one][16 * k + p] = sum;
      }
}

constexpr float tiny = 5.f * 5.f;  // µm², added to the squares of lengths so that none is nothing

template <int samples>
FOREST_INLINE void look_by(const Places& places, Shape& shape) {
  AlongW<samples> along;
  go_along_w<samples>(places, along);
  Row<samples> j;
  Lanes least = Lanes{} + 1.f, volume{}, tilt{};
  for (int at_w = 0; at_w < samples; ++at_w)
    for (int at_v = 0; at_v < samples; ++at_v) {
      go_along_u<samples>(along, at_w, at_v, j);
      const float share = line<samples>.share[at_w] * line<samples>.share[at_v];
      for (int s = 0; s < samples; ++s) {
        const Lanes &ux = j[0][0][s], &uy = j[0][1][s], &uz = j[0][2][s], &vx = j[1][0][s], &vy = j[1][1][s],
                    &vz = j[1][2][s], &wx = j[2][0][s], &wy = j[2][1][s], &wz = j[2][2][s];
        const Lanes det = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx);
        Lanes lengths = (ux * ux + uy * uy + uz * uz + tiny) * (vx * vx + vy * vy + vz * vz + tiny) *
                        (wx * wx + wy * wy + wz * wz + tiny);
        root(lengths);
        const Lanes scaled = det / lengths;
        least = scaled < least ? scaled : least;
        const Lanes part = share * line<samples>.share[s] * det;
        volume += part, tilt += line<samples>.lever[at_w] * part;
      }
    }
  shape.least = least, shape.volume = volume, shape.tilt = tilt;
}

template <int samples>
FOREST_INLINE void weigh_by(const Places& places, const Wanted& wanted, const Counts& counts, Lack& lack) {
  AlongW<samples> along, back{};
  go_along_w<samples>(places, along);
  Row<samples> j;
  const float fold = wanted.fold * wanted.fold;
  Lanes value{};
  for (int at_w = 0; at_w < samples; ++at_w) {
    const Lanes by_part = counts.volume + line<samples>.lever[at_w] * counts.tilt;
    for (int at_v = 0; at_v < samples; ++at_v) {
      go_along_u<samples>(along, at_w, at_v, j);
      const float share = line<samples>.share[at_w] * line<samples>.share[at_v];
      for (int s = 0; s < samples; ++s) {
        const Lanes ux = j[0][0][s], uy = j[0][1][s], uz = j[0][2][s], vx = j[1][0][s], vy = j[1][1][s],
                    vz = j[1][2][s], wx = j[2][0][s], wy = j[2][1][s], wz = j[2][2][s];
        const Lanes by_ux = vy * wz - vz * wy, by_uy = vz * wx - vx * wz,
                    by_uz = vx * wy - vy * wx;  // of det J
        const Lanes uu = ux * ux + uy * uy + uz * uz + tiny, vv = vx * vx + vy * vy + vz * vz + tiny,
                    ww = wx * wx + wy * wy + wz * wz + tiny;
        Lanes lengths = uu * vv * ww;
        root(lengths);
        const Lanes by_lengths = 1.f / lengths, scaled = (ux * by_ux + uy * by_uy + uz * by_uz) * by_lengths;
        const Lanes short_of = scaled < wanted.scaled ? wanted.scaled - scaled : Lanes{};
        // χ(s) = (s + √(s² + fold²)) / 2, and its slope is χ / √(s² + fold²).
        Lanes soft = scaled * scaled + fold;
        root(soft);
        const Lanes sum = soft + (scaled > 0.f ? scaled : -scaled);
        const Lanes by_chi = scaled > 0.f ? 2.f / sum : (2.f / fold) * sum;
        value += short_of * short_of * by_chi;
        const Lanes fall = (2.f * short_of + short_of * short_of / soft) * by_chi;
        const Lanes by_det = by_part * (share * line<samples>.share[s]) - fall * by_lengths,
                    by_square = fall * scaled * by_lengths * by_lengths;
        const Lanes u = by_square * vv * ww, v = by_square * uu * ww, w = by_square * uu * vv;
        j[0][0][s] = by_det * by_ux + u * ux, j[0][1][s] = by_det * by_uy + u * uy,
        j[0][2][s] = by_det * by_uz + u * uz;
        j[1][0][s] = by_det * (wy * uz - wz * uy) + v * vx,
        j[1][1][s] = by_det * (wz * ux - wx * uz) + v * vy,
        j[1][2][s] = by_det * (wx * uy - wy * ux) + v * vz;
        j[2][0][s] = by_det * (uy * vz - uz * vy) + w * wx,
        j[2][1][s] = by_det * (uz * vx - ux * vz) + w * wy,
        j[2][2][s] = by_det * (ux * vy - uy * vx) + w * wz;
      }
      back_along_u<samples>(j, at_w, at_v, back);
    }
  }
  lack.value = value;
  back_along_w<samples>(back, lack.gradient);
}

FOREST_CLONES void look_few(const Places& places, Shape& shape) { look_by<5>(places, shape); }
FOREST_CLONES void look_many(const Places& places, Shape& shape) { look_by<9>(places, shape); }
FOREST_CLONES void weigh_few(const Places& places, const Wanted& wanted, const Counts& counts, Lack& lack) {
  weigh_by<5>(places, wanted, counts, lack);
}
FOREST_CLONES void weigh_many(const Places& places, const Wanted& wanted, const Counts& counts, Lack& lack) {
  weigh_by<9>(places, wanted, counts, lack);
}

}  // namespace

Batch batch_of(const Elements& elements, std::span<const std::uint32_t> list) {
  Batch batch;
  for (std::size_t lane = 0; lane < std::size_t(lanes); ++lane) {
    const auto& curves = elements.elements[list[std::min(lane, list.size() - 1)]];
    Batch::Places places;
    for (std::size_t d = 0; d < 4; ++d)
      for (std::size_t c = 0; c < 16; ++c)
        places.col(Eigen::Index(16 * d + c)) = elements.curves[curves[c]][d];
    batch.set(int(lane), places);
  }
  return batch;
}

Looks look(const Elements& elements, std::span<const std::uint32_t> of) {
  Looks looks{std::vector<float>(of.size()), std::vector<float>(of.size()), std::vector<float>(of.size())};
  constexpr std::size_t at_once = lanes, grain = 32;
  parallel_for((of.size() + at_once - 1) / at_once, grain, [&](std::size_t i) {
    const auto list = of.subspan(at_once * i);
    const Shape shape = look(batch_of(elements, list), Samples::few);
    for (std::size_t lane = 0; lane < std::min(at_once, list.size()); ++lane) {
      looks.least[at_once * i + lane] = shape.least[lane];
      looks.volume[at_once * i + lane] = shape.volume[lane];
      looks.tilt[at_once * i + lane] = shape.tilt[lane];
    }
  });
  return looks;
}

Looks look(const Elements& elements) {
  std::vector<std::uint32_t> all(elements.size());
  std::iota(all.begin(), all.end(), 0u);
  return look(elements, all);
}

Shape look(const Batch& batch, Samples samples) {
  Shape shape;
  (samples == Samples::few ? look_few : look_many)(batch.at(), shape);
  return shape;
}

void weigh(const Batch& batch, Samples samples, const Wanted& wanted, const Counts& counts, Lack& lack) {
  (samples == Samples::few ? weigh_few : weigh_many)(batch.at(), wanted, counts, lack);
}

}  // namespace forest::cortex
