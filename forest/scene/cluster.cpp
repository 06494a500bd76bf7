// SPDX-License-Identifier: Apache-2.0
// The cluster tree follows the idea of hierarchical clusters with locked borders (Karis et al. 2021, "Nanite: a deep
// dive", and meshoptimizer's clusterlod) carried over from triangles to branches.
#include "forest/scene/cluster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>

#include "forest/core/half.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/soma_shape.h"

namespace forest::scene {
namespace {

constexpr std::size_t limit = frame::cluster_size;
constexpr float first_tolerance = .05f;  // µm
constexpr float tolerance_step = 1.3f;
constexpr float hopeless = 1e4f;  // µm; no neuron needs a larger tolerance
constexpr float widest = 3.f;     // a coarse segment is at most this many times as thick as the original

using Four = Eigen::Array4f;  // computed side by side

// A run of vertices of one section, or of several joined end to end where nothing else leaves.
struct Strip {
  std::uint32_t first = 0, count = 0;  // its vertices
  std::uint32_t kind = 0, rank = 0;
  float mean = 0.f;                  // radius of its branch
  float appears = 0.f;               // from which magnification on it shows, pixels a µm
  std::uint32_t begin = 0, end = 0;  // nodes of the neuron it runs between
};

// A cluster while it is made: its strips and the sphere around all original points below it.
struct Draft {
  std::uint32_t first_strip = 0, strip_count = 0;
  Sphere sphere;
  float error = 0.f;
  std::uint32_t leaf_first = 0, leaf_count = 0;  // original segments
  std::uint32_t first_leaf = 0, last_leaf = 0;   // leaf drafts below, [first, last)
  std::uint32_t outgrowth = 0;                   // of a leaf, as Cluster::outgrowth
  std::int64_t children[2] = {-1, -1};
};

// Everything drawn of a neuron: first that of the leaves, in their order, then the coarser.
struct Drawing {
  std::vector<Vec4> vertices;  // x, y, z, radius; where a leaf is cut off the next begins with the same one
  std::vector<reports::Place> places;  // of each; where sections join: the end of the first
  std::vector<Strip> strips;
  std::vector<Draft> drafts;

