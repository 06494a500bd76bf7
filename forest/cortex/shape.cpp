// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"
#include "forest/cortex/minimise.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

// An element's places, as Hexahedron's control points: u fastest.
using Places = Eigen::Matrix<double, 3, 64>;

Places places_of(const Elements& elements, std::size_t element) {
  Places places;
  for (int d = 0; d < 4; ++d)
    for (int c = 0; c < 16; ++c)
      places.col(16 * d + c) = elements.curves[elements.elements[element][std::size_t(c)]][std::size_t(d)];
  return places;
}

// ---- Jacobians at samples³ places, and back ---------------------------------------------------------------------------------

// Samples lie evenly from 0 to 1 along each parameter: 5, or 9 where an element folds between these.
constexpr int cube(int samples) { return samples * samples * samples; }

// By the four places of a line, the place and the slope of the cubic through them at each sample.
template <int samples>
struct Weights {
  double value[samples][4], slope[samples][4];
};
template <int samples>
constexpr Weights<samples> weights() {
  Weights<samples> w{};
  for (int s = 0; s < samples; ++s)
    for (int m = 0; m < 4; ++m) {
      const double t = double(s) / (samples - 1);
      double under = 1., value = 1., slope = 0.;
      for (int n = 0; n < 4; ++n)
        if (n != m) under *= double(m - n) / 3., value *= t - double(n) / 3.;
      for (int n = 0; n < 4; ++n) {
        double rest = n == m ? 0. : 1.;
        for (int o = 0; o < 4; ++o)
          if (o != m && o != n) rest *= t - double(o) / 3.;
        slope += rest;
      }
      w.value[s][m] = value / under, w.slope[s][m] = slope / under;
    }
  return w;
}
template <int samples>
constexpr Weights<samples> by_place = weights<samples>();

// Which of the two along a parameter, for the slopes along an axis.
template <int samples>
constexpr const double (&rows(int axis, int of))[samples][4] {
  return axis == of ? by_place<samples>.slope : by_place<samples>.value;
}

// Nine numbers of every sample: columns of J (axis), coordinates in each; samples with w fastest, then v.
template <int samples>
using Nine = double[3][3][cube(samples)];
// Places of an element by coordinate; k (w) fastest, then j (v).
using Coordinates = double[3][64];

// The slopes at all samples, by tensor products.
template <int samples>
FOREST_CLONES void jacobians(const Coordinates& places, Nine<samples>& out) {
  constexpr int square = samples * samples;
  for (int one = 0; one < 3; ++one) {
    double along_u[2][samples][16];  // of slopes, and of values
    for (int s = 0; s < samples; ++s)
      for (int of = 0; of < 2; ++of) {
        const double* const u = of == 0 ? by_place<samples>.slope[s] : by_place<samples>.value[s];
        for (int line = 0; line < 16; ++line)
          along_u[of][s][line] = u[0] * places[one][line] + u[1] * places[one][16 + line] +
                                 u[2] * places[one][32 + line] + u[3] * places[one][48 + line];
      }
    for (int axis = 0; axis < 3; ++axis) {
      const auto &v = rows<samples>(axis, 1), &w = rows<samples>(axis, 2);
      const auto& lines = along_u[axis == 0 ? 0 : 1];
      double along_v[4][square];  // k, then u and v
      for (int s = 0; s < samples; ++s)
        for (int t = 0; t < samples; ++t)
          for (int k = 0; k < 4; ++k)
            along_v[k][samples * s + t] = v[t][0] * lines[s][k] + v[t][1] * lines[s][4 + k] +
                                          v[t][2] * lines[s][8 + k] + v[t][3] * lines[s][12 + k];
      for (int r = 0; r < samples; ++r)
        for (int p = 0; p < square; ++p)
          out[axis][one][square * r + p] = w[r][0] * along_v[0][p] + w[r][1] * along_v[1][p] +
                                           w[r][2] * along_v[2][p] + w[r][3] * along_v[3][p];
    }
  }
}

