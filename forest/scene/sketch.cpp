// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/sketch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>
#include <utility>

#include "forest/core/clones.h"

namespace forest::scene {
namespace {

constexpr float tolerance_step = 1.3f;
constexpr float hopeless = 1e4f;  // µm; no neuron needs a larger tolerance
constexpr float widest = 3.f;     // a coarse segment is at most this many times as thick as the original

using Four = Eigen::Array4f;  // computed side by side

// What is drawn, as distances to it are computed.
struct Pieces {
  struct Piece {
    float x, y, z, dx, dy, dz, inverse;
  };
  std::array<Piece, Sketch::limit> list;
  std::uint32_t count = 0;

  void add(float ax, float ay, float az, float bx, float by, float bz) {
    const float dx = bx - ax, dy = by - ay, dz = bz - az;
    const float squared = dx * dx + dy * dy + dz * dz;
    list[count++] = {ax, ay, az, dx, dy, dz, squared > 0.f ? 1.f / squared : 0.f};
  }
};

// The greatest squared distance of the points [begin, end) to the nearest piece, or `worst`. Many points are asked together, of
// one piece after another, from where those before were near to: until all are nearer than the worst so far.
FOREST_CLONES float farthest(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                             std::size_t begin, std::size_t end, const Pieces& pieces, float worst) {
  constexpr std::size_t lanes = 16;
  constexpr std::uint32_t at_once = 4;
  std::uint32_t next = 0;
  for (std::size_t i = begin; i < end; i += lanes) {
    const std::size_t at = std::min(i, end - lanes);  // the last ones: some of those before once more
    float least[lanes], most = INFINITY;
    for (float& l : least) l = INFINITY;
    for (std::uint32_t asked = 0; asked < pieces.count && most > worst; asked += at_once) {
      for (std::uint32_t k = 0; k < at_once; ++k) {
        const Pieces::Piece& p = pieces.list[next];
        next = next + 1 < pieces.count ? next + 1 : 0;
        FOREST_LANES for (std::size_t l = 0; l < lanes; ++l) {
          const float px = x[at + l] - p.x, py = y[at + l] - p.y, pz = z[at + l] - p.z;
          const float along = (px * p.dx + py * p.dy + pz * p.dz) * p.inverse;
          const float way = along > 0.f ? along < 1.f ? along : 1.f : 0.f;
          const float ox = px - way * p.dx, oy = py - way * p.dy, oz = pz - way * p.dz;
          const float squared = ox * ox + oy * oy + oz * oz;
          least[l] = squared < least[l] ? squared : least[l];
        }
      }
      std::int32_t bits = 0;  // none is negative: they are in the order of their bits
      FOREST_LANES for (std::size_t l = 0; l < lanes; ++l) {
        const auto own = std::bit_cast<std::int32_t>(least[l]);
        bits = own > bits ? own : bits;
      }
      most = std::bit_cast<float>(bits);
    }
    if (most > worst) worst = most;
    next = next >= at_once ? next - at_once : 0;
  }
  return worst;
}

FOREST_CLONES std::int32_t count_above(const float* values, std::size_t count, float limit) {
  std::int32_t above = 0;
  for (std::size_t i = 0; i < count; ++i) above += values[i] > limit;
  return above;
}

}  // namespace

void Sketch::take(const Draft& a, const Draft& b) {
  const auto outside = [&](std::uint32_t node) {  // nothing is joined through the soma
    return node == 0 || touching_[node].first < a.first_leaf || touching_[node].last >= b.last_leaf;
  };
  now_->line_count = node_count_ = 0;
  outside_ = {};
  for (const Draft* d : {&a, &b})
    for (const Strip& s : drawing_.strips_of(*d)) {
      Line& line = now_->lines[now_->line_count++];
      line = {s};
      for (std::uint32_t* node : {&line.begin, &line.end}) {
        std::uint8_t& number = numbers_[*node];
        if (number == unnumbered) {
          number = std::uint8_t(node_count_);
          if (outside(*node)) outside_.add(node_count_);
          nodes_[node_count_++] = *node;
        }
        *node = number;
      }
    }
  for (std::uint32_t i = 0; i < node_count_; ++i) numbers_[nodes_[i]] = unnumbered;
  Links links;
  link(links);
  gather(links, [&](Lines& to, std::uint32_t from) {
    const Vec4& v = drawing_.vertices[from];
    const std::uint32_t at = to.vertex_count++;
    to.x[at] = v.x(), to.y[at] = v.y(), to.z[at] = v.z(), to.radius[at] = v.w();
    to.places[at] = drawing_.places[from];
  });
}

void Sketch::coarsen(float tolerance) {
  const float before = area();
  std::fill_n(dropped_reach_.begin(), node_count_, -1.f);
  for (std::uint32_t i = 0; i < now_->line_count; ++i) measure(now_->lines[i], tolerance * tolerance);
  for (float next_tip = 0.f;; tolerance *= tolerance_step) {
    if (tolerance >= next_tip) next_tip = drop_tips(tolerance);
    if (heavier(tolerance * tolerance) - now_->line_count <= limit || tolerance > hopeless) break;
  }
  keep(
      [&, least = tolerance * tolerance](std::uint32_t, std::uint32_t v) { return now_->weight[v] > least; });
  if (segment_count() > limit) keep_largest();
  const float after = area();
  const float widening = after > 0.f ? std::clamp(before / after, 1.f, widest) : 1.f;
  for (std::uint32_t i = 0; i < now_->line_count; ++i) {
    Line& line = now_->lines[i];
    if (line.kind == 1) continue;
    for (std::uint32_t v = line.first; v < line.first + line.count; ++v)
      now_->radius[v] = std::min(now_->radius[v] * widening, now_->radius[v] + tolerance);
  }
}

void Sketch::write(Drawing& drawing, Draft& draft) const {
  const Lines& now = *now_;
  draft.first_strip = std::uint32_t(drawing.strips.size());
  draft.strip_count = now.line_count;
  const auto first = std::uint32_t(drawing.vertices.size());
  for (std::uint32_t i = 0; i < now.line_count; ++i) {
    Strip strip = now.lines[i];
    strip.first += first;
    strip.begin = nodes_[strip.begin], strip.end = nodes_[strip.end];
    drawing.strips.push_back(strip);
  }
  for (std::uint32_t v = 0; v < now.vertex_count; ++v)
    drawing.vertices.emplace_back(now.x[v], now.y[v], now.z[v], now.radius[v]);
  drawing.places.insert(drawing.places.end(), now.places.begin(), now.places.begin() + now.vertex_count);
}

Coordinates::Coordinates(std::span<const Vec4> vertices)
    : x(vertices.size()), y(vertices.size()), z(vertices.size()) {
  for (std::size_t i = 0; i < vertices.size(); ++i)
    x[i] = vertices[i].x(), y[i] = vertices[i].y(), z[i] = vertices[i].z();
}

float Sketch::measured_error(const Coordinates& originals, std::size_t begin, std::size_t end,
                             float worst) const {
  const Lines& now = *now_;
  Pieces pieces;
  for (std::uint32_t i = 0; i < now.line_count; ++i)
    for (std::uint32_t v = now.lines[i].first + 1; v < now.lines[i].first + now.lines[i].count; ++v)
      pieces.add(now.x[v - 1], now.y[v - 1], now.z[v - 1], now.x[v], now.y[v], now.z[v]);
  return std::sqrt(farthest(originals.x.data(), originals.y.data(), originals.z.data(), begin, end, pieces,
                            worst * worst));
}

float Sketch::distance(std::uint32_t a, std::uint32_t b) const {
  const Lines& now = *now_;
  const float x = now.x[a] - now.x[b], y = now.y[a] - now.y[b], z = now.z[a] - now.z[b];
  return std::sqrt(x * x + y * y + z * z);
}

float Sketch::area() const {
  float sum = 0.f;
  for (std::uint32_t i = 0; i < now_->line_count; ++i) sum += area(now_->lines[i]);
  return sum;
}

float Sketch::area(const Line& line) const {
  const Lines& now = *now_;
  Four sum = Four::Zero();
  for (std::uint32_t v = line.first + 1, end = line.first + line.count; v < end; v += 4) {
    const auto rise = [v](const OfVertices<float>& list) {
      return Four(Eigen::Map<const Four>(&list[v]) - Eigen::Map<const Four>(&list[v - 1]));
    };
    const Four radii = Eigen::Map<const Four>(&now.radius[v]) + Eigen::Map<const Four>(&now.radius[v - 1]);
    const Four of = (rise(now.x).square() + rise(now.y).square() + rise(now.z).square()).sqrt() * radii;
    sum += (Four(0.f, 1.f, 2.f, 3.f) < float(end - v)).select(of, 0.f);
  }
  return sum.sum();
}

void Sketch::link(Links& links) const {
  const Lines& now = *now_;
  Nodes begun, begun_again, ended, ended_again;
  std::array<std::uint8_t, most_nodes> beginner;
  for (std::uint32_t i = 0; i < now.line_count; ++i) {
    const Line& line = now.lines[i];
    (begun.has(line.begin) ? begun_again : begun).add(line.begin);
    (ended.has(line.end) ? ended_again : ended).add(line.end);
    beginner[line.begin] = std::uint8_t(i);
  }
  for (std::uint32_t i = 0; i < now.line_count; ++i) {
    const std::uint32_t node = now.lines[i].end;
    links.next[i] = none;
    if (!begun.has(node) || begun_again.has(node) || ended_again.has(node) || outside_.has(node)) continue;
    const std::uint8_t follower = beginner[node];
    if (follower == i || now.lines[follower].kind != now.lines[i].kind) continue;
    links.next[i] = follower;
    links.swallowed |= 1ull << follower;
  }
}

template <class Add>
void Sketch::gather(const Links& links, Add&& add) {
  std::swap(now_, old_);
  const auto& old = old_->lines;
  Lines& now = *now_;
  now.line_count = now.vertex_count = 0;
  for (std::uint32_t i = 0; i < old_->line_count; ++i) {
    if (links.swallowed >> i & 1) continue;
    Line& line = now.lines[now.line_count++];
    line = old[i];
    line.first = now.vertex_count;
    for (std::uint32_t v = old[i].first; v < old[i].first + old[i].count; ++v) add(now, v);
    for (std::uint8_t n = links.next[i]; n != none; n = links.next[n]) {
      const Line& more = old[n];
      for (std::uint32_t v = more.first + 1; v < more.first + more.count; ++v) add(now, v);
      line.end = more.end;
      if (more.appears[0] < line.appears[0]) line.rank = more.rank, line.mean = more.mean;
      for (std::size_t o = 0; o < order_count; ++o)
        line.appears[o] = std::min(line.appears[o], more.appears[o]);
    }
    if (links.next[i] != none) line.reach = -1.f;  // not known
    line.count = now.vertex_count - line.first;
  }
}

void Sketch::join(float least_weight) {
  Links links;
  link(links);
  if (!links.swallowed) return;
  gather(links,
         [&from = *now_](Lines& to, std::uint32_t vertex) { to.copy(to.vertex_count++, from, vertex); });
  for (std::uint32_t i = 0; i < now_->line_count; ++i)
    if (now_->lines[i].reach < 0.f) measure(now_->lines[i], least_weight);
}

void Sketch::measure(Line& line, float least) {
  Lines& now = *now_;
  const std::uint32_t begin = line.first, end = line.first + line.count - 1;
  now.weight[begin] = now.weight[end] = INFINITY;
  if (line.count == 2) {
    line.reach = distance(begin, end);
    return;
  }
  float reach = 0.f;
  for (std::uint32_t v = begin + 1; v <= end; ++v) {
    const float x = now.x[v] - now.x[begin], y = now.y[v] - now.y[begin], z = now.z[v] - now.z[begin];
    reach = std::max(reach, x * x + y * y + z * z);
  }
  line.reach = std::sqrt(reach);
  struct Range {
    std::uint32_t a, b;
  };
  std::array<Range, most_vertices> open;
  std::size_t waiting = 0;
  open[waiting++] = {begin, end};
  OfVertices<float> deviation;
  while (waiting) {
    const auto [a, b] = open[--waiting];
    if (b - a < 2) continue;
    const float dx = now.x[b] - now.x[a], dy = now.y[b] - now.y[a], dz = now.z[b] - now.z[a],
                dr = now.radius[b] - now.radius[a];
    const float squared = dx * dx + dy * dy + dz * dz, inverse = squared > 0.f ? 1.f / squared : 0.f;
    // Of one vertex as of four side by side.
    const auto deviate = [&](auto x, auto y, auto z, auto r) {
      const auto clamped = [](auto along) {
        if constexpr (std::is_same_v<decltype(along), float>)
          return std::clamp(along, 0.f, 1.f);
        else
          return Four(along.max(0.f).min(1.f));
      };
      using T = decltype(x);
      const T at = clamped(T((x * dx + y * dy + z * dz) * inverse));
      const T ox = x - at * dx, oy = y - at * dy, oz = z - at * dz, other = r - at * dr;
      return std::pair(T(ox * ox + oy * oy + oz * oz), T(other * other));
    };
    std::uint32_t split = a + 1;
    if (b - a == 2) {  // of most lines
      const auto [away, thicker] = deviate(now.x[split] - now.x[a], now.y[split] - now.y[a],
                                           now.z[split] - now.z[a], now.radius[split] - now.radius[a]);
      deviation[split] = std::max(away, thicker);
    } else {
      for (std::uint32_t v = a + 1; v < b; v += 4) {
        const auto four = [v](const OfVertices<float>& list, float from) {
          return Four(Eigen::Map<const Four>(&list[v]) - from);
        };
        const auto [away, thicker] = deviate(four(now.x, now.x[a]), four(now.y, now.y[a]),
                                             four(now.z, now.z[a]), four(now.radius, now.radius[a]));
        Eigen::Map<Four> out(&deviation[v]);
        out = away.max(thicker);
      }
      split = std::uint32_t(std::max_element(&deviation[a + 1], &deviation[b]) - deviation.data());
    }
    // The lighter end of the range is the one at which was split to come to it.
    const float weight = std::min({deviation[split], now.weight[a], now.weight[b]});
    if (!(weight > least)) {
      std::fill(&now.weight[a + 1], &now.weight[b], 0.f);
      continue;
    }
    now.weight[split] = weight;
    open[waiting++] = {a, split};
    open[waiting++] = {split, b};
  }
}

std::uint32_t Sketch::heavier(float weight) const {
  return std::uint32_t(count_above(now_->weight.data(), now_->vertex_count, weight));
}

float Sketch::drop_tips(float tolerance) {
  while (now_->line_count > 1) {
    Nodes open = outside_;  // where something goes on
    for (std::uint32_t i = 0; i < now_->line_count; ++i) open.add(now_->lines[i].begin);
    std::uint64_t dropped = 0;
    float next = INFINITY;
    for (std::uint32_t i = 0; i < now_->line_count; ++i) {
      const Line& line = now_->lines[i];
      if (line.kind == 1 || open.has(line.end)) continue;
      float reach = line.reach;
      if (const float below = dropped_reach_[line.end]; below >= 0.f)
        reach = std::max(reach, below + distance(line.first + line.count - 1, line.first));
      if (reach > tolerance) {
        next = std::min(next, reach);
        continue;
      }
      dropped |= 1ull << i;
      dropped_reach_[line.begin] = std::max(dropped_reach_[line.begin], reach);
    }
    if (std::uint32_t(std::popcount(dropped)) == now_->line_count) dropped &= ~1ull;
    if (!dropped) return next;
    keep([&](std::uint32_t i, std::uint32_t) { return !(dropped >> i & 1); });
    join(tolerance * tolerance);
  }
  return INFINITY;
}

void Sketch::keep_largest() {
  const Lines& now = *now_;
  std::array<std::pair<float, std::uint32_t>, most_lines> order;
  for (std::uint32_t i = 0; i < now.line_count; ++i) order[i] = {-area(now.lines[i]), i};
  std::sort(order.begin(), order.begin() + now.line_count);
  std::uint64_t stays = 0;
  std::uint32_t room = limit;
  for (std::uint32_t i = 0; i < now.line_count && now.lines[order[i].second].count - 1 <= room; ++i) {
    room -= now.lines[order[i].second].count - 1;
    stays |= 1ull << order[i].second;
  }
  keep([&](std::uint32_t i, std::uint32_t) { return stays >> i & 1; });
}

template <class Stays>
void Sketch::keep(Stays&& stays) {
  Lines& now = *now_;
  std::uint32_t lines = 0, vertices = 0;
  for (std::uint32_t i = 0; i < now.line_count; ++i) {
    Line line = now.lines[i];
    const std::uint32_t first = vertices;
    for (std::uint32_t v = line.first; v < line.first + line.count; ++v)
      if (stays(i, v)) now.copy(vertices++, now, v);
    line.first = first, line.count = vertices - first;
    if (line.count) now.lines[lines++] = line;
  }
  now.line_count = lines, now.vertex_count = vertices;
}

}  // namespace forest::scene