  std::span<const Strip> strips_of(const Draft& d) const {
    return std::span(strips).subspan(d.first_strip, d.strip_count);
  }
  std::uint32_t segment_count(const Draft& d) const {
    std::uint32_t count = 0;
    for (const Strip& s : strips_of(d)) count += s.count - 1;
    return count;
  }
  std::span<const Vec4> vertices_of(const Draft& first, const Draft& last) const {
    const Strip &a = strips[first.first_strip], &b = strips[last.first_strip + last.strip_count - 1];
    return std::span(vertices).subspan(a.first, b.first + b.count - a.first);
  }
};

Sphere around(const Sphere& a, const Sphere& b) {
  const Vec3 between = b.centre - a.centre;
  const float distance = between.norm();
  if (distance + b.radius <= a.radius) return a;
  if (distance + a.radius <= b.radius) return b;
  const float radius = .5f * (distance + a.radius + b.radius);
  return {a.centre + between * ((radius - a.radius) / distance), radius};
}

Sphere around(std::span<const Vec4> vertices) {
  Vec4 low = vertices[0], high = low;
  for (const Vec4& v : vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
  Sphere sphere{.5f * (low + high).head<3>(), 0.f};
  for (const Vec4& v : vertices)
    sphere.radius = std::max(sphere.radius, (v.head<3>() - sphere.centre).norm() + v.w());
  return sphere;
}

// What two clusters draw, on its way to at most `limit` segments. It is small, so all of it lies in arrays and sets of
// bits; a node of the neuron has a number of its own here.
class Sketch {
 public:
  static constexpr std::uint8_t unnumbered = 255;

  // `outside(node)`: whether anything else of the neuron touches it. `numbers`: of the neuron's nodes, scratch.
  template <class Outside>
  Sketch(const Drawing& drawing, const Draft& a, const Draft& b, Outside&& outside,
         std::vector<std::uint8_t>& numbers) {
    for (const Draft* d : {&a, &b})
      for (const Strip& s : drawing.strips_of(*d)) {
        Line& line = lines_[line_count_++];
        static_cast<Strip&>(line) = s;
        for (std::uint32_t* node : {&line.begin, &line.end}) {
          std::uint8_t& number = numbers[*node];
          if (number == unnumbered) {
            number = std::uint8_t(node_count_);
            if (outside(*node)) outside_.add(node_count_);
            nodes_[node_count_++] = *node;
          }
          *node = number;
        }
      }
    for (std::uint32_t i = 0; i < node_count_; ++i) numbers[nodes_[i]] = unnumbered;
    Links links;
    link(links);
    gather(links, [&](std::uint32_t from) {
      const Vec4& v = drawing.vertices[from];
      x_[vertex_count_] = v.x(), y_[vertex_count_] = v.y(), z_[vertex_count_] = v.z();
      radius_[vertex_count_] = v.w();
      places_[vertex_count_++] = drawing.places[from];
    });
  }

  std::uint32_t segment_count() const { return vertex_count_ - line_count_; }

  // Fewer and fewer segments until they are `limit` at most.
  void coarsen(float tolerance) {
    const float before = area();
    std::fill_n(dropped_reach_.begin(), node_count_, -1.f);
    for (std::uint32_t i = 0; i < line_count_; ++i) measure(lines_[i], tolerance * tolerance);
    for (float next_tip = 0.f;; tolerance *= tolerance_step) {
      if (tolerance >= next_tip) next_tip = drop_tips(tolerance);
      if (heavier(tolerance * tolerance) - line_count_ <= limit || tolerance > hopeless) break;
    }
    keep([&, least = tolerance * tolerance](std::uint32_t, std::uint32_t v) { return weight_[v] > least; });
    if (segment_count() > limit) keep_largest();
    const float after = area();
    const float widening = after > 0.f ? std::clamp(before / after, 1.f, widest) : 1.f;
    for (std::uint32_t i = 0; i < line_count_; ++i) {
      Line& line = lines_[i];
      if (line.kind == 1) continue;
      for (std::uint32_t v = line.first; v < line.first + line.count; ++v)
        radius_[v] = std::min(radius_[v] * widening, radius_[v] + tolerance);
    }
  }

  // Adds the strips to the drawing, and tells the draft which they are.
  void write(Drawing& drawing, Draft& draft) const {
    draft.first_strip = std::uint32_t(drawing.strips.size());
    draft.strip_count = line_count_;
    const auto first = std::uint32_t(drawing.vertices.size());
    for (std::uint32_t i = 0; i < line_count_; ++i) {
      Strip strip = lines_[i];
      strip.first += first;
      strip.begin = nodes_[strip.begin], strip.end = nodes_[strip.end];
      drawing.strips.push_back(strip);
    }
    for (std::uint32_t v = 0; v < vertex_count_; ++v)
      drawing.vertices.emplace_back(x_[v], y_[v], z_[v], radius_[v]);
    drawing.places.insert(drawing.places.end(), places_.begin(), places_.begin() + vertex_count_);
  }

  // The greatest distance of a point to what is drawn, if it is greater than `worst`. The original points below are asked,
  // since the sum of the tolerances of all levels would be several times too large; they follow one another along the
  // branches, so that most find what is near enough where the one before did.
  float measured_error(std::span<const Vec4> points, float worst) const {
    struct Group {  // four segments
      Four x, y, z, dx, dy, dz, inverse;

      [[gnu::always_inline]] Four squared_distance(const Vec4& point) const {
        const Four px = point.x() - x, py = point.y() - y, pz = point.z() - z;
        const Four at = ((px * dx + py * dy + pz * dz) * inverse).max(0.f).min(1.f);
        return (px - at * dx).square() + (py - at * dy).square() + (pz - at * dz).square();
      }
    };
    std::array<Group, limit / 4> groups;
    std::uint32_t count = 0;
    const auto set = [&](std::uint32_t a, std::uint32_t b) {
      Group& g = groups[count / 4];
      const std::uint32_t i = count++ % 4;
      g.x[i] = x_[a], g.y[i] = y_[a], g.z[i] = z_[a];
      g.dx[i] = x_[b] - x_[a], g.dy[i] = y_[b] - y_[a], g.dz[i] = z_[b] - z_[a];
    };
    for (std::uint32_t i = 0; i < line_count_; ++i)
      for (std::uint32_t v = lines_[i].first + 1; v < lines_[i].first + lines_[i].count; ++v) set(v - 1, v);
    while (count % 4) set(vertex_count_ - 1, vertex_count_ - 1);
    const std::uint32_t group_count = count / 4;
    for (Group& g : std::span(groups).first(group_count)) {
      const Four squared = g.dx.square() + g.dy.square() + g.dz.square();
      g.inverse = (squared > 0.f).select(squared.inverse(), 0.f);
    }
    float worst_squared = worst * worst;
    std::uint32_t near = 0;  // the segment that is asked first
    for (std::size_t i = 0; i < points.size();) {
      const std::size_t end = std::min(i + 4, points.size());
      if (end == i + 4) {  // four points to one segment, and to the next few, as the branch goes on
        Mat4 four = Eigen::Map<const Mat4>(points[i].data());
        four.transposeInPlace();
        Four squared = Four::Constant(INFINITY);
        bool all = false;
        for (const std::uint32_t beyond = std::min(near + 4, count); near < beyond && !all; ++near) {
          const Group& g = groups[near / 4];
          const std::uint32_t n = near % 4;
          const float dx = g.dx[n], dy = g.dy[n], dz = g.dz[n];
          const Four px = four.col(0).array() - g.x[n], py = four.col(1).array() - g.y[n],
                     pz = four.col(2).array() - g.z[n];
          const Four at = ((px * dx + py * dy + pz * dz) * g.inverse[n]).max(0.f).min(1.f);
          squared = squared.min((px - at * dx).square() + (py - at * dy).square() + (pz - at * dz).square());
          all = (squared <= worst_squared).all();
        }
        --near;
        if (all) {
          i = end;
          continue;
        }
      }
      for (; i < end; ++i) {  // one point to four segments; they follow one another as the points do
        std::uint32_t at = near / 4;
        Four squared = groups[at].squared_distance(points[i]);
        float nearest = squared.minCoeff();
        for (std::uint32_t asked = 1, g = at; asked < group_count && nearest > worst_squared; ++asked) {
          g = g + 1 < group_count ? g + 1 : 0;
          const Four other = groups[g].squared_distance(points[i]);
          if (const float least = other.minCoeff(); least < nearest) nearest = least, squared = other, at = g;
        }
        near = 4 * at;
        while (near % 4 < 3 && squared[near % 4] != nearest) ++near;
        worst_squared = std::max(worst_squared, nearest);
      }
    }
    return std::sqrt(worst_squared);
  }

 private:
  static constexpr std::uint32_t most_lines = 2 * limit, most_vertices = 2 * most_lines,
                                 most_nodes = 2 * most_lines;
  static_assert(most_lines <= 64 && most_nodes < unnumbered);
  struct Line : Strip {
    float reach = 0.f;  // the greatest distance of a vertex from the first
  };
  template <class T>
  using OfVertices = std::array<T, most_vertices + 4>;  // read in fours

  struct Nodes {  // a set of them
    std::array<std::uint64_t, most_nodes / 64> bits{};

    bool has(std::uint32_t node) const { return bits[node / 64] >> node % 64 & 1; }
    void add(std::uint32_t node) { bits[node / 64] |= 1ull << node % 64; }
  };
  struct Links {
    std::uint64_t swallowed = 0;                // lines that follow another
    std::array<std::uint8_t, most_lines> next;  // the line that follows, or none
  };
  static constexpr std::uint8_t none = 255;

  float distance(std::uint32_t a, std::uint32_t b) const {
    const float x = x_[a] - x_[b], y = y_[a] - y_[b], z = z_[a] - z_[b];
    return std::sqrt(x * x + y * y + z * z);
  }

  float area() const {
    float sum = 0.f;
    for (std::uint32_t i = 0; i < line_count_; ++i) sum += area(lines_[i]);
    return sum;
  }
  float area(const Line& line) const {
    Four sum = Four::Zero();
    for (std::uint32_t v = line.first + 1, end = line.first + line.count; v < end; v += 4) {
      const auto rise = [v](const OfVertices<float>& list) {
        return Four(Eigen::Map<const Four>(&list[v]) - Eigen::Map<const Four>(&list[v - 1]));
      };
      const Four radii = Eigen::Map<const Four>(&radius_[v]) + Eigen::Map<const Four>(&radius_[v - 1]);
      const Four of = (rise(x_).square() + rise(y_).square() + rise(z_).square()).sqrt() * radii;
      sum += (Four(0.f, 1.f, 2.f, 3.f) < float(end - v)).select(of, 0.f);
    }
    return sum.sum();
  }

  // Which lines follow one another through a node at which nothing else begins or ends, here or outside.
  void link(Links& links) const {
    Nodes begun, begun_again, ended, ended_again;
    std::array<std::uint8_t, most_nodes> beginner;
    for (std::uint32_t i = 0; i < line_count_; ++i) {
      const Line& line = lines_[i];
      (begun.has(line.begin) ? begun_again : begun).add(line.begin);
      (ended.has(line.end) ? ended_again : ended).add(line.end);
      beginner[line.begin] = std::uint8_t(i);
    }
    for (std::uint32_t i = 0; i < line_count_; ++i) {
      const std::uint32_t node = lines_[i].end;
      links.next[i] = none;
      if (!begun.has(node) || begun_again.has(node) || ended_again.has(node) || outside_.has(node)) continue;
      const std::uint8_t follower = beginner[node];
      if (follower == i || lines_[follower].kind != lines_[i].kind) continue;
      links.next[i] = follower;
      links.swallowed |= 1ull << follower;
    }
  }

  // Sets the lines anew, joined; add(v) puts in what was vertex v.
  template <class Add>
  void gather(const Links& links, Add&& add) {
    std::array<Line, most_lines> old;
    const std::uint32_t count = line_count_;
    std::copy_n(lines_.begin(), count, old.begin());
    line_count_ = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (links.swallowed >> i & 1) continue;
      Line& line = lines_[line_count_++];
      line = old[i];
      line.first = vertex_count_;
      for (std::uint32_t v = old[i].first; v < old[i].first + old[i].count; ++v) add(v);
      for (std::uint8_t n = links.next[i]; n != none; n = links.next[n]) {
        const Line& more = old[n];
        for (std::uint32_t v = more.first + 1; v < more.first + more.count; ++v) add(v);
        line.end = more.end;
        if (more.appears < line.appears)
          line.appears = more.appears, line.rank = more.rank, line.mean = more.mean;
      }
      if (links.next[i] != none) line.reach = -1.f;  // not known
      line.count = vertex_count_ - line.first;
    }
  }

  void join(float least_weight) {
    Links links;
    link(links);
    if (!links.swallowed) return;
    const auto old = [count = vertex_count_](const auto& list) {
      std::remove_cvref_t<decltype(list)> copy;
      std::copy_n(list.begin(), count, copy.begin());
      return copy;
    };
    const auto x = old(x_), y = old(y_), z = old(z_), radius = old(radius_), weight = old(weight_);
    const auto places = old(places_);
    vertex_count_ = 0;
    gather(links, [&](std::uint32_t from) {
      x_[vertex_count_] = x[from], y_[vertex_count_] = y[from], z_[vertex_count_] = z[from];
      radius_[vertex_count_] = radius[from];
      weight_[vertex_count_] = weight[from];
      places_[vertex_count_++] = places[from];
    });
    for (std::uint32_t i = 0; i < line_count_; ++i)
      if (lines_[i].reach < 0.f) measure(lines_[i], least_weight);
  }

  // How far its vertices reach, and their weights: the tolerances (squared) below which Douglas & Peucker (1973) keep them.
  // Where they split does not depend on the tolerance, so that once is enough for all: a vertex stays when it and all at
  // which was split before deviate by more. What weighs no more than `least` counts as nothing.
  void measure(Line& line, float least) {
    const std::uint32_t begin = line.first, end = line.first + line.count - 1;
    weight_[begin] = weight_[end] = INFINITY;
    if (line.count == 2) {
      line.reach = distance(begin, end);
      return;
    }
    float reach = 0.f;
    for (std::uint32_t v = begin + 1; v <= end; ++v) {
      const float x = x_[v] - x_[begin], y = y_[v] - y_[begin], z = z_[v] - z_[begin];
      reach = std::max(reach, x * x + y * y + z * z);
    }
    line.reach = std::sqrt(reach);
    std::array<std::pair<std::uint32_t, std::uint32_t>, most_vertices> open;
    std::size_t waiting = 0;
    open[waiting++] = {begin, end};
    OfVertices<float> deviation;
    while (waiting) {
      const auto [a, b] = open[--waiting];
      if (b - a < 2) continue;
      const float dx = x_[b] - x_[a], dy = y_[b] - y_[a], dz = z_[b] - z_[a], dr = radius_[b] - radius_[a];
      const float squared = dx * dx + dy * dy + dz * dz, inverse = squared > 0.f ? 1.f / squared : 0.f;
      for (std::uint32_t v = a + 1; v < b; v += 4) {
        const auto four = [v](const OfVertices<float>& list) {
          return Four(Eigen::Map<const Four>(&list[v]));
        };
        const Four x = four(x_) - x_[a], y = four(y_) - y_[a], z = four(z_) - z_[a],
                   r = four(radius_) - radius_[a];
        const Four at = ((x * dx + y * dy + z * dz) * inverse).max(0.f).min(1.f);
        Eigen::Map<Four> out(&deviation[v]);
        out = ((x - at * dx).square() + (y - at * dy).square() + (z - at * dz).square())
                  .max((r - at * dr).square());
      }
      const std::uint32_t split =
          std::uint32_t(std::max_element(&deviation[a + 1], &deviation[b]) - deviation.data());
      // The lighter end of the range is the one at which was split to come to it.
      const float weight = std::min({deviation[split], weight_[a], weight_[b]});
      if (!(weight > least)) {
        std::fill(&weight_[a + 1], &weight_[b], 0.f);
        continue;
      }
      weight_[split] = weight;
      open[waiting++] = {a, split};
      open[waiting++] = {split, b};
    }
  }

  std::uint32_t heavier(float weight) const {
    std::int32_t count = 0;
    for (std::uint32_t v = 0; v < vertex_count_; ++v) count += weight_[v] > weight;
    return std::uint32_t(count);
  }

  // Drops what nothing follows, here or outside, and what reaches no further than the tolerance, whatever was dropped at
  // its end before included. Returns the tolerance up to which nothing more can be dropped.
  float drop_tips(float tolerance) {
    while (line_count_ > 1) {
      Nodes open = outside_;  // where something goes on
      for (std::uint32_t i = 0; i < line_count_; ++i) open.add(lines_[i].begin);
      std::uint64_t dropped = 0;
      float next = INFINITY;
      for (std::uint32_t i = 0; i < line_count_; ++i) {
        const Line& line = lines_[i];
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
      if (std::uint32_t(std::popcount(dropped)) == line_count_) dropped &= ~1ull;
      if (!dropped) return next;
      keep([&](std::uint32_t i, std::uint32_t) { return !(dropped >> i & 1); });
      join(tolerance * tolerance);
    }
    return INFINITY;
  }

  // A soma with very many stems: what joins two clusters cannot be simplified away. The largest lines stay.
  void keep_largest() {
    std::array<std::pair<float, std::uint32_t>, most_lines> order;
    for (std::uint32_t i = 0; i < line_count_; ++i) order[i] = {-area(lines_[i]), i};
    std::sort(order.begin(), order.begin() + line_count_);
    std::uint64_t stays = 0;
    std::uint32_t room = limit;
    for (std::uint32_t i = 0; i < line_count_ && lines_[order[i].second].count - 1 <= room; ++i) {
      room -= lines_[order[i].second].count - 1;
      stays |= 1ull << order[i].second;
    }
    keep([&](std::uint32_t i, std::uint32_t) { return stays >> i & 1; });
  }

  // Leaves the vertices of lines for which stays(line, vertex); lines that lose all of them go.
  template <class Stays>
  void keep(Stays&& stays) {
    std::uint32_t lines = 0, vertices = 0;
    for (std::uint32_t i = 0; i < line_count_; ++i) {
      Line line = lines_[i];
      const std::uint32_t first = vertices;
      for (std::uint32_t v = line.first; v < line.first + line.count; ++v) {
        if (!stays(i, v)) continue;
        x_[vertices] = x_[v], y_[vertices] = y_[v], z_[vertices] = z_[v];
        radius_[vertices] = radius_[v];
        places_[vertices] = places_[v];
        weight_[vertices++] = weight_[v];
      }
      line.first = first, line.count = vertices - first;
      if (line.count) lines_[lines++] = line;
    }
    line_count_ = lines, vertex_count_ = vertices;
  }

  std::uint32_t line_count_ = 0, vertex_count_ = 0, node_count_ = 0;
  std::array<Line, most_lines> lines_;
  OfVertices<float> x_, y_, z_, radius_, weight_;
  OfVertices<reports::Place> places_;
  std::array<std::uint32_t, most_nodes> nodes_;  // the neuron's numbers of them
  Nodes outside_;
  std::array<float, most_nodes>
      dropped_reach_;  // how far what was dropped there reached; negative where nothing was
};

// What a cluster says of the segments it draws.
struct Drawn {
  float thickness = 0.f;
  std::array<std::uint8_t, limit> appears{};
  std::array<Sphere, Cluster::group_count> groups;
};

// Half way along the branches from one place to another, which lies on the same section or grows out of it.
struct Middle {
  std::span<const Section> sections;
  std::vector<float> lengths;  // of sections

  reports::Place operator()(const reports::Place& from, const reports::Place& to) const {
    if (to.section == soma_section || from.section == soma_section) return to;
    if (from.section == to.section) return {to.section, .5f * (from.position + to.position)};
    const auto parent = [&](std::uint32_t s) { return sections[s].parent; };
    float way = lengths[to.section] * to.position;
    for (SectionId s = parent(to.section); s.valid(); s = parent(s.value())) {
      const bool there = s.value() == from.section;
      way += lengths[s.value()] * (there ? 1.f - from.position : 1.f);
      if (there) break;
    }
    way *= .5f;
    reports::Place at = to;
    for (float here = lengths[to.section] * to.position; way > here; here = lengths[at.section]) {
      const SectionId before = parent(at.section);
      if (!before.valid() || at.section == from.section) return {at.section, 0.f};
      way -= here;
      at = {std::uint32_t(before.value()), 1.f};
    }
    return {at.section, std::clamp(at.position - way / std::max(lengths[at.section], 1e-9f), 0.f, 1.f)};
  }
};

// Writes the segments of a draft, their places with them.
Drawn emit(const Drawing& drawing, const Draft& draft, const Middle& middle, ClusterTree& out) {
  Drawn drawn;
  constexpr std::uint32_t size = Cluster::group_size;
  constexpr float half_a_step = 1.044f;
  std::array<Vec4, Cluster::group_count> low, high;
  low.fill(Vec4::Constant(INFINITY)), high.fill(Vec4::Constant(-INFINITY));
  std::uint32_t count = 0;
  for (const Strip& s : drawing.strips_of(draft)) {
    const std::uint32_t meta = s.kind | s.rank << 8 | to_half(s.mean) << 16;
    const std::uint8_t appears = Cluster::step_of(s.appears * half_a_step);
    const Vec4* a = &drawing.vertices[s.first];
    std::uint32_t radius = to_half(a->w());
    for (std::uint32_t i = s.first + 1; i < s.first + s.count; ++i, ++count) {
      const Vec4& b = drawing.vertices[i];
      const std::uint32_t next_radius = to_half(b.w());
      out.segments.push_back({a->x(), a->y(), a->z(), radius | next_radius << 16, b.x(), b.y(), b.z(), meta});
      out.places[out.segments.size() - 1] = middle(drawing.places[i - 1], drawing.places[i]);
      const float thickest = std::max(a->w(), b.w());
      if (*a != b) drawn.thickness = std::max(drawn.thickness, thickest);  // the soma itself is chosen apart
      drawn.appears[count] = appears;
      Vec4 &l = low[count / size], &h = high[count / size];
      l = l.cwiseMin(*a).cwiseMin(b), h = h.cwiseMax(*a).cwiseMax(b);
      a = &b;
      radius = next_radius;
    }
  }
  for (std::uint32_t g = 0; g * size < count; ++g)
    drawn.groups[g] = {.5f * (low[g] + high[g]).head<3>(), 0.f};
  count = 0;
  for (const Strip& s : drawing.strips_of(draft))
    for (std::uint32_t i = s.first + 1; i < s.first + s.count; ++i, ++count) {
      Sphere& sphere = drawn.groups[count / size];
      const auto reach = [&](const Vec4& v) {
        sphere.radius = std::max(sphere.radius, (v.head<3>() - sphere.centre).norm() + v.w());
      };
      if (i == s.first + 1 || count % size == 0)
        reach(drawing.vertices[i - 1]);  // else it was the last one's end
      reach(drawing.vertices[i]);
    }
  return drawn;
}

// Of every section, as section_length and section_area have them, found together.
struct Sizes {
  std::vector<double> lengths, areas;
};

Sizes sizes_of(const Morphology& m) {
  Sizes sizes;
  for (const Section& s : m.sections()) {
    const auto points = m.points().subspan(s.first_point, s.point_count);
    double length = 0., area = 0.;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double along = segment_length(points[i - 1], points[i]);
      const double taper = double(points[i].radius) - points[i - 1].radius;
      length += along;
      area += std::numbers::pi * (double(points[i - 1].radius) + points[i].radius) *
              std::sqrt(along * along + taper * taper);
    }
    sizes.lengths.push_back(length), sizes.areas.push_back(area);
  }
  return sizes;
}

std::vector<std::uint32_t> branch_numbers(const Morphology& m, std::span<const double> lengths) {
  const std::size_t count = m.sections().size();
  std::vector<double> below(count);        // longest path from the start of the section to a tip
  std::vector<std::uint32_t> heir(count);  // the daughter it runs through
  for (std::size_t i = count; i-- > 0;) {
    double longest = 0.;
    for (const SectionId child : m.children(SectionId(i)))
      if (const double way = below[child.value()]; way > longest || !heir[i])
        longest = way, heir[i] = child.value();
    below[i] = lengths[i] + longest;
  }
  // Every section that does not continue its parent's longest path begins a branch of its own.
  std::vector<std::uint32_t> starts, branch_start(count), numbers(count);
  for (std::size_t i = 0; i < count; ++i) {
    const SectionId parent = m.sections()[i].parent;
    const bool continues = parent.valid() && heir[parent.value()] == i;
    branch_start[i] = continues ? branch_start[parent.value()] : std::uint32_t(i);
    if (!continues) starts.push_back(std::uint32_t(i));
  }
  std::ranges::stable_sort(starts, [&](std::uint32_t a, std::uint32_t b) { return below[a] > below[b]; });
  std::vector<std::uint32_t> number_of(count);
  for (std::uint32_t n = 0; n < starts.size(); ++n) number_of[starts[n]] = n;
  for (std::size_t i = 0; i < count; ++i) numbers[i] = number_of[branch_start[i]];
  return numbers;
}

// How the branches of a neuron are ordered, and how thick they are; of every section.
struct Branches {
  std::vector<std::uint32_t> numbers;
  std::vector<std::uint32_t>
      ranks;                 // the share of the neuron's length in branches of smaller number, in 256ths
  std::vector<float> means;  // radius along the branch; never more than that of the branch it leaves
  // The magnification from which on it shows, pixels a µm, where the thinnest lines are one pixel wide: when its mean width
  // reaches its rank, or something of it, or of what grows out of it, is half as wide again. Never before the branch it leaves.
  std::vector<float> appears;
};

Branches branches_of(const Morphology& m) {
  const std::size_t sections = m.sections().size();
  const Sizes sizes = sizes_of(m);
  Branches branches{branch_numbers(m, sizes.lengths), {}, {}, std::vector<float>(sections)};
  const auto& numbers = branches.numbers;
  std::vector<double> lengths(sections + 1), means(sections);  // of branches; lengths of all before
  for (std::size_t i = 0; i < sections; ++i) {
    lengths[numbers[i] + 1] += sizes.lengths[i];
    means[numbers[i]] += sizes.areas[i] / (2. * std::numbers::pi);
  }
  for (std::size_t n = 0; n < sections; ++n) means[n] /= std::max(lengths[n + 1], 1e-9);
  // A branch that is thicker than the one it leaves must not be seen without it.
  for (std::size_t i = 0; i < sections; ++i)
    if (const SectionId parent = m.section(SectionId(i)).parent; parent.valid())
      means[numbers[i]] = std::min(means[numbers[i]], means[numbers[parent.value()]]);
  std::partial_sum(lengths.begin(), lengths.end(), lengths.begin());
  const double total = std::max(lengths.back(), 1e-9);
  for (const std::uint32_t number : numbers) {
    branches.ranks.push_back(std::uint32_t(std::min(255., 256. * lengths[number] / total)));
    branches.means.push_back(float(means[number]));
  }
  constexpr float never_left_out = 1.5f, wide = 2.f * float(FOREST_MEAN_STRETCH);  // widths; of radii
  std::vector<float> thickest(sections);
  for (std::size_t i = sections; i-- > 0;) {  // parents come first
    for (const Point& p : m.points(SectionId(i))) thickest[i] = std::max(thickest[i], p.radius);
    if (const SectionId parent = m.section(SectionId(i)).parent; parent.valid())
      thickest[parent.value()] = std::max(thickest[parent.value()], thickest[i]);
    branches.appears[i] =
        std::min((float(branches.ranks[i]) + .5f) / (256.f * wide * std::max(branches.means[i], 1e-6f)),
                 .5f * never_left_out / std::max(thickest[i], 1e-6f));
  }
  return branches;
}

// The leaves: depth first, the longest path first, so that a run of segments follows a branch; runs of at most `limit` segments,
// sections cut where a leaf is full. Node 0 is the soma, node s + 1 the end of section s; nodes beyond are where a section is
// cut.
class Leaves {
 public:
  Leaves(const Morphology& m, Drawing& drawing)
      : m_(m),
        drawing_(drawing),
        soma_(m.soma().sphere()),
        origin_(soma_.position()),
        branches_(branches_of(m)),
        ways_(m.sections().size()),
        nodes_(std::uint32_t(m.sections().size() + 1)) {
    if (m.soma().kind == SomaKind::none && !m.points().empty()) origin_ = m.points()[0].position();
    const std::size_t guess = m.points().size() + m.sections().size();
    drawing.vertices.reserve(3 * guess), drawing.places.reserve(3 * guess);
    drawing.strips.reserve(3 * m.sections().size());
    add_soma();
    std::vector<SectionId> open(m.roots().rbegin(), m.roots().rend());
    while (!open.empty()) {
      const SectionId id = open.back();
      open.pop_back();
      if (!m.section(id).parent.valid()) add_stem(vertex(m.points(id).front()));
      add_section(id);
      const auto next = m.children(id);
      open.insert(open.end(), next.begin(), next.end());
      std::sort(open.end() - std::ptrdiff_t(next.size()), open.end(), [&](SectionId a, SectionId b) {
        return branches_.numbers[a.value()] > branches_.numbers[b.value()];
      });
    }
  }