// The other way: adds to each place what the slopes at all samples ask of it.
template <int samples>
FOREST_CLONES void pull_back(const Nine<samples>& in, Coordinates& gradient) {
  constexpr int square = samples * samples;
  for (int one = 0; one < 3; ++one) {
    double along_u[2][samples][16] = {};
    for (int axis = 0; axis < 3; ++axis) {
      const auto &v = rows<samples>(axis, 1), &w = rows<samples>(axis, 2);
      double along_v[square][4];
      for (int k = 0; k < 4; ++k) {
        double sum[square] = {};
        for (int r = 0; r < samples; ++r)
          for (int p = 0; p < square; ++p) sum[p] += w[r][k] * in[axis][one][square * r + p];
        for (int p = 0; p < square; ++p) along_v[p][k] = sum[p];
      }
      auto& lines = along_u[axis == 0 ? 0 : 1];
      for (int s = 0; s < samples; ++s)
        for (int t = 0; t < samples; ++t)
          for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) lines[s][4 * j + k] += v[t][j] * along_v[samples * s + t][k];
    }
    for (int s = 0; s < samples; ++s)
      for (int i = 0; i < 4; ++i)
        for (int line = 0; line < 16; ++line)
          gradient[one][16 * i + line] += by_place<samples>.slope[s][i] * along_u[0][s][line] +
                                          by_place<samples>.value[s][i] * along_u[1][s][line];
  }
}

// det J, the product of the lengths of its columns, and these squared, each a little more so that none is nothing.
template <int samples>
struct Measures {
  double det[cube(samples)], lengths[cube(samples)], squares[3][cube(samples)];
};
template <int samples>
FOREST_CLONES void measure(const Nine<samples>& j, Measures<samples>& out) {
  constexpr double tiny = 5. * 5.;  // µm²
  for (int n = 0; n < cube(samples); ++n) {
    const double ux = j[0][0][n], uy = j[0][1][n], uz = j[0][2][n], vx = j[1][0][n], vy = j[1][1][n],
                 vz = j[1][2][n], wx = j[2][0][n], wy = j[2][1][n], wz = j[2][2][n];
    out.det[n] = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx);
    const double uu = ux * ux + uy * uy + uz * uz + tiny, vv = vx * vx + vy * vy + vz * vz + tiny,
                 ww = wx * wx + wy * wy + wz * wz + tiny;
    out.squares[0][n] = uu, out.squares[1][n] = vv, out.squares[2][n] = ww;
    out.lengths[n] = std::sqrt(uu * vv * ww);
  }
}

// What each sample lacks, lack² / χ(s), where χ(s) is s where that is well above 0 and never 0; and in place of J, the slope
// of that and of the volume by its columns. fold: how softly it begins to weigh that an element is nearly folded.
template <int samples>
FOREST_CLONES void lacks(const Measures<samples>& m, const double (&shares)[cube(samples)], double wanted,
                         double fold, double by_volume, Nine<samples>& j, double (&value)[cube(samples)]) {
  for (int n = 0; n < cube(samples); ++n) {
    const double scaled = m.det[n] / m.lengths[n], lack = wanted > scaled ? wanted - scaled : 0.;
    const double root = std::sqrt(scaled * scaled + fold * fold);
    const double size = scaled > 0. ? scaled : -scaled;
    const double chi = scaled > 0. ? .5 * (size + root) : .5 * fold * fold / (root + size);
    value[n] = lack * lack / chi;
    const double fall = (2. * lack + lack * lack / root) / chi;  // χ' = χ / root
    const double by_det = by_volume * shares[n] - fall / m.lengths[n];
    const double ux = j[0][0][n], uy = j[0][1][n], uz = j[0][2][n], vx = j[1][0][n], vy = j[1][1][n],
                 vz = j[1][2][n], wx = j[2][0][n], wy = j[2][1][n], wz = j[2][2][n];
    const double u = fall * scaled / m.squares[0][n], v = fall * scaled / m.squares[1][n],
                 w = fall * scaled / m.squares[2][n];
    j[0][0][n] = by_det * (vy * wz - vz * wy) + u * ux, j[0][1][n] = by_det * (vz * wx - vx * wz) + u * uy,
    j[0][2][n] = by_det * (vx * wy - vy * wx) + u * uz;
    j[1][0][n] = by_det * (wy * uz - wz * uy) + v * vx, j[1][1][n] = by_det * (wz * ux - wx * uz) + v * vy,
    j[1][2][n] = by_det * (wx * uy - wy * ux) + v * vz;
    j[2][0][n] = by_det * (uy * vz - uz * vy) + w * wx, j[2][1][n] = by_det * (uz * vx - ux * vz) + w * wy,
    j[2][2][n] = by_det * (ux * vy - uy * vx) + w * wz;
  }
}

// Of the volume, what det J at a sample counts (Boole's rule along each parameter).
template <int samples>
struct Shares {
  double of[cube(samples)];
};
template <int samples>
constexpr Shares<samples> shares() {
  constexpr double boole[] = {14. / 90., 32. / 90., 12. / 90., 32. / 90.};  // and the first one again
  constexpr int parts = (samples - 1) / 4;
  const auto along = [&](int i) {
    return boole[i % 4] / (i == 0 || i == samples - 1 ? 2. * parts : double(parts));
  };
  Shares<samples> result{};
  for (int n = 0; n < cube(samples); ++n)
    result.of[n] = along(n % samples) * along(n / samples % samples) * along(n / samples / samples);
  return result;
}
template <int samples>
constexpr Shares<samples> by_sample = shares<samples>();

