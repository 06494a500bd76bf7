// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/cortex/face_places.h"
#include "forest/cortex/gauge.h"
#include "forest/cortex/minimise.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

using List = std::vector<std::uint32_t>;

// What holds a place: (p − at)ᵀ hold (p − at).
struct Anchor {
  Place at = Place::Zero();
  Matrix<3> hold = Matrix<3>::Zero();
};

// What holds the places of a face: (what each is off its plane)² times what it counts.
struct HeldFace {
  std::array<Pin, face_places> pins;
  std::array<double, face_places> by{};
};

constexpr double farthest_way = 1000.;  // µm, that a place may move at once: not to another bank
constexpr double very_bad = .6;         // so much of a good enough scaled Jacobian
constexpr double level_enough = .004;   // of a volume, that more lies above than is wanted

// What a number lacks or has too much of.
constexpr double beyond(double low, double high, double x) {
  return std::max(0., x - high) - std::max(0., low - x);
}

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
    patch.curves = distinct(std::move(patch.curves));
    for (const std::uint32_t c : patch.curves)
      for (const std::uint32_t e : stars.of(c)) patch.seen.push_back(e);
    patch.seen = distinct(std::move(patch.seen));
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

// How much more of some elements should lie above than below, as a share of their volume: as much as of those around them, on the mean.
std::vector<float> wanted_tilts(const Elements& elements, const Stars& stars, const List& list) {
  constexpr float most = .5f;  // twice what a wedge has
  std::vector<float> own(elements.size(), 0.f), wanted(own);
  std::vector<std::uint8_t> known(elements.size(), 0);
  const List around = widened(elements, stars, list);
  const Looks looks = look(elements, around);
  for (std::size_t i = 0; i < around.size(); ++i)
    if (looks.least[i] > 0.f)
      known[around[i]] = 1, own[around[i]] = std::clamp(looks.tilt[i] / looks.volume[i], -most, most);
  parallel_for(list.size(), 64, [&](std::size_t i) {
    float sum = 0.f, count = 0.f;
    for (const std::uint32_t e : widened(elements, stars, std::span(&list[i], 1)))
      if (known[e]) sum += own[e], count += 1.f;
    wanted[list[i]] = count > 0.f ? sum / count : 0.f;
  });
  return wanted;
}

// One patch while it is shaped.
class Work {
 public:
  using Anchors = std::vector<std::array<Anchor, 4>>;  // of every moving curve

  using Held = std::vector<std::array<HeldFace, 2>>;  // of every element seen, outer and inner; or none