  std::uint32_t nodes() const { return nodes_; }
  std::uint32_t segments() const { return segments_; }
  std::vector<float> ways() && { return std::move(ways_); }  // along the points of each section

 private:
  Vec4 vertex(const Point& p) const {
    return {p.x - origin_.x(), p.y - origin_.y(), p.z - origin_.z(), p.radius};
  }
  std::uint32_t here() const { return std::uint32_t(drawing_.vertices.size()); }
  void put(const Vec4& v) {
    drawing_.vertices.push_back(v);
    drawing_.places.emplace_back();
  }

  // The strip runs over the last vertices of the drawing, from `run.first` on.
  void add(Strip run) {
    auto& drafts = drawing_.drafts;
    const std::uint32_t last = here() - 1, end = run.end;
    while (run.first < last) {
      if (filled_ == limit) {
        drafts.push_back(
            {.first_strip = std::uint32_t(drawing_.strips.size()), .sphere = {}, .leaf_first = segments_});
        filled_ = 0;
      }
      const auto take = std::min(std::uint32_t(limit - filled_), last - run.first);
      run.count = take + 1;
      run.end = run.first + take == last ? end : nodes_++;
      drawing_.strips.push_back(run);
      ++drafts.back().strip_count;
      drafts.back().leaf_count += take;
      segments_ += take;
      filled_ += take;
      run.first += take;
      run.begin = run.end;
    }
  }

