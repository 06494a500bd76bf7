// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/mending.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/core/unions.h"
#include "forest/cortex/gauge.h"
#include "forest/cortex/go.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

void towards(Place& place, double share, const Place& aim) { place += share * (aim - place); }

// Of some elements, those that are not valid or badly shaped, and how badly: 0 is well, from 2 on it is not valid.
struct Faults {
  std::vector<std::uint32_t> elements;
  std::vector<double> how;  // of every one that was asked

  Faults(const Elements& all, std::span<const std::uint32_t> of, double least) : how(of.size()) {
    const Looks looks = look(all, of);
    parallel_for(of.size(), 64, [&](std::size_t i) {
      const double scaled = double(looks.least[i]);
      const bool valid = certify(all.hexahedron(of[i])).positive();
      how[i] = valid ? std::max(0., least - scaled) : 3. - std::max(-1., scaled);
    });
    for (std::size_t i = 0; i < of.size(); ++i)
      if (how[i] > 0.) elements.push_back(of[i]);
  }
};

// What moved since `before` is pieces: elements that share a curve that moved. Each that did not gain goes back.
void keep_gains(Elements& elements, std::vector<Depths> before, double least) {
  const auto moved = [&](std::uint32_t c) { return elements.curves[c] != before[c]; };
  Unions pieces(before.size());                // of curves
  std::vector<std::uint32_t> changed, curves;  // elements, and a curve that moved of each
  for (std::uint32_t e = 0; e < elements.size(); ++e) {
    const auto& own = elements.elements[e];
    const auto first = std::ranges::find_if(own, moved);
    if (first == own.end()) continue;
    for (const std::uint32_t c : own)
      if (moved(c)) pieces.join(*first, c);
    changed.push_back(e), curves.push_back(*first);
  }
  const Faults now(elements, changed, least);
  elements.curves.swap(before);
  const Faults then(elements, changed, least);
  elements.curves.swap(before);
  std::vector<double> gain(before.size(), 0.);
  for (std::size_t i = 0; i < changed.size(); ++i) gain[pieces.root(curves[i])] += then.how[i] - now.how[i];
  for (std::uint32_t c = 0; c < before.size(); ++c)
    if (!(gain[pieces.root(c)] > 0.)) elements.curves[c] = before[c];
}

// The work of mend.
class Mender {
 public:
  Mender(Elements& elements, const SurfaceTrees& surfaces)
      : elements_(elements),
        surfaces_(surfaces),
        stars_(elements),
        before_(elements.curves),
        times_(elements.size(), 0),
        rim_(by_the_wall(elements)) {}

  const Stars& stars() const { return stars_; }

  // Half way to straight sides, three quarters, … and wholly.
  void straighten(std::uint32_t element) {
    const double much = ++times_[element] < 4 ? .5 : 1.;
    const auto& e = elements_.elements[element];
    const auto at = [&](std::size_t k, std::size_t d) -> Place& { return elements_.curves[e[k]][d]; };
    for (const auto& side : sides)
      for (std::size_t k = 1; k < 3; ++k) {
        const double share = double(k) / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          towards(at(side[k], d), much, (1. - share) * at(side[0], d) + share * at(side[3], d));
      }
    for (int j = 1; j < 3; ++j)
      for (int i = 1; i < 3; ++i) {
        const double u = i / 3., v = j / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          towards(at(slot(i, j), d), much,
                  (1. - u) * (1. - v) * at(slot(0, 0), d) + u * (1. - v) * at(slot(3, 0), d) +
                      (1. - u) * v * at(slot(0, 3), d) + u * v * at(slot(3, 3), d));
      }
  }

  // From now on corners are moved, and worth is told in this volume.
  void measure() {
    double sum = 0., count = 0.;
    for (std::size_t e = 0; e < elements_.size(); e += 1 + elements_.size() / 1000, ++count)
      sum += elements_.hexahedron(e).volume();
    mean_volume_ = sum / count;
  }

