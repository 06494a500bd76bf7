// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/mixing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "forest/statistics/summary.h"

namespace forest::fitting {
namespace {

// Degrees between basal and other stems that count as much as a standard deviation of a style, where mates are chosen.
constexpr double near_angle = 6.;

// How much a standard deviation of how deep in the slice stems lie counts where it is chosen as which they leave.
constexpr double as_deep = .3;

// What it costs to leave stems as the mate has them, where no other has them much the same.
constexpr double unmoved = 30.;

// What it costs to be a partner of who lends nothing, of oneself, of one's kin, and of who has other kinds of stems.
constexpr double hardly = 1e7, oneself = 5e6, unlikely = 1e6, seldom = 1e3;

double degrees(const Vec3& a, const Vec3& b) {
  return std::atan2(double(a.cross(b).norm()), double(a.dot(b))) * 180. / std::numbers::pi;
}

constexpr int basal_kind = int(SectionKind::basal);
bool is_basal(const Stem& s) { return s.kind == basal_kind; }

using Kinds = std::set<int>;

Kinds kinds_of_stems(const Cell& c) {
  Kinds kinds;
  for (const Stem& s : c.stems) kinds.insert(s.kind);
  return kinds;
}

// Which stems a neuron has of its mate, by the kinds that both have: none of a kind that it has not itself, so that each kind comes as
// often as it was traced.
enum class Lent { nothing, basal_stems, all };
Lent lent(const Kinds& neuron, const Kinds& mate) {
  if (neuron.contains(basal_kind) && mate.contains(basal_kind)) return Lent::basal_stems;
  return neuron == mate ? Lent::all : Lent::nothing;
}

bool is_lent(const Stem& s, Lent lent) {
  return lent == Lent::all || (lent == Lent::basal_stems && is_basal(s));
}

// Of the basal stems, the mean angle between where they leave the soma and where the nearest other stem does, in degrees; none
// where there are not both.
std::optional<double> angle_between(const Cell& others, const Cell& basal) {
  std::vector<double> least;
  for (const Stem& s : basal.stems)
    for (bool first = is_basal(s); const Stem& o : others.stems)
      if (is_basal(s) && !is_basal(o)) {
        const double angle = degrees(s.place, o.place);
        if (std::exchange(first, false))
          least.push_back(angle);
        else
          least.back() = std::min(least.back(), angle);
      }
  return least.empty() ? std::nullopt : std::optional(statistics::mean(least));
}
// What it costs that this angle changes in a neuron when its basal stems lie as those of another.
double widened(const Cell& neuron, const Cell& other) {
  const std::optional<double> was = angle_between(neuron, neuron), is = angle_between(neuron, other);
  return was && is ? std::pow((*is - *was) / near_angle, 2) : 0.;
}

// A permutation of `count` neurons with the least sum of costs, by shortest augmenting paths (Kuhn's Hungarian method; Jonker &
// Volgenant 1987, Computing 38:325). @param cost  of row i and column j
std::vector<std::size_t> assigned(std::size_t count, auto&& cost) {
  constexpr std::size_t none = std::size_t(-1);
  std::vector<double> row_price(count, 0.), column_price(count, 0.);
  std::vector<std::size_t> row_of(count, none), column_of(count, none);
  for (std::size_t start = 0; start < count; ++start) {
    std::vector<double> least(count, std::numeric_limits<double>::infinity());  // to reach each column
    std::vector<std::size_t> from(count, start);                                // … from this row
    std::vector<bool> done(count, false);
    std::size_t row = start, last = none;
    double way = 0.;
    while (last == none) {
      std::size_t next = none;
      for (std::size_t j = 0; j < count; ++j)
        if (!done[j]) {
          const double to = way + cost(row, j) - row_price[row] - column_price[j];
          if (to < least[j]) least[j] = to, from[j] = row;
          if (next == none || least[j] < least[next]) next = j;
        }
      way = least[next], done[next] = true;
      if (row_of[next] == none)
        last = next;
      else
        row = row_of[next];
    }
    row_price[start] += way;
    for (std::size_t j = 0; j < count; ++j)
      if (done[j] && j != last) row_price[row_of[j]] += way - least[j], column_price[j] -= way - least[j];
    for (std::size_t j = last; j != none;) {
      row_of[j] = from[j];
      j = std::exchange(column_of[from[j]], j);
    }
  }
  return column_of;
}

// To each neuron another, each once; of more than this many, those that follow one another are partners.
constexpr std::size_t most_together = 1000;

std::vector<std::size_t> partners(std::size_t count, auto&& cost) {
  std::vector<std::size_t> of;
  const std::size_t blocks = (count + most_together - 1) / most_together;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::size_t first = block * count / blocks, size = (block + 1) * count / blocks - first;
    std::vector<double> costs;
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t j = 0; j < size; ++j) costs.push_back(i == j ? oneself : cost(first + i, first + j));
    for (const std::size_t j :
         assigned(size, [&](std::size_t row, std::size_t column) { return costs[row * size + column]; }))
      of.push_back(first + j);
  }
  return of;
}

}  // namespace