  Work(Elements& elements, const Patch& patch, const Shaping& shaping, const std::vector<float>& tilts,
       Anchors anchors, Held held)
      : elements_(elements),
        patch_(patch),
        shaping_(shaping),
        anchors_(std::move(anchors)),
        held_(std::move(held)) {
    before_.resize(Eigen::Index(12 * patch.curves.size()));
    for (std::size_t i = 0; i < patch.curves.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d)
        before_.segment<3>(Eigen::Index(12 * i + 3 * d)) = elements.curves[patch.curves[i]][d];
    for (const std::uint32_t e : patch.seen) {
      const bool valid = proven(e);
      Seen own{e, {}, double(tilts[e]), valid, shaping.finely || !valid, true};
      for (std::size_t c = 0; c < 16; ++c) {
        const auto at = std::ranges::lower_bound(patch.curves, elements.elements[e][c]);
        own.moving[c] =
            at != patch.curves.end() && *at == elements.elements[e][c] ? int(at - patch.curves.begin()) : -1;
      }
      seen_.push_back(own);
    }
    group();
    for (Group& g : groups_) {
      const Shape shape = look(g.batch, g.samples);
      g.each([&](int lane, Seen& s) { s.whole = shape.least[lane] > 0.f; });
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
      if (closer) group();
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
    std::array<int, 16> moving;  // for each of its curves which of the moving ones it is, or -1
    double tilt;                 // wanted, of its volume
    bool valid;                  // proven to be, at first
    bool finely;                 // it may fold where few samples do not see it
    bool whole;                  // folded at no sample, which must stay so
  };
  struct Group {  // those that are weighed together
    Batch batch;
    Samples samples;
    std::vector<Seen*> seen;

    void each(auto&& visit) const {
      for (std::size_t lane = 0; lane < seen.size(); ++lane) visit(int(lane), *seen[lane]);
    }
  };

  void group() {
    groups_.clear();
    for (const bool finely : {false, true}) {
      List list;
      std::vector<Seen*> seen;
      for (Seen& s : seen_)
        if (s.finely == finely) list.push_back(s.element), seen.push_back(&s);
      for (std::size_t i = 0; i < list.size(); i += std::size_t(lanes)) {
        const std::size_t end = std::min(list.size(), i + std::size_t(lanes));
        groups_.push_back({batch_of(elements_, std::span(list).subspan(i)),
                           finely ? Samples::many : Samples::few,
                           {seen.begin() + std::ptrdiff_t(i), seen.begin() + std::ptrdiff_t(end)}});
      }
    }
  }

  bool proven(std::uint32_t element) const { return certify(elements_.hexahedron(element)).positive(); }
  bool lost() const {
    return std::ranges::any_of(seen_, [&](const Seen& s) { return s.valid && !proven(s.element); });
  }

  void put(const Vector& at) {
    for (std::size_t i = 0; i < patch_.curves.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d)
        elements_.curves[patch_.curves[i]][d] = at.segment<3>(Eigen::Index(12 * i + 3 * d));
  }

  // Of a curve that moves, for each of its places, visit(which of the element's it is, where it is among all coordinates).
  static void each_moving(const Seen& s, auto&& visit) {
    for (int c = 0; c < 16; ++c)
      for (int d = 0; d < 4 && s.moving[std::size_t(c)] >= 0; ++d)
        visit(16 * d + c, 12 * s.moving[std::size_t(c)] + 3 * d);
  }

  // What is minimised: what all elements lack and how far places are from where they are held. Infinite where an element folds.
  double lack(const Vector& at, Vector& gradient) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    gradient.setZero(at.size());
    double value = 0.;
    for (Group& g : groups_) {
      g.each([&](int lane, const Seen& s) {
        each_moving(s, [&](int place, int k) { g.batch.move(lane, place, at.segment<3>(k)); });
      });
      const Shape shape = look(g.batch, g.samples);
      Counts counts{};
      bool folded = false, good = true;
      g.each([&](int lane, const Seen& s) {
        folded |= s.whole && shape.least[lane] <= 0.f;
        const double ratio = double(shape.volume[lane]) / shaping_.volume;
        const double off = beyond(shaping_.least, shaping_.most, ratio);
        const double tilt =
            beyond(-level_enough, level_enough, double(shape.tilt[lane]) / shaping_.volume - s.tilt * ratio);
        counts.volume[lane] =
            float(2. * (shaping_.even * off - shaping_.level * tilt * s.tilt) / shaping_.volume);
        counts.tilt[lane] = float(2. * shaping_.level * tilt / shaping_.volume);
        value += shaping_.even * off * off + shaping_.level * tilt * tilt;
        good = good && off == 0. && tilt == 0. && double(shape.least[lane]) >= shaping_.wanted;
      });
      if (folded) return infinite;
      if (good) continue;
      weigh(g.batch, g.samples, {float(shaping_.wanted), float(fold_)}, counts, lack_);
      g.each([&](int lane, const Seen& s) {
        value += double(lack_.value[lane]);
        each_moving(s, [&](int place, int k) {
          for (int one = 0; one < 3; ++one) gradient[k + one] += double(lack_.gradient[one][place][lane]);
        });
      });
    }
    for (std::size_t i = 0; i < anchors_.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d) {
        const auto k = Eigen::Index(12 * i + 3 * d);
        const Place off = at.segment<3>(k) - anchors_[i][d].at, pull = anchors_[i][d].hold * off;
        if ((at.segment<3>(k) - before_.segment<3>(k)).squaredNorm() > farthest_way * farthest_way)
          return infinite;
        value += off.dot(pull);
        gradient.segment<3>(k) += 2. * pull;
      }
    for (std::size_t i = 0; i < held_.size(); ++i)
      for (const std::size_t side : {0u, 1u})
        value += strain(seen_[i], held_[i][side], 3 * side, at, gradient);
    return value;
  }