  // Looks for a better place of a corner: one from which the worst element around it gains.
  void move(std::uint32_t corner, int round) {
    const auto star = stars_.of(corner);
    std::vector<std::uint32_t> own;  // all curves that a move of this corner may change
    for (const std::uint32_t e : star)
      own.insert(own.end(), elements_.elements[e].begin(), elements_.elements[e].end());
    own = distinct(std::move(own));
    std::vector<Depths> kept, better;
    for (const std::uint32_t k : own) kept.push_back(elements_.curves[k]);
    const Depths start = elements_.curves[corner], mean = mean_around(corner);
    const double reach = (mean[1] - start[1]).norm() + .1 * (start[0] - start[3]).norm();
    double best = worth(star);
    Random random(1, corner, std::uint32_t(round));
    constexpr int tries = 40;
    for (int t = 0; t < tries; ++t) {
      Depths next = trial(t, start, mean, rim_[corner] != 0, reach, random);
      keep_on_surfaces(next);
      if (!near(next, before_[corner])) continue;
      elements_.curves[corner] = next;
      for (const std::uint32_t e : star) times_[e] = 4, straighten(e);
      if (const double now = worth(star); now > best) {
        best = now, better.clear();
        for (const std::uint32_t k : own) better.push_back(elements_.curves[k]);
      }
      for (std::size_t k = 0; k < own.size(); ++k) elements_.curves[own[k]] = kept[k];
    }
    for (std::size_t k = 0; k < better.size(); ++k) elements_.curves[own[k]] = better[k];
  }

 private:
  // Of the corners beside it.
  Depths mean_around(std::uint32_t corner) const {
    Depths mean{Place::Zero(), Place::Zero(), Place::Zero(), Place::Zero()};
    double count = 0.;
    for (const std::uint32_t e : stars_.of(corner)) {
      const auto at = elements_.corners_of(e);
      const std::size_t k = std::size_t(std::find(at.begin(), at.end(), corner) - at.begin());
      for (const std::size_t other : {k ^ 1u, k ^ 2u}) {
        for (std::size_t d = 0; d < 4; ++d) mean[d] += elements_.curves[at[other]][d];
        count += 1.;
      }
    }
    for (std::size_t d = 0; d < 4; ++d) mean[d] /= count;
    return mean;
  }

  // First towards the mean (but on the rim), then less bent from depth to depth, then by chance.
  static Depths trial(int t, const Depths& start, const Depths& mean, bool on_rim, double reach,
                      Random& random) {
    Depths next = start;
    if (t < 4 && !on_rim) {
      for (std::size_t d = 0; d < 4; ++d) towards(next[d], .25 * double(t + 1), mean[d]);
    } else if (t < 7) {
      const Place one = (2. * next[0] + next[3]) / 3., two = (next[0] + 2. * next[3]) / 3.;
      if (t == 4) calm(next[0], next[1], next[2], next[3]);
      const double much = t == 5 ? .5 : t == 6 ? 1. : 0.;
      towards(next[1], much, one), towards(next[2], much, two);
    } else {
      const Place way(random.normal(), random.normal(), random.normal());
      const Place turn(random.normal(), random.normal(), random.normal());
      // All depths alike and turned, or only some: those near one surface, or a single one.
      const std::size_t first = t % 3 == 0 ? 0 : std::size_t(random.below(4));
      const std::size_t last = t % 3 == 0 ? 3 : t % 3 == 1 ? first : first < 2 ? 1 : 3;
      const double size = (t & 1) ? .15 : .04;
      for (std::size_t d = std::min(first, last); d <= last; ++d)
        next[d] += size * reach * (way + (double(d) / 1.5 - 1.) * turn);
    }
    return next;
  }

  // Not on the other bank of a sulcus or a gyrus: near, and facing the same way.
  void keep_on_surfaces(Depths& curve) const {
    constexpr double reach = 500.;
    const Place outwards = curve[0] - curve[3];
    for (const auto& [surface, end] :
         {std::pair{&surfaces_.outer, std::size_t(0)}, {&surfaces_.inner, std::size_t(3)}})
      if (const auto hit = surface->nearest(curve[end], reach);
          hit && surface->normal(hit->triangle).dot(outwards) > 0.)
        curve[end] = hit->at;
  }

