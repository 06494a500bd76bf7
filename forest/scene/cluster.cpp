// SPDX-License-Identifier: Apache-2.0
// The cluster tree follows the idea of hierarchical clusters with locked borders (Karis et al. 2021, "Nanite: a deep
// dive", and meshoptimizer's clusterlod) carried over from triangles to branches.
#include "forest/scene/cluster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>
#include <utility>

#include "forest/core/half.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/soma_shape.h"
#include "forest/scene/sketch.h"

namespace forest::scene {
namespace {

constexpr std::size_t limit = Sketch::limit;
constexpr float first_tolerance = .05f;  // µm

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

// What a cluster says of the segments it draws.
struct Drawn {
  float thickness = 0.f;
  std::uint8_t appears[order_count][limit] = {};
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
    std::array<std::uint8_t, order_count> appears;
    for (std::size_t o = 0; o < order_count; ++o) appears[o] = Cluster::step_of(s.appears[o] * half_a_step);
    const Vec4* a = &drawing.vertices[s.first];
    std::uint32_t radius = to_half(a->w());
    for (std::uint32_t i = s.first + 1; i < s.first + s.count; ++i, ++count) {
      const Vec4& b = drawing.vertices[i];
      const std::uint32_t next_radius = to_half(b.w());
      out.segments.push_back({a->x(), a->y(), a->z(), radius | next_radius << 16, b.x(), b.y(), b.z(), meta});
      out.places[out.segments.size() - 1] = middle(drawing.places[i - 1], drawing.places[i]);
      const float thickest = std::max(a->w(), b.w());
      if (*a != b) drawn.thickness = std::max(drawn.thickness, thickest);  // the soma itself is chosen apart
      for (std::size_t o = 0; o < order_count; ++o) drawn.appears[o][count] = appears[o];
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
  std::vector<std::uint32_t> ranks;  // how far back in the first order, 256ths
  std::vector<float> means;          // radius along the branch; never more than that of the branch it leaves
  // The magnification from which on it shows, pixels a µm, where the thinnest lines are one pixel wide: when those before it in the
  // order, drawn so, do not cover as much as all branches do as wide as they are; when it is as wide itself; or when something of
  // it, or of what grows out of it, is half as wide again. Never before the branch it leaves.
  std::vector<std::array<float, order_count>> appears;
};

// Where the branches lie when they are laid end to end in an order (order.h), µm: each at a part of its own length, which is
// another in every order and of every neuron, so that on the mean no more lie below any length than it holds.
// @param parents  of each branch, the one it leaves, which has a smaller number; itself where it leaves none
std::vector<double> places_of(std::span<const double> lengths, std::span<const std::uint32_t> parents,
                              double total, std::size_t order) {
  const std::size_t count = lengths.size();
  std::vector<std::uint32_t> lots(count), sorted(count);
  const std::uint32_t own = frame::forest_mixed(std::bit_cast<std::uint32_t>(float(total)));  // of the neuron
  for (std::uint32_t n = 0; n < count; ++n)
    lots[n] = std::max(frame::forest_mixed(own + std::uint32_t(n * order_count + order)), lots[parents[n]]);
  std::iota(sorted.begin(), sorted.end(), 0u);
  std::ranges::stable_sort(sorted, {}, [&](std::uint32_t n) { return lots[n]; });
  const double part = (double(order) + double(own) * 0x1p-32) / double(order_count);
  std::vector<double> places(count);
  double before = 0.;
  for (const std::uint32_t n : sorted) places[n] = before + part * lengths[n], before += lengths[n];
  return places;
}

Branches branches_of(const Morphology& m) {
  const std::size_t sections = m.sections().size();
  const Sizes sizes = sizes_of(m);
  Branches branches{
      branch_numbers(m, sizes.lengths), {}, {}, std::vector<std::array<float, order_count>>(sections)};
  const auto& numbers = branches.numbers;
  std::vector<double> lengths(sections), means(sections);  // of branches
  std::vector<std::uint32_t> parents(sections);            // … and what they leave
  std::iota(parents.begin(), parents.end(), 0u);
  for (std::size_t i = 0; i < sections; ++i) {
    lengths[numbers[i]] += sizes.lengths[i];
    means[numbers[i]] += sizes.areas[i] / (2. * std::numbers::pi);
    if (const SectionId parent = m.section(SectionId(i)).parent;
        parent.valid() && numbers[parent.value()] != numbers[i])
      parents[numbers[i]] = numbers[parent.value()];
  }
  for (std::size_t n = 0; n < sections; ++n) means[n] /= std::max(lengths[n], 1e-9);
  // A branch that is thicker than the one it leaves must not be seen without it.
  for (std::size_t i = 0; i < sections; ++i)
    if (const SectionId parent = m.section(SectionId(i)).parent; parent.valid())
      means[numbers[i]] = std::min(means[numbers[i]], means[numbers[parent.value()]]);
  constexpr float never_left_out = 1.5f;
  constexpr double wide = 2. * FOREST_MEAN_STRETCH;  // widths; of radii
  const double total = std::max(std::accumulate(lengths.begin(), lengths.end(), 0.), 1e-9),
               area = std::max(wide * std::inner_product(lengths.begin(), lengths.end(), means.begin(), 0.),
                               1e-9);
  std::array<std::vector<double>, order_count> places;
  for (std::size_t o = 0; o < order_count; ++o) places[o] = places_of(lengths, parents, total, o);
  std::vector<float> thickest(sections);
  for (std::size_t i = sections; i-- > 0;) {  // parents come first
    for (const Point& p : m.points(SectionId(i))) thickest[i] = std::max(thickest[i], p.radius);
    if (const SectionId parent = m.section(SectionId(i)).parent; parent.valid())
      thickest[parent.value()] = std::max(thickest[parent.value()], thickest[i]);
    const double as_wide = 1. / (wide * std::max(means[numbers[i]], 1e-6)),
                 much_wider = double(.5f * never_left_out / std::max(thickest[i], 1e-6f));
    for (std::size_t o = 0; o < order_count; ++o)
      branches.appears[i][o] = float(std::min({places[o][numbers[i]] / area, as_wide, much_wider}));
  }
  for (const std::uint32_t number : numbers) {
    branches.ranks.push_back(std::uint32_t(std::min(255., 256. * places[0][number] / total)));
    branches.means.push_back(float(means[number]));
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
    constexpr float hairline = .05f;  // µm: what was traced without a diameter is drawn all the same
    return {p.x - origin_.x(), p.y - origin_.y(), p.z - origin_.z(), std::max(p.radius, hairline)};
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
  const Coordinates originals(drawing.vertices);
  Sketch sketch(drawing, touching);
  const auto merged = [&](std::uint32_t left, std::uint32_t right) {
    const Draft &a = drafts[left], &b = drafts[right];
    sketch.take(a, b);
    float error = std::max(a.error, b.error);
    if (sketch.segment_count() > limit) sketch.coarsen(std::max(first_tolerance, .5f * error));
    const auto below = drawing.vertices_of(drafts[a.first_leaf], drafts[b.last_leaf - 1]);
    const auto first = std::size_t(below.data() - drawing.vertices.data());
    error = sketch.measured_error(originals, first, first + below.size(), error);
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
    std::memcpy(c.appears, drawn[i].appears, sizeof c.appears);
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