  // What the places of a face are off, as a sum of squares, and how that grows with the places of its curves.
  double strain(const Seen& s, const HeldFace& held, std::size_t depth, const Vector& at,
                Vector& gradient) const {
    using OfCurves = Eigen::Matrix<double, 16, 3>;
    const auto each_moving = [&](auto&& visit) {  // visit(its row, where it is among all coordinates)
      for (std::size_t c = 0; c < 16; ++c)
        if (s.moving[c] >= 0) visit(Eigen::Index(c), 12 * s.moving[c] + 3 * Eigen::Index(depth));
    };
    OfCurves ways = OfCurves::Zero();  // since the face was held
    each_moving([&](Eigen::Index row, Eigen::Index k) {
      ways.row(row) = (at.segment<3>(k) - before_.segment<3>(k)).transpose();
    });
    const Eigen::Matrix<double, face_places, 3> moved = face_weights() * ways;
    Eigen::Matrix<double, face_places, 3> slopes;
    double value = 0.;
    for (std::size_t k = 0; k < held.pins.size(); ++k) {
      const Pin& pin = held.pins[k];
      const double left = moved.row(Eigen::Index(k)).dot(pin.normal) - pin.off;
      value += held.by[k] * left * left;
      slopes.row(Eigen::Index(k)) = 2. * held.by[k] * left * pin.normal.transpose();
    }
    const OfCurves of_curves = face_weights().transpose() * slopes;
    each_moving(
        [&](Eigen::Index row, Eigen::Index k) { gradient.segment<3>(k) += of_curves.row(row).transpose(); });
    return value;
  }

  Elements& elements_;
  const Patch& patch_;
  const Shaping& shaping_;
  Anchors anchors_;
  Held held_;
  Vector before_;
  std::vector<Seen> seen_;
  std::vector<Group> groups_;
  double fold_ = 0.;
  Lack lack_;
};

class Shaper {
 public:
  Shaper(Elements& elements, const SurfaceTrees& surfaces, const Shaping& shaping)
      : elements_(elements), surfaces_(surfaces), shaping_(shaping) {}

  // Whether a place of a face is farther from its surface than is close.
  bool is_far(std::uint32_t element) const {
    return std::ranges::any_of(std::array{0u, 3u}, [&](std::size_t depth) {
      return std::ranges::any_of(pins_of(elements_, element, depth, surfaces_.at(depth)),
                                 [&](const Pin& pin) { return std::abs(pin.off) > shaping_.close; });
    });
  }