  void add_soma() {
    if (!(soma_.radius > 0.f)) return;
    const auto shape = soma_shape(m_.soma());
    Vec4 ball = vertex(soma_);
    float room = .1f * ball.w();  // for a ball within the shape, that shall not stick out of it
    for (const auto& run : shape)
      for (std::size_t i = 1; i < run.size(); ++i) {
        const Vec4 a = vertex(run[i - 1]), way = vertex(run[i]) - a, to = ball - a;
        const float length = way.head<3>().squaredNorm();
        const float t = length > 0.f ? std::clamp(to.head<3>().dot(way.head<3>()) / length, 0.f, 1.f) : 0.f;
        room = std::max(room, a.w() + t * way.w() - (to - t * way).head<3>().norm());
      }
    if (!shape.empty()) ball.w() = std::min(ball.w(), room);
    put(ball), put(ball);
    add({.first = 0, .kind = 1});
    for (const auto& run : shape) {
      const std::uint32_t at = here();
      for (const Point& p : run) put(vertex(p));
      add({.first = at, .kind = 1});
    }
  }

  // A cone from inside the soma to where a stem begins, when that is near enough to belong there.
  void add_stem(const Vec4& first) {
    const float gap = first.head<3>().norm(), inside = .3f * soma_.radius;
    if (!(soma_.radius > 0.f && gap < 6.f * soma_.radius && gap > inside)) return;
    Vec4 start;
    start << first.head<3>() / gap * inside,
        std::clamp(2.2f * first.w(), .2f * soma_.radius, .75f * soma_.radius);
    const std::uint32_t at = here();
    put(start), put(first);
    add({.first = at, .kind = 1});
  }

