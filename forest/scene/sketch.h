// SPDX-License-Identifier: Apache-2.0
// How the branches of a neuron are drawn with fewer and fewer segments: what two clusters draw becomes what their parent does
// (cluster.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/frame/layout.h"
#include "forest/reports/layout.h"
#include "forest/scene/order.h"

namespace forest::scene {

/// A run of vertices of one section, or of several joined end to end where nothing else leaves.
struct Strip {
  std::uint32_t first = 0, count = 0;  // its vertices
  std::uint32_t kind = 0, rank = 0;
  float mean = 0.f;                          // radius of its branch
  std::array<float, order_count> appears{};  // from which magnification on it shows, pixels a µm
  std::uint32_t begin = 0, end = 0;          // nodes of the neuron it runs between
};

/// A cluster while it is made: its strips and the sphere around all original points below it.
struct Draft {
  std::uint32_t first_strip = 0, strip_count = 0;
  Sphere sphere;
  float error = 0.f;
  std::uint32_t leaf_first = 0, leaf_count = 0;  // original segments
  std::uint32_t first_leaf = 0, last_leaf = 0;   // leaf drafts below, [first, last)
  std::uint32_t outgrowth = 0;                   // of a leaf, as Cluster::outgrowth
  std::int64_t children[2] = {-1, -1};
};

/// Everything drawn of a neuron: first that of the leaves, in their order, then the coarser.
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

/// Where many points are: x, y and z apart, so that many can be computed with side by side.
struct Coordinates {
  std::vector<float> x, y, z;

  explicit Coordinates(std::span<const Vec4> vertices);
};

/// Which leaf drafts touch a node: none before the first, none after the last.
struct Touching {
  std::uint32_t first = ~std::uint32_t(0), last = 0;
};

/// What two clusters draw, on its way to at most `limit` segments. It is small, so all of it lies in arrays and sets of
/// bits; a node of the neuron has a number of its own here.
class Sketch {
 public:
  static constexpr std::size_t limit = frame::cluster_size;
  /// One for all merges of a neuron; both must outlive it.
  /// @param touching  of every node of the neuron
  Sketch(const Drawing& drawing, std::span<const Touching> touching)
      : drawing_(drawing), touching_(touching), numbers_(touching.size(), unnumbered) {}

  /// What neighbours draw, anew.
  void take(const Draft& a, const Draft& b);

  std::uint32_t segment_count() const { return now_->vertex_count - now_->line_count; }

  /// Fewer and fewer segments until they are `limit` at most.
  void coarsen(float tolerance);

  /// Adds the strips to the drawing, which is that of all of it, and tells the draft which they are.
  void write(Drawing& drawing, Draft& draft) const;

  /// The greatest distance of an original point, of [begin, end), to what is drawn, if it is greater than `worst`. The points
  /// are asked, since the sum of the tolerances of all levels would be several times too large; they follow one another along
  /// the branches, so that most find what is near enough where those before did.
  float measured_error(const Coordinates& originals, std::size_t begin, std::size_t end, float worst) const;

 private:
  static constexpr std::uint8_t none = 255, unnumbered = 255;
  static constexpr std::uint32_t most_lines = 2 * limit, most_vertices = 2 * most_lines,
                                 most_nodes = 2 * most_lines;
  static_assert(most_lines <= 64 && most_nodes < unnumbered);
  struct Line : Strip {
    float reach = 0.f;  // the greatest distance of a vertex from the first
  };
  template <class T>
  using OfVertices = std::array<T, most_vertices + 4>;  // read in fours

  struct Lines {
    std::uint32_t line_count = 0, vertex_count = 0;
    std::array<Line, most_lines> lines;
    OfVertices<float> x, y, z, radius, weight;
    OfVertices<reports::Place> places;

    void copy(std::uint32_t to, const Lines& other, std::uint32_t from) {
      x[to] = other.x[from], y[to] = other.y[from], z[to] = other.z[from], radius[to] = other.radius[from];
      weight[to] = other.weight[from], places[to] = other.places[from];
    }
  };

  struct Nodes {  // a set of them
    std::array<std::uint64_t, most_nodes / 64> bits{};

    bool has(std::uint32_t node) const { return bits[node / 64] >> node % 64 & 1; }
    void add(std::uint32_t node) { bits[node / 64] |= 1ull << node % 64; }
  };
  struct Links {
    std::uint64_t swallowed = 0;                // lines that follow another
    std::array<std::uint8_t, most_lines> next;  // the line that follows, or none
  };

  float distance(std::uint32_t a, std::uint32_t b) const;

  float area() const;
  float area(const Line& line) const;

  // Which lines follow one another through a node at which nothing else begins or ends, here or outside.
  void link(Links& links) const;

  // Makes `now_` of the lines that it was, joined; add(lines, v) puts in what was vertex v.
  template <class Add>
  void gather(const Links& links, Add&& add);

  void join(float least_weight);

  // How far its vertices reach, and their weights: the tolerances (squared) below which Douglas & Peucker (1973) keep them.
  // Where they split does not depend on the tolerance, so that once is enough for all: a vertex stays when it and all at
  // which was split before deviate by more. What weighs no more than `least` counts as nothing.
  void measure(Line& line, float least);

  std::uint32_t heavier(float weight) const;

  // Drops what nothing follows, here or outside, and what reaches no further than the tolerance, whatever was dropped at
  // its end before included. Returns the tolerance up to which nothing more can be dropped.
  float drop_tips(float tolerance);

  // A soma with very many stems: what joins two clusters cannot be simplified away. The largest lines stay.
  void keep_largest();

  // Leaves the vertices of lines for which stays(line, vertex); lines that lose all of them go.
  template <class Stays>
  void keep(Stays&& stays);

  const Drawing& drawing_;
  std::span<const Touching> touching_;
  std::vector<std::uint8_t> numbers_;  // of the neuron's nodes, all `unnumbered` between two merges
  std::array<Lines, 2> lines_;
  Lines *now_ = &lines_[0], *old_ = &lines_[1];  // what is gathered comes from the one into the other
  std::uint32_t node_count_ = 0;
  std::array<std::uint32_t, most_nodes> nodes_;  // the neuron's numbers of them
  Nodes outside_;
  std::array<float, most_nodes>
      dropped_reach_;  // how far what was dropped there reached; negative where nothing was
};

}  // namespace forest::scene
