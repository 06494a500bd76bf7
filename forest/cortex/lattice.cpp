// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

// Where the tangent planes of two sites meet, nearest to both.
Place between(const LatticeSite& a, const LatticeSite& b) {
  const double ab = a.normal.dot(b.normal), da = a.normal.dot(b.at - a.at), db = b.normal.dot(a.at - b.at);
  const double f = 1. / (1. - ab * ab + 1e-4);
  const double la = 2. * (da - ab * db) * f, lb = 2. * (db - ab * da) * f;
  return .5 * (a.at + b.at) + .25 * (a.normal * la + b.normal * lb);
}

// The pair of points of both lattices, near the middle of the two sites, that lie nearest to each other.
struct Agreement {
  Place one, other;
  Eigen::Vector2i from_one, from_other;  // steps along and up from each site's own point
};
Agreement agree(const LatticeSite& a, const Place& a_point, const LatticeSite& b, const Place& b_point) {
  const Place middle = between(a, b);
  struct Corner {
    Place at[4];
    Eigen::Vector2i steps[4];
  };
  const auto corners = [&](const LatticeSite& s, const Place& point) {
    Corner c;
    const Place d = middle - point, up = s.up();
    const int x = int(std::floor(s.along.dot(d) / s.spacing)), y = int(std::floor(up.dot(d) / s.spacing));
    for (int i = 0; i < 4; ++i) {
      c.steps[i] = {x + (i & 1), y + (i >> 1)};
      c.at[i] = point + s.spacing * (double(c.steps[i].x()) * s.along + double(c.steps[i].y()) * up);
    }
    return c;
  };
  const Corner ca = corners(a, a_point), cb = corners(b, b_point);
  Agreement best;
  double least = 1e300;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (const double d = (ca.at[i] - cb.at[j]).squaredNorm(); d < least)
        least = d, best = {ca.at[i], cb.at[j], ca.steps[i], cb.steps[j]};
  return best;
}

void hold_to_line(const LatticeSite& site, Place& point) {
  if (!site.line || !site.line->holds()) return;
  const Place side = site.normal.cross(site.line->along);
  if (side.squaredNorm() > 0.) point += side * side.dot(site.line->at - point) / side.squaredNorm();
}

// To where the lattices of its neighbours agree with it.
void settle(Level& level, std::uint32_t i) {
  LatticeSite& site = level.sites[i];
  Place sum = site.point;
  double weights = 0.;
  for (std::uint32_t e = level.starts[i]; e < level.starts[i + 1]; ++e) {
    const LatticeSite& other = level.sites[level.list[e]];
    const Agreement agreed = agree(site, sum, other, other.point);
    const double w = double(level.weights[e]);
    sum = (weights * agreed.one + w * agreed.other) / (weights + w);
    weights += w;
    sum -= site.normal * site.normal.dot(sum - site.at);
  }
  if (weights == 0.) return;
  hold_to_line(site, sum);
  site.point = site.rounded(sum, site.at);
}

void settle(Level& level, const Waves& waves, int rounds) {
  constexpr std::uint32_t few = 64;  // sites, that other threads would only come too late for
  for (int round = 0; round < rounds; ++round)
    for (std::size_t k = 0; k + 1 < waves.starts.size(); ++k) {
      const std::uint32_t* const sites = &waves.sites[waves.starts[k]];
      const std::uint32_t count = waves.starts[k + 1] - waves.starts[k];
      if (count < 2 * few)
        for (std::uint32_t n = 0; n < count; ++n) settle(level, sites[n]);
      else
        parallel_for(count, few, [&](std::size_t n) { settle(level, sites[n]); });
    }
}