// Of an element: what it lacks, the gradient of that by its places, its least scaled Jacobian, and its volume.
struct Lack {
  double value = 0., least = 1., volume = 0.;
  Places gradient;
};

template <int samples>
class Gauge {
 public:
  void look(const Places& places, Lack& result) {
    Coordinates by_coordinate;
    for (int c = 0; c < 64; ++c)
      for (int one = 0; one < 3; ++one) by_coordinate[one][turned(c)] = places(one, c);
    jacobians<samples>(by_coordinate, j_);
    measure<samples>(j_, m_);
    result.least = 1., result.volume = 0.;
    for (int n = 0; n < cube(samples); ++n) {
      result.least = std::min(result.least, m_.det[n] / m_.lengths[n]);
      result.volume += by_sample<samples>.of[n] * m_.det[n];
    }
  }
  void weigh(const Places& places, const Shaping& shaping, double fold, Lack& result) {
    look(places, result);
    const double ratio = result.volume / shaping.volume;
    const double off = std::max(0., ratio - shaping.most) - std::max(0., shaping.least - ratio);
    result.value = 0.;
    if (off == 0. && result.least >= shaping.wanted) return;
    double values[cube(samples)];
    lacks<samples>(m_, by_sample<samples>.of, shaping.wanted, fold, 2. * shaping.even * off / shaping.volume,
                   j_, values);
    result.value = shaping.even * off * off;
    for (const double v : values) result.value += v;
    Coordinates gradient{};
    pull_back<samples>(j_, gradient);
    for (int c = 0; c < 64; ++c)
      for (int one = 0; one < 3; ++one) result.gradient(one, c) = gradient[one][turned(c)];
  }

 private:
  // u fastest as w fastest.
  static constexpr int turned(int c) { return 16 * (c % 4) + 4 * (c / 4 % 4) + c / 16; }

  Nine<samples> j_;
  Measures<samples> m_;
};

template <int samples>
double least(const Places& places, double* volume = nullptr) {
  Lack lack;
  Gauge<samples>().look(places, lack);
  if (volume) *volume = lack.volume;
  return lack.least;
}

// What holds a place: (p − at)ᵀ hold (p − at).
struct Anchor {
  Place at = Place::Zero();
  Matrix<3> hold = Matrix<3>::Zero();
};

using List = std::vector<std::uint32_t>;

constexpr double farthest_way = 1000.;  // µm, that a place may move at once: not to another bank
constexpr int few = 5, many = 9;        // samples
constexpr double very_bad = .6;         // so much of a good enough scaled Jacobian

// What is shaped at once: badly shaped elements that touch one another, all whose curves may move, and all that see these.
struct Patch {
  List curves, seen;
};

// Patches in turns: those of one turn do not see one another's curves.
std::vector<std::vector<Patch>> patches(const Elements& elements, const Stars& stars,
                                        std::vector<std::uint8_t> bad, std::size_t most) {
  std::vector<std::vector<Patch>> turns;
  std::vector<std::vector<std::uint8_t>> taken;  // of each turn, every element: some patch sees it
  List own;
  for (std::uint32_t first = 0; first < elements.size(); ++first) {
    if (!bad[first]) continue;
    own.assign(1, first), bad[first] = 0;
    Patch patch;
    for (std::size_t i = 0; i < own.size(); ++i)
      for (const std::uint32_t c : elements.elements[own[i]]) {
        patch.curves.push_back(c);
        for (const std::uint32_t e : stars.of(c))
          if (bad[e] && own.size() < most) bad[e] = 0, own.push_back(e);
      }
    std::sort(patch.curves.begin(), patch.curves.end());
    patch.curves.erase(std::unique(patch.curves.begin(), patch.curves.end()), patch.curves.end());
    for (const std::uint32_t c : patch.curves)
      for (const std::uint32_t e : stars.of(c)) patch.seen.push_back(e);
    std::sort(patch.seen.begin(), patch.seen.end());
    patch.seen.erase(std::unique(patch.seen.begin(), patch.seen.end()), patch.seen.end());
    std::size_t turn = 0;
    while (turn < turns.size() &&
           std::ranges::any_of(patch.seen, [&](std::uint32_t e) { return taken[turn][e] != 0; }))
      ++turn;
    if (turn == turns.size()) turns.emplace_back(), taken.emplace_back(elements.size(), 0);
    for (const std::uint32_t e : patch.seen) taken[turn][e] = 1;
    turns[turn].push_back(std::move(patch));
  }
  return turns;
}

