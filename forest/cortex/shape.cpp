// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "forest/core/parallel.h"
#include "forest/cortex/minimise.h"

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

constexpr int samples = 5;  // along each parameter, evenly from 0 to 1
constexpr int all = samples * samples * samples;

// By the four places of a line, the place and the slope of the cubic through them at each sample.
struct Weights {
  double value[samples][4], slope[samples][4];
};
constexpr Weights weights() {
  Weights w{};
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
constexpr Weights by_place = weights();

using Rows = const double (&)[samples][4];
constexpr Rows rows(int axis, int of) { return axis == of ? by_place.slope : by_place.value; }

// The slopes along an axis at all samples, by tensor products; `one` of the three coordinates.
void slopes_at(const Places& places, int axis, int one, double (&out)[all]) {
  double along_u[16][samples], along_v[4][samples * samples];
  const Rows u = rows(0, axis), v = rows(1, axis), w = rows(2, axis);
  for (int line = 0; line < 16; ++line)
    for (int s = 0; s < samples; ++s)
      along_u[line][s] = u[s][0] * places(one, 4 * line) + u[s][1] * places(one, 4 * line + 1) +
                         u[s][2] * places(one, 4 * line + 2) + u[s][3] * places(one, 4 * line + 3);
  for (int k = 0; k < 4; ++k)
    for (int t = 0; t < samples; ++t)
      for (int s = 0; s < samples; ++s)
        along_v[k][samples * t + s] = v[t][0] * along_u[4 * k][s] + v[t][1] * along_u[4 * k + 1][s] +
                                      v[t][2] * along_u[4 * k + 2][s] + v[t][3] * along_u[4 * k + 3][s];
  for (int r = 0; r < samples; ++r)
    for (int p = 0; p < samples * samples; ++p)
      out[samples * samples * r + p] = w[r][0] * along_v[0][p] + w[r][1] * along_v[1][p] +
                                       w[r][2] * along_v[2][p] + w[r][3] * along_v[3][p];
}
// The other way: adds to each place what the slopes at all samples ask of it.
void pull_back(const double (&in)[all], int axis, int one, Places& gradient) {
  double along_u[16][samples] = {}, along_v[4][samples * samples] = {};
  const Rows u = rows(0, axis), v = rows(1, axis), w = rows(2, axis);
  for (int r = 0; r < samples; ++r)
    for (int k = 0; k < 4; ++k)
      for (int p = 0; p < samples * samples; ++p) along_v[k][p] += w[r][k] * in[samples * samples * r + p];
  for (int k = 0; k < 4; ++k)
    for (int t = 0; t < samples; ++t)
      for (int j = 0; j < 4; ++j)
        for (int s = 0; s < samples; ++s) along_u[4 * k + j][s] += v[t][j] * along_v[k][samples * t + s];
  for (int line = 0; line < 16; ++line)
    for (int s = 0; s < samples; ++s)
      for (int i = 0; i < 4; ++i) gradient(one, 4 * line + i) += u[s][i] * along_u[line][s];
}

struct Jacobians {
  double columns[3][3][all];  // axis, coordinate, sample

  explicit Jacobians(const Places& places) {
    for (int axis = 0; axis < 3; ++axis)
      for (int one = 0; one < 3; ++one) slopes_at(places, axis, one, columns[axis][one]);
  }
  Matrix<3> at(int sample) const {
    Matrix<3> j;
    for (int axis = 0; axis < 3; ++axis)
      for (int one = 0; one < 3; ++one) j(one, axis) = columns[axis][one][sample];
    return j;
  }
};

Place lengths_of(
    const Matrix<3>& j) {      // of the columns, a little longer than they are so that none is nothing
  constexpr double tiny = 5.;  // µm
  return (j.colwise().squaredNorm().array() + tiny * tiny).sqrt().transpose();
}

// Of the volume, what det J at a sample counts (Boole's rule along each parameter).
constexpr double share_of(int sample) {
  constexpr double boole[samples] = {7. / 90., 32. / 90., 12. / 90., 32. / 90., 7. / 90.};
  return boole[sample % samples] * boole[sample / samples % samples] * boole[sample / samples / samples];
}

double least(const Places& places, double* volume = nullptr) {
  const Jacobians jacobians(places);
  double result = 1.;
  for (int n = 0; n < all; ++n) {
    const Matrix<3> j = jacobians.at(n);
    const double det = j.determinant();
    if (volume) *volume += share_of(n) * det;
    result = std::min(result, det / lengths_of(j).prod());
  }
  return result;
}

// Of an element: what it lacks, the gradient of that by its places, and the least scaled Jacobian.
struct Lack {
  double value = 0., least = 1., volume = 0.;
  Places gradient;
};
// fold: how softly it begins to weigh that an element is nearly folded.
void lack_of(const Places& places, const Shaping& shaping, double fold, Lack& result) {
  const Jacobians jacobians(places);
  double by[3][3][all];
  result.value = 0., result.least = 1., result.volume = 0.;
  for (int n = 0; n < all; ++n) result.volume += share_of(n) * jacobians.at(n).determinant();
  const double ratio = result.volume / shaping.volume;
  const double off = std::max(0., ratio - shaping.most) - std::max(0., shaping.least - ratio);
  result.value += shaping.even * off * off;
  const double by_volume = 2. * shaping.even * off / shaping.volume;
  for (int n = 0; n < all; ++n) {
    const Matrix<3> j = jacobians.at(n);
    const Place lengths = lengths_of(j);
    const double scaled = j.determinant() / lengths.prod(), lack = std::max(0., shaping.wanted - scaled);
    result.least = std::min(result.least, scaled);
    // lack² / χ(s), where χ(s) is s where that is well above 0 and never 0.
    const double root = std::sqrt(scaled * scaled + fold * fold);
    const double chi = scaled > 0. ? .5 * (scaled + root) : .5 * fold * fold / (root - scaled);
    result.value += lack * lack / chi;
    const double fall = 2. * lack / chi + lack * lack / (chi * root);  // χ' = χ / root
    const Matrix<3> by_det = cofactors<3>(j);
    Matrix<3> slope = (by_volume * share_of(n) - fall / lengths.prod()) * by_det;
    for (int axis = 0; axis < 3; ++axis)
      slope.col(axis) += fall * scaled / (lengths[axis] * lengths[axis]) * j.col(axis);
    for (int axis = 0; axis < 3; ++axis)
      for (int one = 0; one < 3; ++one) by[axis][one][n] = slope(one, axis);
  }
  result.gradient.setZero();
  if (result.value == 0.) return;
  for (int axis = 0; axis < 3; ++axis)
    for (int one = 0; one < 3; ++one) pull_back(by[axis][one], axis, one, result.gradient);
}

// What holds a place: (p − at)ᵀ hold (p − at).
struct Anchor {
  Place at = Place::Zero();
  Matrix<3> hold = Matrix<3>::Zero();
};

using List = std::vector<std::uint32_t>;

// What is shaped at once: badly shaped elements that touch one another, all whose curves may move, and all that see these.
struct Patch {
  List curves, seen;
};

// The elements of every curve, as one list.
struct Stars {
  List starts, list;

  explicit Stars(const Elements& elements) : starts(elements.curves.size() + 1) {
    for (const auto& e : elements.elements)
      for (const std::uint32_t c : e) ++starts[c + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    list.resize(starts.back());
    List next(starts.begin(), starts.end() - 1);
    for (std::uint32_t e = 0; e < elements.size(); ++e)
      for (const std::uint32_t c : elements.elements[e]) list[next[c]++] = e;
  }
  std::span<const std::uint32_t> of(std::uint32_t curve) const {
    return std::span(list).subspan(starts[curve], starts[curve + 1] - starts[curve]);
  }
};

// Patches in turns: those of one turn do not see one another's curves.
std::vector<std::vector<Patch>> patches(const Elements& elements, const Stars& stars,
                                        std::vector<std::uint8_t> bad) {
  constexpr std::size_t most = 24;  // elements of a patch
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

class Shaper {
 public:
  Shaper(Elements& elements, const TriangleTree& outer, const TriangleTree& inner, const Shaping& shaping)
      : elements_(elements), outer_(outer), inner_(inner), shaping_(shaping) {}

  void operator()(const Patch& patch) const {
    const std::size_t n = patch.curves.size();
    std::vector<std::array<Anchor, 4>> anchors(n);
    Vector x(Eigen::Index(12 * n));
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t d = 0; d < 4; ++d) {
        anchors[i][d] = anchor(elements_.curves[patch.curves[i]], d);
        x.segment<3>(Eigen::Index(12 * i + 3 * d)) = elements_.curves[patch.curves[i]][d];
      }
    const Vector before = x;
    // Of every element: its places, and for each of its curves which of the moving ones it is.
    std::vector<Places> places;
    std::vector<std::array<int, 16>> moving;
    for (const std::uint32_t e : patch.seen) {
      places.push_back(places_of(elements_, e));
      auto& own = moving.emplace_back();
      for (std::size_t c = 0; c < 16; ++c) {
        const auto at = std::lower_bound(patch.curves.begin(), patch.curves.end(), elements_.elements[e][c]);
        own[c] =
            at != patch.curves.end() && *at == elements_.elements[e][c] ? int(at - patch.curves.begin()) : -1;
      }
    }
    std::vector<std::uint8_t> whole;  // elements that are not folded, and must stay so
    for (const Places& p : places) whole.push_back(least(p) > 0.);
    Lack lack;
    double fold = 0.;
    const auto sum = [&](const Vector& at, Vector& gradient) {
      gradient.setZero(at.size());
      double value = 0.;
      for (std::size_t e = 0; e < places.size(); ++e) {
        const auto each = [&](auto&& visit) {
          for (int c = 0; c < 16; ++c)
            for (int d = 0; d < 4 && moving[e][std::size_t(c)] >= 0; ++d)
              visit(16 * d + c, 12 * moving[e][std::size_t(c)] + 3 * d);
        };
        each([&](int column, int k) { places[e].col(column) = at.segment<3>(k); });
        lack_of(places[e], shaping_, fold, lack);
        if (whole[e] && lack.least <= 0.) return std::numeric_limits<double>::infinity();
        if (lack.value == 0.) continue;
        value += lack.value;
        each([&](int column, int k) { gradient.segment<3>(k) += lack.gradient.col(column); });
      }
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t d = 0; d < 4; ++d) {
          const auto k = Eigen::Index(12 * i + 3 * d);
          const Place off = at.segment<3>(k) - anchors[i][d].at, pull = anchors[i][d].hold * off;
          value += off.dot(pull);
          gradient.segment<3>(k) += 2. * pull;
        }
      return value;
    };
    // Where something is folded also softly at first, since the way out is steep; what comes out better is taken.
    constexpr std::array schedules{std::array{.02, .02, .02, .02}, std::array{1., .2, .06, .02}};
    const bool straight = std::ranges::all_of(whole, [](std::uint8_t w) { return w != 0; });
    double best = -std::numeric_limits<double>::infinity();
    for (const auto& schedule : schedules) {
      Vector trial = before, unused;
      for (std::size_t i = straight ? schedule.size() - 1 : 0; i < schedule.size(); ++i) {
        fold = schedule[i];
        minimise(trial, shaping_.iterations, .01, sum);
      }
      sum(trial, unused);
      double worst = 1.;
      for (const Places& p : places) worst = std::min(worst, least(p));
      if (worst > best) best = worst, x = trial;
      if (best > 0.) break;
    }
    // What was proven to be valid stays so: otherwise the patch goes half of its way, a quarter, … or stays.
    const auto proven = [&](std::uint32_t e) { return certify(elements_.hexahedron(e)).positive(); };
    List valid;
    for (const std::uint32_t e : patch.seen)
      if (proven(e)) valid.push_back(e);
    const auto put = [&](const Vector& at) {
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t d = 0; d < 4; ++d)
          elements_.curves[patch.curves[i]][d] = at.segment<3>(Eigen::Index(12 * i + 3 * d));
    };
    put(x);
    for (double share = .5; !std::ranges::all_of(valid, proven); share *= .5) {
      if (share < .1) return put(before);
      put(before + share * (x - before));
    }
  }

 private:
  Anchor anchor(const Depths& curve, std::size_t d) const {
    constexpr double reach = 500.;  // µm
    const double small = .01 / (shaping_.along * shaping_.along),
                 strong = .01 / (shaping_.off * shaping_.off);
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
                    const Shaping& shaping, Progress& progress) {
  const Stars stars(elements);
  const Shaper shape(elements, outer, inner, shaping);
  for (int round = 0; round < shaping.rounds; ++round) {
    std::vector<std::uint8_t> bad(elements.size(), 0);
    parallel_for(elements.size(), 256, [&](std::size_t e) {
      const Places places = places_of(elements, e);
      double volume = 0.;
      bad[e] = least(places, &volume) < shaping.enough || volume < (shaping.least - .05) * shaping.volume ||
               volume > (shaping.most + .05) * shaping.volume;
    });
    const auto turns = patches(elements, stars, std::move(bad));
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