  static bool near(const Depths& one, const Depths& other) {
    constexpr double farthest_way = 1e3;  // µm
    for (std::size_t d = 0; d < 4; ++d)
      if (!((one[d] - other[d]).norm() < farthest_way)) return false;
    return true;
  }

  double worth(std::span<const std::uint32_t> star) const {
    double least = 1e300;
    for (const std::uint32_t e : star) {
      const Hexahedron h = elements_.hexahedron(e);
      const Coefficients c = determinant(h);
      least = std::min(
          least, *std::min_element(c.begin(), c.end()) / std::max(std::abs(h.volume()), .1 * mean_volume_));
    }
    return least;
  }

  Elements& elements_;
  const SurfaceTrees& surfaces_;
  const Stars stars_;
  const std::vector<Depths> before_;
  std::vector<std::uint8_t> times_;  // that each element was straightened
  const std::vector<std::uint8_t> rim_;
  double mean_volume_ = 0.;
};

}  // namespace

Mending mend(Elements& elements, const SurfaceTrees& surfaces, Progress& progress) {
  constexpr int rounds_of_sides = 6, rounds_of_corners = 80;
  progress.begin("untangling", 0);
  Mender mender(elements, surfaces);
  const auto spread = [&](std::span<const std::uint32_t> list) {
    return widened(elements, mender.stars(), list);
  };
  std::vector<std::uint32_t> bad = uncertified(elements);
  Mending result;
  result.before = bad.size();
  for (int round = 0; round < rounds_of_sides && !bad.empty(); ++round) {
    for (const std::uint32_t e : bad) mender.straighten(e);
    bad = uncertified(elements, spread(bad));
    progress.advance();
  }
  // What is left is few: corners look for a better place each.
  mender.measure();
  for (int round = 0; round < rounds_of_corners && !bad.empty(); ++round) {
    for (const std::uint32_t e : bad)
      mender.straighten(e);  // a neighbour's sides became straight, and its own inside is not
    bad = uncertified(elements, spread(bad));
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t e : bad)
      for (const std::uint32_t c : elements.corners_of(e)) corners.push_back(c);
    for (const std::uint32_t c : distinct(std::move(corners))) mender.move(c, round);
    bad = uncertified(elements, spread(spread(bad)));  // sides of the stars' rims changed, too
    progress.advance();
  }
  progress.end();
  result.after = bad.size();
  return result;
}

void even_out(Elements& elements, std::span<const std::uint32_t> heap, int rings) {
  constexpr int rounds = 300;
  const Stars stars(elements);
  const std::vector<std::uint32_t> around = widened(elements, stars, heap, rings);
  std::vector<std::uint8_t> is_around(elements.size(), 0);
  for (const std::uint32_t e : around) is_around[e] = 1;
  const std::vector<std::uint8_t> rim = by_the_wall(elements);
  const auto inside = [&](std::uint32_t c) {
    return std::ranges::all_of(stars.of(c), [&](std::uint32_t e) { return is_around[e] != 0; });
  };
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t e : around)
    for (const std::uint32_t c : elements.corners_of(e))
      if (!rim[c] && inside(c)) corners.push_back(c);
  corners = distinct(std::move(corners));
  std::vector<std::vector<std::uint32_t>> near(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const std::uint32_t e : stars.of(corners[i]))
      for (const auto& side : sides) {
        const std::uint32_t a = elements.elements[e][side[0]], b = elements.elements[e][side[3]];
        if (a == corners[i]) near[i].push_back(b);
        if (b == corners[i]) near[i].push_back(a);
      }
    near[i] = distinct(std::move(near[i]));
  }
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < corners.size(); ++i)
      for (std::size_t d = 0; d < 4; ++d) {
        Place sum = Place::Zero();
        for (const std::uint32_t c : near[i]) sum += elements.curves[c][d];
        elements.curves[corners[i]][d] = sum / double(near[i].size());
      }
  for (const std::uint32_t e : around) {
    const auto& own = elements.elements[e];
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const std::uint32_t c = own[slot(i, j)];
        const bool corner = i % 3 == 0 && j % 3 == 0, middle = i % 3 != 0 && j % 3 != 0;
        if (corner || (!middle && (stars.of(c).size() < 2 || !inside(c)))) continue;
        const double u = i / 3., v = j / 3.;
        for (std::size_t d = 0; d < 4; ++d)
          elements.curves[c][d] =
              (1. - v) *
                  ((1. - u) * elements.curves[own[slot(0, 0)]][d] + u * elements.curves[own[slot(3, 0)]][d]) +
              v * ((1. - u) * elements.curves[own[slot(0, 3)]][d] + u * elements.curves[own[slot(3, 3)]][d]);
      }
  }
}