// One patch while it is shaped.
class Work {
 public:
  using Anchors = std::vector<std::array<Anchor, 4>>;  // of every moving curve

  Work(Elements& elements, const Patch& patch, const Shaping& shaping, Anchors anchors)
      : elements_(elements), patch_(patch), shaping_(shaping), anchors_(std::move(anchors)) {
    before_.resize(Eigen::Index(12 * patch.curves.size()));
    for (std::size_t i = 0; i < patch.curves.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d)
        before_.segment<3>(Eigen::Index(12 * i + 3 * d)) = elements.curves[patch.curves[i]][d];
    for (const std::uint32_t e : patch.seen) {
      const bool valid = proven(e);
      Seen own{e, places_of(elements, e), {}, valid, shaping.finely || !valid, true};
      own.whole = least_of(own) > 0.;
      for (std::size_t c = 0; c < 16; ++c) {
        const auto at = std::ranges::lower_bound(patch.curves, elements.elements[e][c]);
        own.moving[c] =
            at != patch.curves.end() && *at == elements.elements[e][c] ? int(at - patch.curves.begin()) : -1;
      }
      seen_.push_back(own);
    }
  }

  void run() {
    // Where something is folded also softly at first, since the way out is steep; what leaves fewer that are not valid is taken.
    constexpr std::array schedules{std::array{.02, .02, .02}, std::array{1., .1, .02}};
    const bool straight = std::ranges::all_of(seen_, &Seen::valid);
    bool closer = true;
    Vector best;
    while (closer) {
      std::pair least{seen_.size() + 1, 0.};  // not valid, and what is lacking
      for (const auto& schedule : schedules) {
        Vector trial = before_;
        double value = 0.;
        for (std::size_t i = straight ? schedule.size() - 1 : 0; i < schedule.size(); ++i) {
          fold_ = schedule[i];
          value = minimise(
              trial, shaping_.iterations, .01,
              [&](const Vector& at, Vector& gradient) { return lack(at, gradient); }, shaping_.gain);
        }
        put(trial);
        const std::pair now{
            std::size_t(std::ranges::count_if(seen_, [&](const Seen& s) { return !proven(s.element); })),
            value};
        if (now < least) least = now, best = trial;
        if (least.first == 0) return;
      }
      // What was proven to be valid stays so. What did not is looked at in more places, and all is tried again.
      put(best);
      closer = false;
      for (Seen& s : seen_)
        if (s.valid && !s.finely && !proven(s.element)) s.finely = closer = true;
    }
    // In the end the patch goes half of its way, a quarter, … or stays.
    for (double share = .5; lost(); share *= .5) {
      if (share < .1) return put(before_);
      put(before_ + share * (best - before_));
    }
  }

 private:
  struct Seen {  // an element that sees the patch
    std::uint32_t element;
    Places places;
    std::array<int, 16> moving;  // for each of its curves which of the moving ones it is, or -1
    bool valid;                  // proven to be, at first
    bool finely;                 // it may fold where few samples do not see it
    bool whole;                  // folded at no sample, which must stay so
  };

  bool proven(std::uint32_t element) const { return certify(elements_.hexahedron(element)).positive(); }
  bool lost() const {
    return std::ranges::any_of(seen_, [&](const Seen& s) { return s.valid && !proven(s.element); });
  }
  double least_of(const Seen& s) const { return s.finely ? least<many>(s.places) : least<few>(s.places); }

  void put(const Vector& at) {
    for (std::size_t i = 0; i < patch_.curves.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d)
        elements_.curves[patch_.curves[i]][d] = at.segment<3>(Eigen::Index(12 * i + 3 * d));
  }

  // What is minimised: what all elements lack and how far places are from where they are held. Infinite where an element folds.
  double lack(const Vector& at, Vector& gradient) {
    gradient.setZero(at.size());
    double value = 0.;
    Lack lack;
    for (Seen& s : seen_) {
      const auto each = [&](auto&& visit) {
        for (int c = 0; c < 16; ++c)
          for (int d = 0; d < 4 && s.moving[std::size_t(c)] >= 0; ++d)
            visit(16 * d + c, 12 * s.moving[std::size_t(c)] + 3 * d);
      };
      each([&](int column, int k) { s.places.col(column) = at.segment<3>(k); });
      s.finely ? fine_.weigh(s.places, shaping_, fold_, lack)
               : coarse_.weigh(s.places, shaping_, fold_, lack);
      if (s.whole && lack.least <= 0.) return std::numeric_limits<double>::infinity();
      if (lack.value == 0.) continue;
      value += lack.value;
      each([&](int column, int k) { gradient.segment<3>(k) += lack.gradient.col(column); });
    }
    for (std::size_t i = 0; i < anchors_.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d) {
        const auto k = Eigen::Index(12 * i + 3 * d);
        const Place off = at.segment<3>(k) - anchors_[i][d].at, pull = anchors_[i][d].hold * off;
        if ((at.segment<3>(k) - before_.segment<3>(k)).squaredNorm() > farthest_way * farthest_way)
          return std::numeric_limits<double>::infinity();
        value += off.dot(pull);
        gradient.segment<3>(k) += 2. * pull;
      }
    return value;
  }