double apart(const Cell& one, const Cell& other) {
  double sum = 0.;
  for (const auto& [kind, of] : one.kinds) {
    const auto found = other.kinds.find(kind);
    for (std::size_t s = 0; s < trait::count; ++s)
      if (s < trait::slope || s > trait::kinks)
        sum += std::pow(of.style[s] - (found == other.kinds.end() ? 0. : found->second.style[s]), 2);
  }
  return sum;
}

namespace {

// Of the others, the most alike first.
std::vector<std::size_t> most_alike(const std::vector<Cell>& cells, std::size_t neuron, std::size_t most) {
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t j = 0; j < cells.size(); ++j)
    if (j != neuron) others.emplace_back(apart(cells[neuron], cells[j]), j);
  const auto end = others.begin() + std::ptrdiff_t(std::min(most, others.size()));
  std::ranges::partial_sort(others, end);
  std::vector<std::size_t> order;
  for (auto other = others.begin(); other != end; ++other) order.push_back(other->second);
  return order;
}

// By how much more one neuron's stems of a kind of both leave the plane of the slice, in standard deviations.
double deeper(const Cell& one, const Cell& other) {
  for (const auto& [kind, of] : one.kinds)
    if (const auto found = other.kinds.find(kind); found != other.kinds.end())
      return of.style[trait::depth] - found->second.style[trait::depth];
  return 0.;
}

// What stems must share for one to have the pose of the other: the kind, and whether they have a length or fork where they leave.
std::pair<int, bool> sort_of(const Stem* s) { return {s->kind, s->length > 0.}; }

// The stems of a cell that has lent them, each sort by the path to the farthest tip.
std::vector<const Stem*> ranked(const Cell& cell, Lent lent) {
  std::vector<const Stem*> stems;
  for (const Stem& s : cell.stems)
    if (is_lent(s, lent)) stems.push_back(&s);
  std::ranges::stable_sort(stems, {}, [](const Stem* s) { return std::pair(sort_of(s), s->ahead); });
  return stems;
}

// How unlike the stems of two are, the first beside the first; nothing where one has other sorts of them.
std::optional<double> unlike(std::span<const Stem* const> ones, std::span<const Stem* const> others) {
  if (!std::ranges::equal(ones, others, {}, sort_of, sort_of)) return std::nullopt;
  const auto square = [](double one, double other) {
    return std::pow(std::log(std::max(1., one) / std::max(1., other)), 2);
  };
  double sum = 0.;
  for (std::size_t k = 0; k < ones.size(); ++k)
    sum += square(ones[k]->ahead, others[k]->ahead) + square(ones[k]->tips, others[k]->tips);
  return sum / double(std::max<std::size_t>(1, ones.size()));
}

}  // namespace

std::vector<Mixed> mix(const Traced& traced, std::size_t kin) {
  const std::vector<Cell>& cells = traced.cells;
  std::vector<std::vector<std::size_t>> like;
  std::vector<Kinds> kinds;
  for (std::size_t i = 0; i < cells.size(); ++i)
    like.push_back(most_alike(cells, i, kin)), kinds.push_back(kinds_of_stems(cells[i]));
  const auto cost = [&](std::size_t i, std::size_t j) {
    return apart(cells[i], cells[j]) + (std::ranges::count(like[i], j) ? unlikely : 0.) +
           (kinds[i] == kinds[j] ? 0. : seldom);
  };
  const std::vector<std::size_t> mates = partners(cells.size(), [&](std::size_t i, std::size_t j) {
    return cost(i, j) + widened(cells[i], cells[j]) +
           (lent(kinds[i], kinds[j]) == Lent::nothing ? hardly : 0.);
  });
  const std::vector<std::size_t> thirds = partners(cells.size(), [&](std::size_t i, std::size_t j) {
    return cost(i, j) + (j == mates[i] ? unlikely : 0.);
  });
  const auto lent_to = [&](std::size_t i) { return lent(kinds[i], kinds[mates[i]]); };
  const std::vector<std::size_t> fourths = partners(cells.size(), [&](std::size_t i, std::size_t j) {
    const auto stems = unlike(ranked(cells[mates[i]], lent_to(i)), ranked(cells[j], lent_to(i)));
    return stems.value_or(hardly) + widened(cells[i], cells[j]) +
           std::pow(as_deep * deeper(cells[i], cells[j]), 2) + (j == mates[i] ? unmoved : 0.);
  });
  std::vector<Mixed> mixed;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell &own = cells[i], &mate = cells[mates[i]];
    const Lent of_mate = lent_to(i);
    Mixed m{.kin = std::move(like[i]),
            .stems = {},
            .poses = {},
            .basal_as = of_mate == Lent::nothing ? i : mates[i],
            .others_as = of_mate == Lent::all ? mates[i] : i,
            .thin_as = thirds[i]};
    for (const Stem& s : own.stems)
      if (!is_lent(s, of_mate)) m.stems.push_back(&s);
    for (const Stem& s : mate.stems)
      if (is_lent(s, of_mate)) m.stems.push_back(&s);
    m.poses = m.stems;
    const std::vector<const Stem*> stems = ranked(mate, of_mate), poses = ranked(cells[fourths[i]], of_mate);
    if (unlike(stems, poses))
      for (std::size_t k = 0; k < stems.size(); ++k) std::ranges::replace(m.poses, stems[k], poses[k]);
    mixed.push_back(std::move(m));
  }
  return mixed;
}

}  // namespace forest::fitting