  void add_section(SectionId id) {
    const auto points = m_.points(id);
    if (points.size() < 2) return;
    const Section& section = m_.section(id);
    const std::uint32_t begin = here();
    drawing_.vertices.resize(begin + points.size()), drawing_.places.resize(begin + points.size());
    const auto vertices = std::span(drawing_.vertices).subspan(begin);
    const auto places = std::span(drawing_.places).subspan(begin);
    float way = 0.f;
    for (std::size_t i = 0; i < points.size(); ++i) {
      vertices[i] = vertex(points[i]);
      if (i) way += (vertices[i] - vertices[i - 1]).head<3>().norm();
      places[i] = {id.value(), way};
    }
    for (reports::Place& place : places) place.position = way > 0.f ? place.position / way : .5f;
    ways_[id.value()] = way;
    add({.first = begin,
         .kind = std::uint32_t(section.kind),
         .rank = branches_.ranks[id.value()],
         .mean = branches_.means[id.value()],
         .appears = branches_.appears[id.value()],
         .begin = section.parent.valid() ? section.parent.value() + 1 : 0,
         .end = id.value() + 1});
  }

  const Morphology& m_;
  Drawing& drawing_;
  Point soma_;
  Vec3 origin_;
  Branches branches_;
  std::vector<float> ways_;
  std::uint32_t nodes_, segments_ = 0;
  std::size_t filled_ = limit;  // segments of the last leaf
};

// From the first to the last leaf that touches a node.
struct Touching {
  std::uint32_t first = 0xffffffffu, last = 0;
};

// Finds the spheres of the leaves, which of them touch each node, and how far what grows out of each goes.
std::vector<Touching> surround(Drawing& drawing, std::uint32_t nodes) {
  auto& leaves = drawing.drafts;
  std::vector<Touching> touching(nodes);
  for (std::uint32_t i = 0; i < leaves.size(); ++i) {
    Draft& d = leaves[i];
    d.first_leaf = i, d.last_leaf = i + 1;
    d.sphere = around(drawing.vertices_of(d, d));
    for (const Strip& s : drawing.strips_of(d))
      for (const std::uint32_t node : {s.begin, s.end})
        touching[node] = {std::min(touching[node].first, i), std::max(touching[node].last, i)};
  }
  for (std::uint32_t i = 0; i < leaves.size(); ++i)
    for (const Strip& s : drawing.strips_of(leaves[i])) {
      const std::uint32_t from = touching[s.begin].first;
      if (s.begin == 0 || from == i) continue;
      // The largest cluster that holds it and not what it grows out of: see merge.
      const auto level = std::uint32_t(std::bit_width(from ^ i)) - 1;
      const auto end = std::min(((i >> level) + 1) << level, std::uint32_t(leaves.size()));
      leaves[from].outgrowth = std::max(leaves[from].outgrowth, end - from - 1);
    }
  return touching;
}

// Merges neighbours in pairs, level by level, until one is left.
void merge(Drawing& drawing, std::uint32_t nodes) {
  auto& drafts = drawing.drafts;
  const std::vector<Touching> touching = surround(drawing, nodes);
  std::vector<std::uint8_t> numbers_in_sketch(nodes, Sketch::unnumbered);
  const auto merged = [&](std::uint32_t left, std::uint32_t right) {
    const Draft &a = drafts[left], &b = drafts[right];
    const auto outside = [&](std::uint32_t node) {  // nothing is joined through the soma
      return node == 0 || touching[node].first < a.first_leaf || touching[node].last >= b.last_leaf;
    };
    Sketch sketch(drawing, a, b, outside, numbers_in_sketch);
    float error = std::max(a.error, b.error);
    if (sketch.segment_count() > limit) sketch.coarsen(std::max(first_tolerance, .5f * error));
    error = sketch.measured_error(drawing.vertices_of(drafts[a.first_leaf], drafts[b.last_leaf - 1]), error);
    Draft parent{.sphere = around(a.sphere, b.sphere),
                 .error = error,
                 .leaf_first = a.leaf_first,
                 .leaf_count = a.leaf_count + b.leaf_count,
                 .first_leaf = a.first_leaf,
                 .last_leaf = b.last_leaf,
                 .children = {left, right}};
    sketch.write(drawing, parent);
    return parent;
  };
  std::vector<std::uint32_t> level(drafts.size());
  std::iota(level.begin(), level.end(), 0u);
  while (level.size() > 1) {
    std::vector<std::uint32_t> above;
    for (std::size_t i = 0; i + 1 < level.size(); i += 2) {
      above.push_back(std::uint32_t(drafts.size()));
      drafts.push_back(merged(level[i], level[i + 1]));
    }
    if (level.size() % 2) above.push_back(level.back());
    level = std::move(above);
  }
}

// As the forest file has them: leaf segments first and in order, then the coarser ones; clusters root first.
void write(const Drawing& drawing, const Middle& middle, ClusterTree& tree) {
  const auto& drafts = drawing.drafts;
  const std::size_t count = drafts.size();
  std::size_t segments = 0;
  for (const Draft& d : drafts) segments += drawing.segment_count(d);
  tree.segments.reserve(segments), tree.places.resize(segments);
  std::vector<Drawn> drawn(count);
  std::vector<std::uint32_t> first(count);
  for (std::size_t i = 0; i < count; ++i) {
    first[i] = std::uint32_t(tree.segments.size());
    drawn[i] = emit(drawing, drafts[i], middle, tree);
  }
  tree.section.reserve(tree.original_count);
  for (std::uint32_t i = 0; i < tree.original_count; ++i) tree.section.push_back(tree.places[i].section);
  tree.clusters.reserve(count);
  const auto index = [&](std::int64_t draft) {
    return draft < 0 ? 0u : std::uint32_t(count - 1 - std::size_t(draft));
  };
  for (std::size_t i = count; i-- > 0;) {
    const Draft& d = drafts[i];
    const Sphere sphere{d.sphere.centre, d.sphere.radius + d.error};
    Cluster c{.x = sphere.centre.x(),
              .y = sphere.centre.y(),
              .z = sphere.centre.z(),
              .radius = sphere.radius,
              .error = d.error,
              .thickness = drawn[i].thickness,
              .first_segment = first[i],
              .segment_count = drawing.segment_count(d) & 255u,
              .outgrowth = std::min(d.outgrowth, Cluster::no_end) & Cluster::no_end,
              .children = {index(d.children[0]), index(d.children[1])},
              .leaf_first = d.leaf_first,
              .leaf_count = d.leaf_count};
    std::ranges::transform(drawn[i].groups, c.groups,
                           [&](const Sphere& g) { return packed_group(g, sphere); });
    std::ranges::copy(drawn[i].appears, c.appears);
    tree.clusters.push_back(c);
  }
}

}  // namespace

std::vector<std::uint32_t> branch_numbers(const Morphology& m) {
  return branch_numbers(m, sizes_of(m).lengths);
}

ClusterTree build_clusters(const Morphology& m) {
  Drawing drawing;
  Leaves leaves(m, drawing);
  ClusterTree tree;
  tree.soma_radius = m.soma().sphere().radius;
  tree.original_count = leaves.segments();
  if (drawing.drafts.empty()) return tree;
  merge(drawing, leaves.nodes());
  write(drawing, {m.sections(), std::move(leaves).ways()}, tree);
  return tree;
}

}  // namespace forest::scene