  Elements& elements_;
  const Patch& patch_;
  const Shaping& shaping_;
  Anchors anchors_;
  Vector before_;
  std::vector<Seen> seen_;
  double fold_ = 0.;
  Gauge<few> coarse_;
  Gauge<many> fine_;
};

class Shaper {
 public:
  Shaper(Elements& elements, const TriangleTree& outer, const TriangleTree& inner, const Shaping& shaping)
      : elements_(elements), outer_(outer), inner_(inner), shaping_(shaping) {}

  void operator()(const Patch& patch) const {
    List worst;  // curves
    for (const std::uint32_t e : patch.seen)
      if (least<few>(places_of(elements_, e)) < very_bad * shaping_.enough)
        worst.insert(worst.end(), elements_.elements[e].begin(), elements_.elements[e].end());
    worst = distinct(std::move(worst));
    Work::Anchors anchors(patch.curves.size());
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      const bool gives = std::ranges::binary_search(worst, patch.curves[i]);
      for (std::size_t d = 0; d < 4; ++d)
        anchors[i][d] =
            anchor(elements_.curves[patch.curves[i]], d, gives ? shaping_.worst_off : shaping_.off);
    }
    Work(elements_, patch, shaping_, std::move(anchors)).run();
  }

 private:
  Anchor anchor(const Depths& curve, std::size_t d, double give) const {
    constexpr double reach = 500.;  // µm
    const double small = .01 / (shaping_.along * shaping_.along), strong = .01 / (give * give);
    Anchor result{curve[d], small * Matrix<3>::Identity()};
    if (d == 1 || d == 2) return result;
    const TriangleTree& surface = d == 0 ? outer_ : inner_;
    const auto hit = surface.nearest(curve[d], reach);
    if (!hit) return result;
    const Place n = surface.normal(hit->triangle);
    if (n.dot(curve[0] - curve[3]) <= 0.) return result;  // the other bank
    result.at += n * n.dot(hit->at - curve[d]);
    result.hold += strong * n * n.transpose();
    return result;
  }

  Elements& elements_;
  const TriangleTree &outer_, &inner_;
  const Shaping& shaping_;
};

}  // namespace

void improve_shapes(Elements& elements, const TriangleTree& outer, const TriangleTree& inner,
                    const Shaping& shaping, Progress& progress, std::span<const std::uint32_t> among) {
  const Stars stars(elements);
  const Shaper shape(elements, outer, inner, shaping);
  for (int round = 0; round < shaping.rounds; ++round) {
    std::vector<std::uint8_t> bad(elements.size(), 0), worst(elements.size(), 0);
    parallel_for(among.empty() ? elements.size() : among.size(), 256, [&](std::size_t i) {
      const std::size_t e = among.empty() ? i : among[i];
      const Places places = places_of(elements, e);
      double volume = 0.;
      const double scaled = least<few>(places, &volume);
      bad[e] = scaled < shaping.enough || !certify(elements.hexahedron(e)).positive() ||
               volume < (shaping.least - .05) * shaping.volume ||
               volume > (shaping.most + .05) * shaping.volume;
      worst[e] = scaled < very_bad * shaping.enough;
    });
    List moving;  // the worst need room: what is around moves, too
    for (std::uint32_t e = 0; e < elements.size(); ++e)
      if (worst[e]) moving.push_back(e);
    for (const std::uint32_t e : widened(elements, stars, moving, shaping.room)) bad[e] = 1;
    const auto turns = patches(elements, stars, std::move(bad), std::size_t(shaping.patch));
    std::size_t count = 0;
    for (const auto& turn : turns) count += turn.size();
    progress.begin("shaping elements", count);
    for (const auto& turn : turns)
      parallel_for(turn.size(), 1, [&](std::size_t i) {
        shape(turn[i]);
        progress.advance();
      });
    progress.end();
  }
}

}  // namespace forest::cortex