  void operator()(const Patch& patch, const std::vector<float>& tilts) const {
    const List worst = shaping_.close > 0. ? List() : curves_of_worst(patch);
    Work::Anchors anchors(patch.curves.size());
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      const bool gives = std::ranges::binary_search(worst, patch.curves[i]);
      for (std::size_t d = 0; d < 4; ++d)
        anchors[i][d] =
            anchor(elements_.curves[patch.curves[i]], d, gives ? shaping_.worst_off : shaping_.off);
    }
    Work::Held held(shaping_.close > 0. ? patch.seen.size() : 0);
    for (std::size_t i = 0; i < held.size(); ++i) held[i] = {hold(patch.seen[i], 0), hold(patch.seen[i], 3)};
    Work(elements_, patch, shaping_, tilts, std::move(anchors), std::move(held)).run();
  }

 private:
  // Of what holds a place that gives by so many µm as gladly as the Jacobian at one place falls short by a tenth.
  static double strength(double give) { return .01 / (give * give); }

  List curves_of_worst(const Patch& patch) const {
    List worst;
    const Looks looks = look(elements_, patch.seen);
    for (std::size_t i = 0; i < patch.seen.size(); ++i)
      if (const auto& own = elements_.elements[patch.seen[i]];
          double(looks.least[i]) < very_bad * shaping_.enough)
        worst.insert(worst.end(), own.begin(), own.end());
    return distinct(std::move(worst));
  }

  HeldFace hold(std::uint32_t element, std::size_t depth) const {
    constexpr double hopeless = 100.;  // µm: no element follows every fold, and what is farther counts less
    HeldFace held{pins_of(elements_, element, depth, surfaces_.at(depth)), {}};
    for (std::size_t k = 0; k < held.by.size(); ++k)
      held.by[k] = strength(shaping_.off) / (1. + std::pow(held.pins[k].off / hopeless, 2));
    return held;
  }

  Anchor anchor(const Depths& curve, std::size_t d, double give) const {
    constexpr double reach = 500.;  // µm
    Anchor result{curve[d], strength(shaping_.along) * Matrix<3>::Identity()};
    if (d == 1 || d == 2 || shaping_.close > 0.) return result;
    const TriangleTree& surface = surfaces_.at(d);
    const auto hit = surface.nearest(curve[d], reach);
    if (!hit) return result;
    const Place n = surface.normal(hit->triangle);
    if (n.dot(curve[0] - curve[3]) <= 0.) return result;  // the other bank
    result.at += n * n.dot(hit->at - curve[d]);
    result.hold += strength(give) * n * n.transpose();
    return result;
  }

  Elements& elements_;
  const SurfaceTrees& surfaces_;
  const Shaping& shaping_;
};

}  // namespace

void improve_shapes(Elements& elements, const SurfaceTrees& surfaces, const Shaping& shaping,
                    Progress& progress, std::span<const std::uint32_t> among) {
  const Stars stars(elements);
  const Shaper shape(elements, surfaces, shaping);
  List looked_at(among.begin(), among.end());
  if (among.empty()) {
    looked_at.resize(elements.size());
    std::iota(looked_at.begin(), looked_at.end(), 0u);
  }
  for (int round = 0; round < shaping.rounds; ++round) {
    std::vector<std::uint8_t> bad(elements.size(), 0), worst(elements.size(), 0);
    const Looks looks = look(elements, looked_at);
    parallel_for(looked_at.size(), 64, [&](std::size_t i) {
      const std::uint32_t e = looked_at[i];
      const double least = double(looks.least[i]), volume = double(looks.volume[i]);
      bad[e] = least < shaping.enough || (shaping.close > 0. && shape.is_far(e)) ||
               volume < (shaping.least - .05) * shaping.volume ||
               volume > (shaping.most + .05) * shaping.volume || !certify(elements.hexahedron(e)).positive();
      worst[e] = least < very_bad * shaping.enough;
    });
    List moving;  // the worst need room: what is around moves, too
    for (std::uint32_t e = 0; e < elements.size(); ++e)
      if (worst[e]) moving.push_back(e);
    for (const std::uint32_t e : widened(elements, stars, moving, shaping.room)) bad[e] = 1;
    List movable;
    for (std::uint32_t e = 0; e < elements.size(); ++e)
      if (bad[e]) movable.push_back(e);
    const std::vector<float> tilts = wanted_tilts(elements, stars, widened(elements, stars, movable));
    const auto turns = patches(elements, stars, std::move(bad), std::size_t(shaping.patch));
    std::size_t count = 0;
    for (const auto& turn : turns) count += turn.size();
    progress.begin("shaping elements", count);
    for (const auto& turn : turns)
      parallel_for(turn.size(), 1, [&](std::size_t i) {
        shape(turn[i], tilts);
        progress.advance();
      });
    progress.end();
  }
}

}  // namespace forest::cortex