Level coarser(Level& fine) {
  const std::size_t n = fine.sites.size();
  constexpr std::uint32_t none = ~0u;
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t e = fine.starts[i]; e < fine.starts[i + 1]; ++e) {
      const std::uint32_t j = fine.list[e];
      if (j <= i) continue;
      const LatticeSite &a = fine.sites[i], &b = fine.sites[j];
      const double ratio = std::min(a.area, b.area) / std::max(a.area, b.area);
      pairs.emplace_back(-a.normal.dot(b.normal) * ratio, i, j);
    }
  // Those alike in direction and size first; what is left alone stays alone.
  std::sort(pairs.begin(), pairs.end());
  Level level;
  fine.coarser.assign(n, none);
  const auto merge = [&](std::uint32_t i, std::uint32_t j) {
    const LatticeSite &a = fine.sites[i], &b = fine.sites[j];
    LatticeSite s = a;
    if (i != j) {
      const double area = a.area + b.area, wa = a.area / area, wb = b.area / area;
      s.at = wa * a.at + wb * b.at;
      s.normal = (wa * a.normal + wb * b.normal).normalized();
      s.area = area;
      s.line = a.line && (a.line->holds() || !b.line) ? a.line : b.line;
      // The arm of b's cross nearest to a's.
      Place best = b.along;
      for (const Place& arm : {b.along, Place(b.up()), Place(-b.along), Place(-b.up())})
        if (arm.dot(a.along) > best.dot(a.along)) best = arm;
      s.along = wa * a.along + wb * best;
    }
    s.along = (s.along - s.normal * s.normal.dot(s.along)).normalized();
    if (s.line) {  // exactly along the line
      Place along = s.line->along - s.normal * s.normal.dot(s.line->along);
      if (along.norm() > .5) s.along = along.normalized();
    }
    s.point = s.at;
    fine.coarser[i] = fine.coarser[j] = std::uint32_t(level.sites.size());
    level.sites.push_back(s), level.parts.push_back({i, j});
  };
  for (const auto& [order, i, j] : pairs)
    if (fine.coarser[i] == none && fine.coarser[j] == none) merge(i, j);
  for (std::uint32_t i = 0; i < n; ++i)
    if (fine.coarser[i] == none) merge(i, i);

  std::vector<std::tuple<std::uint32_t, std::uint32_t, float>> edges;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t e = fine.starts[i]; e < fine.starts[i + 1]; ++e)
      if (fine.coarser[i] != fine.coarser[fine.list[e]])
        edges.emplace_back(fine.coarser[i], fine.coarser[fine.list[e]], fine.weights[e]);
  std::sort(edges.begin(), edges.end());
  level.starts.assign(level.sites.size() + 1, 0);
  for (std::size_t e = 0; e < edges.size();) {
    const auto [a, b, w] = edges[e];
    float weight = 0.f;
    for (; e < edges.size() && std::get<0>(edges[e]) == a && std::get<1>(edges[e]) == b; ++e)
      weight += std::get<2>(edges[e]);
    level.list.push_back(b), level.weights.push_back(weight),
        level.starts[a + 1] = std::uint32_t(level.list.size());
  }
  for (std::size_t i = 1; i < level.starts.size(); ++i)
    level.starts[i] = std::max(level.starts[i], level.starts[i - 1]);
  return level;
}

}  // namespace

Waves waves(const Level& level) {
  const std::size_t n = level.sites.size();
  std::vector<std::uint32_t> wave(n, 0);
  Waves result{{0}, std::vector<std::uint32_t>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint32_t e = level.starts[i]; e < level.starts[i + 1] && level.list[e] < i; ++e)
      wave[i] = std::max(wave[i], wave[level.list[e]] + 1);
    if (wave[i] + 2 > result.starts.size()) result.starts.resize(wave[i] + 2, 0);
    ++result.starts[wave[i] + 1];
  }
  std::partial_sum(result.starts.begin(), result.starts.end(), result.starts.begin());
  std::vector<std::uint32_t> next = result.starts;
  for (std::uint32_t i = 0; i < n; ++i) result.sites[next[wave[i]]++] = i;
  return result;
}

Lattice::Lattice(Level finest) {
  levels_.push_back(std::move(finest));
  while (levels_.back().sites.size() > 64 && levels_.size() < 40) {
    Level next = coarser(levels_.back());
    if (next.sites.size() == levels_.back().sites.size()) break;
    levels_.push_back(std::move(next));
  }
  for (const Level& level : levels_) waves_.push_back(waves(level));
}

const Level& Lattice::settle(std::span<const double> spacings) {
  for (std::size_t i = 0; i < spacings.size(); ++i) levels_[0].sites[i].spacing = spacings[i];
  for (std::size_t l = 1; l < levels_.size(); ++l)
    for (std::size_t i = 0; i < levels_[l].sites.size(); ++i) {
      LatticeSite& site = levels_[l].sites[i];
      const auto [one, other] = levels_[l].parts[i];
      const LatticeSite &a = levels_[l - 1].sites[one], &b = levels_[l - 1].sites[other];
      const double area = a.area + b.area;
      site.spacing = one == other ? a.spacing : (a.area / area) * a.spacing + (b.area / area) * b.spacing;
    }
  for (LatticeSite& site : levels_.back().sites) site.point = site.at;
  constexpr int rounds = 8;
  for (std::size_t l = levels_.size(); l-- > 0;) {
    Level& level = levels_[l];
    if (l + 1 < levels_.size())
      parallel_for(level.sites.size(), 1024, [&](std::size_t i) {
        LatticeSite& site = level.sites[i];
        const Place from = levels_[l + 1].sites[level.coarser[i]].point;
        Place point = from - site.normal * site.normal.dot(from - site.at);
        hold_to_line(site, point);
        site.point = site.rounded(point, site.at);
      });
    cortex::settle(level, waves_[l], rounds);
  }
  return levels_.front();
}

Eigen::Vector2i step_between(const LatticeSite& a, const LatticeSite& b) {
  const Agreement agreed = agree(a, a.point, b, b.point);
  const int x = agreed.from_other.x(), y = agreed.from_other.y();
  const std::array<Place, 4> arms{b.along, b.up(), -b.along, -b.up()};
  const std::array<Eigen::Vector2i, 4> turned{Eigen::Vector2i{x, y}, {y, -x}, {-x, -y}, {-y, x}};
  std::size_t best = 0;
  for (std::size_t k = 1; k < 4; ++k)
    if (arms[k].dot(a.along) > arms[best].dot(a.along)) best = k;
  return agreed.from_one - turned[best];
}

}  // namespace forest::cortex