void begin_anew(Elements& elements, const SurfaceTrees& surfaces, const Shaping& shaping, double least,
                Progress& progress, Rings rings) {
  struct Try {
    int evened, room;  // rings: that are evened out, and around these that move, too
    bool modest = false;
  };
  constexpr std::array tries{Try{0, 1},       Try{1, 1},       Try{0, 3},      Try{1, 2}, Try{2, 1},
                             Try{3, 1},       Try{2, 2},       Try{3, 2},      Try{4, 2}, Try{6, 2},
                             Try{0, 1, true}, Try{0, 2, true}, Try{0, 3, true}};
  constexpr std::size_t near = 6;  // the first so many
  Shaping wide = shaping;
  wide.patch = 200;
  wide.finely = true;
  // Where all that is good to have leaves one below what is needed, a little more than that alone is asked for, of any volume.
  Shaping modest = wide;
  modest.wanted = 1.25 * least;
  modest.even = 0.;
  const Stars stars(elements);
  std::vector<std::uint32_t> all(elements.size());
  std::iota(all.begin(), all.end(), 0u);
  for (const auto& [evened, room, is_modest] :
       std::span(tries).first(rings == Rings::few ? near : tries.size())) {
    const std::vector<std::uint32_t> heaps = Faults(elements, all, least).elements;
    if (heaps.empty()) return;
    std::vector<Depths> before = elements.curves;
    if (evened > 0) even_out(elements, heaps, evened);
    Shaping asked = is_modest ? modest : wide;
    asked.room = room;
    improve_shapes(elements, surfaces, asked, progress, widened(elements, stars, heaps, evened + room));
    keep_gains(elements, before, least);
    go(elements, before, to_keep(elements, shaping.enough));  // back, what need not have left
  }
}

LeftOut leave_out(Elements& elements, double least) {
  constexpr double no_tissue = 400.;  // µm: cortex is nowhere so thin
  LeftOut result;
  std::vector<std::uint8_t> rim = by_the_wall(elements);
  for (std::uint32_t c = 0; c < elements.corners; ++c)
    if ((elements.curves[c][0] - elements.curves[c][3]).norm() < no_tissue) rim[c] = 1;
  std::vector<std::uint8_t> bad(elements.size(), 0), gone(elements.size(), 0);
  const Looks looks = look(elements);
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    bad[e] = double(looks.least[e]) < least || !certify(elements.hexahedron(e)).positive();
  });
  for (bool more = true; more;) {
    more = false;
    for (std::size_t e = 0; e < elements.size(); ++e) {
      const auto corners = elements.corners_of(e);
      if (!bad[e] || gone[e] || std::ranges::none_of(corners, [&](std::uint32_t c) { return rim[c] != 0; }))
        continue;
      gone[e] = 1, more = true;
      for (const std::uint32_t c : corners) rim[c] = 1;
      ++result.elements, result.volume += elements.hexahedron(e).volume();
    }
  }
  std::size_t kept = 0;
  for (std::size_t e = 0; e < elements.size(); ++e)
    if (!gone[e]) elements.elements[kept++] = elements.elements[e];
  elements.elements.resize(kept);
  return result;
}

}  // namespace forest::cortex
