// SPDX-License-Identifier: Apache-2.0
// The cluster tree follows the idea of hierarchical clusters with locked borders (Karis et al. 2021, "Nanite: a deep
// dive", and meshoptimizer's clusterlod) carried over from triangles to branches.
#include "forest/scene/cluster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>

#include "forest/geometry/polyline.h"
#include "forest/morphology/measure.h"

namespace forest::scene {
namespace {

constexpr std::size_t limit = frame::cluster_size;
constexpr float first_tolerance = .05f;  // µm
constexpr float tolerance_step = 1.3f;
constexpr float hopeless = 1e4f;  // µm; no neuron needs a larger tolerance
constexpr float widest = 3.f;     // a coarse segment is at most this many times as thick as the original

// A run of vertices of one section, or of several joined end to end where nothing else leaves.
struct Strip {
  std::vector<Vec4> vertices;          // x, y, z, radius
  std::vector<reports::Place> places;  // of each; where sections join: the end of the first
  std::uint32_t kind = 0, rank = 0;
  float mean = 0.f;                  // radius of its branch
  std::uint32_t begin = 0, end = 0;  // nodes of the neuron it runs between
  bool dropped = false;

  float length() const {
    float sum = 0.f;
    for (std::size_t i = 1; i < vertices.size(); ++i) sum += (vertices[i] - vertices[i - 1]).head<3>().norm();
    return sum;
  }
  float area() const {
    float sum = 0.f;
    for (std::size_t i = 1; i < vertices.size(); ++i)
      sum += (vertices[i] - vertices[i - 1]).head<3>().norm() * (vertices[i].w() + vertices[i - 1].w());
    return sum;
  }
};

std::size_t segment_count(const std::vector<Strip>& strips) {
  std::size_t count = 0;
  for (const Strip& s : strips) count += s.vertices.size() - 1;
  return count;
}

// A cluster while it is made: its strips and the sphere around all original points below it.
struct Draft {
  std::vector<Strip> strips;
  Sphere sphere;
  float error = 0.f;
  std::uint32_t leaf_first = 0, leaf_count = 0;  // original segments
  std::size_t first_leaf = 0, last_leaf = 0;     // leaf drafts below, [first, last)
  std::int64_t children[2] = {-1, -1};
};

Sphere around(const Sphere& a, const Sphere& b) {
  const Vec3 between = b.centre - a.centre;
  const float distance = between.norm();
  if (distance + b.radius <= a.radius) return a;
  if (distance + a.radius <= b.radius) return b;
  const float radius = .5f * (distance + a.radius + b.radius);
  return {a.centre + between * ((radius - a.radius) / distance), radius};
}

Sphere around(const std::vector<Strip>& strips) {
  Bounds bounds;
  for (const Strip& s : strips)
    for (const Vec4& v : s.vertices) bounds.add(v.head<3>());
  Sphere sphere{bounds.centre(), 0.f};
  for (const Strip& s : strips)
    for (const Vec4& v : s.vertices)
      sphere.radius = std::max(sphere.radius, (v.head<3>() - sphere.centre).norm() + v.w());
  return sphere;
}

// Joins strips that follow one another through a node at which nothing else begins or ends, neither among them nor
// outside: `outside_degree` counts, for every node of the neuron, the strips of other drafts that touch it.
void join(std::vector<Strip>& strips, const std::vector<std::uint32_t>& outside_degree) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> begins, ends;  // node, strip
  for (std::uint32_t i = 0; i < strips.size(); ++i) {
    begins.emplace_back(strips[i].begin, i);
    ends.emplace_back(strips[i].end, i);
  }
  std::ranges::sort(begins);
  std::ranges::sort(ends);
  const auto only = [](const auto& list, std::uint32_t node) -> std::int64_t {
    const auto first = std::ranges::lower_bound(list, std::pair(node, 0u));
    const auto at_node = [&](auto place) { return place != list.end() && place->first == node; };
    return at_node(first) && !at_node(first + 1) ? std::int64_t(first->second) : -1;
  };
  std::vector<std::uint32_t> into(strips.size());  // the strip that swallowed this one
  std::iota(into.begin(), into.end(), 0u);
  for (std::uint32_t i = 0; i < strips.size(); ++i) {
    Strip& next = strips[i];
    const std::int64_t before = only(ends, next.begin);
    if (outside_degree[next.begin] || before < 0 || only(begins, next.begin) != std::int64_t(i)) continue;
    std::uint32_t head = std::uint32_t(before);
    while (into[head] != head) head = into[head];
    Strip& previous = strips[head];
    if (head == i || previous.end != next.begin || previous.kind != next.kind) continue;
    previous.vertices.insert(previous.vertices.end(), next.vertices.begin() + 1, next.vertices.end());
    previous.places.insert(previous.places.end(), next.places.begin() + 1, next.places.end());
    previous.end = next.end;
    if (next.rank < previous.rank) previous.rank = next.rank, previous.mean = next.mean;
    next.dropped = true;
    into[i] = head;
  }
  std::erase_if(strips, [](const Strip& s) { return s.dropped; });
}

// One coarser version of `strips` within `tolerance` of them.
std::vector<Strip> coarsened(std::vector<Strip> strips, const std::vector<std::uint32_t>& outside_degree,
                             float tolerance) {
  // Tips first: a strip that nothing follows, within the draft or outside, and that reaches no further than the
  // tolerance, whatever was dropped at its end before included.
  const auto area_of = [](float sum, const Strip& s) { return sum + s.area(); };
  const float before = std::accumulate(strips.begin(), strips.end(), 0.f, area_of);
  std::map<std::uint32_t, float> dropped_reach;  // at a node
  for (bool again = true; again && strips.size() > 1;) {
    std::vector<std::uint32_t> begun;
    for (const Strip& s : strips) begun.push_back(s.begin);
    std::ranges::sort(begun);
    for (Strip& s : strips) {
      if (s.kind == 1 || outside_degree[s.end] || std::ranges::binary_search(begun, s.end)) continue;
      const Vec3 start = s.vertices.front().head<3>();
      const auto below = dropped_reach.find(s.end);
      float reach =
          below == dropped_reach.end() ? 0.f : below->second + (s.vertices.back().head<3>() - start).norm();
      for (const Vec4& v : s.vertices) reach = std::max(reach, (v.head<3>() - start).norm());
      if (!(s.dropped = reach <= tolerance)) continue;
      float& here = dropped_reach[s.begin];
      here = std::max(here, reach);
    }
    if (std::ranges::all_of(strips, [](const Strip& s) { return s.dropped; })) strips.front().dropped = false;
    again = std::erase_if(strips, [](const Strip& s) { return s.dropped; }) > 0;
    if (again) join(strips, outside_degree);
  }
  for (Strip& s : strips) {
    const auto kept = simplify(s.vertices, tolerance);
    std::vector<Vec4> vertices;
    std::vector<reports::Place> places;
    for (const std::uint32_t i : kept) vertices.push_back(s.vertices[i]), places.push_back(s.places[i]);
    s.vertices = std::move(vertices), s.places = std::move(places);
  }
  const float after = std::accumulate(strips.begin(), strips.end(), 0.f, area_of);
  const float widening = after > 0.f ? std::clamp(before / after, 1.f, widest) : 1.f;
  for (Strip& s : strips)
    if (s.kind != 1) {
      for (Vec4& v : s.vertices) v.w() = std::min(v.w() * widening, v.w() + tolerance);
      s.mean = std::min(s.mean * widening, s.mean + tolerance);
    }
  return strips;
}

// `outside_degree`: of what lies outside both drafts.
Draft parent_of(const Draft& a, const Draft& b, const std::vector<std::uint32_t>& outside_degree) {
  Draft parent;
  parent.strips = a.strips;
  parent.strips.insert(parent.strips.end(), b.strips.begin(), b.strips.end());
  parent.sphere = around(a.sphere, b.sphere);
  parent.leaf_first = a.leaf_first;
  parent.leaf_count = a.leaf_count + b.leaf_count;
  parent.first_leaf = a.first_leaf;
  parent.last_leaf = b.last_leaf;
  join(parent.strips, outside_degree);
  for (float tolerance = std::max(first_tolerance, .5f * std::max(a.error, b.error));
       segment_count(parent.strips) > limit; tolerance *= tolerance_step) {
    std::vector<Strip> candidate = coarsened(parent.strips, outside_degree, tolerance);
    if (tolerance > hopeless) {
      // A soma with very many stems: what joins two clusters cannot be simplified away. The largest strips stay.
      std::ranges::stable_sort(candidate, std::greater{}, &Strip::area);
      while (segment_count(candidate) > limit) candidate.pop_back();
    }
    if (segment_count(candidate) <= limit) parent.strips = std::move(candidate);
  }
  return parent;
}

// The greatest distance of an original point below to what is drawn instead of it. Measured, since the sum of the
// tolerances of all levels would be several times too large.
float measured_error(const std::vector<Strip>& strips, std::span<const Draft> leaves) {
  float worst = 0.f;
  for (const Draft& leaf : leaves)
    for (const Strip& original : leaf.strips)
      for (const Vec4& v : original.vertices) {
        const Vec3 point = v.head<3>();
        float nearest = INFINITY;
        for (const Strip& s : strips)
          for (std::size_t i = 1; i < s.vertices.size() && nearest > worst; ++i)
            nearest = std::min(
                nearest, distance_to_segment(point, s.vertices[i - 1].head<3>(), s.vertices[i].head<3>()));
        worst = std::max(worst, nearest);
      }
  return worst;
}

std::uint32_t half_pair(float a, float b) {
  const auto half = [](float value) {
    return std::uint32_t(Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(value)));
  };
  return half(a) | half(b) << 16;
}

// What a cluster says of the segments it draws.
struct Drawn {
  float thickness = 0.f;
  std::array<std::uint32_t, 8> visible{};
  std::array<Sphere, Cluster::group_count> groups;
};

// The magnification from which on a segment shows: see draw_line in render/opengl/shaders/common.glsl, where a line is
// drawn when it is a pixel wide, a diagonal one 1.42 times as wide, or its branch is wider than its rank.
float appears_at(const frame::Segment& s, float thickest, float mean) {
  constexpr float diagonal = 2.f * 1.42f;  // widths, of radii
  constexpr float on_the_mean = 2.f * float(FOREST_MEAN_STRETCH);
  return std::min(float(s.meta >> 8 & 255) / 256.f / (on_the_mean * std::max(mean, 1e-6f)),
                  1.f / (diagonal * std::max(thickest, 1e-6f)));
}

// Half way along the branches from one place to another, which lies on the same section or grows out of it.
struct Middle {
  const Morphology& morphology;
  std::vector<float> lengths;  // of sections

  reports::Place operator()(const reports::Place& from, const reports::Place& to) const {
    if (to.section == soma_section || from.section == soma_section) return to;
    if (from.section == to.section) return {to.section, .5f * (from.position + to.position)};
    const auto parent = [&](std::uint32_t s) { return morphology.sections()[s].parent; };
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
Drawn emit(const std::vector<Strip>& strips, const Middle& middle, ClusterTree& out) {
  Drawn drawn;
  std::array<Bounds, Cluster::group_count> bounds;
  std::uint32_t count = 0;
  const auto for_each = [&](auto&& body) {
    count = 0;
    for (const Strip& s : strips)
      for (std::size_t i = 1; i < s.vertices.size(); ++i, ++count)
        body(s, i, s.vertices[i - 1], s.vertices[i]);
  };
  for_each([&](const Strip& s, std::size_t i, const Vec4& a, const Vec4& b) {
    const frame::Segment segment{a.x(), a.y(), a.z(), half_pair(a.w(), b.w()),
                                 b.x(), b.y(), b.z(), s.kind | s.rank << 8 | half_pair(s.mean, 0.f) << 16};
    out.segments.push_back(segment);
    out.places.push_back(middle(s.places[i - 1], s.places[i]));
    if (a != b)
      drawn.thickness = std::max({drawn.thickness, a.w(), b.w()});  // the soma itself is chosen apart
    const float from =
        appears_at(segment, std::max(a.w(), b.w()), s.mean > 0.f ? s.mean : std::min(a.w(), b.w()));
    for (std::size_t step = 0; step < drawn.visible.size(); ++step)
      drawn.visible[step] |= std::uint32_t(from <= Cluster::magnifications[step]) << count;
    for (const Vec4* v : {&a, &b}) bounds[count / Cluster::group_size].add(v->head<3>());
  });
  for (std::size_t g = 0; g < bounds.size() && g * Cluster::group_size < count; ++g)
    drawn.groups[g] = {bounds[g].centre(), 0.f};
  for_each([&](const Strip&, std::size_t, const Vec4& a, const Vec4& b) {
    Sphere& sphere = drawn.groups[count / Cluster::group_size];
    for (const Vec4* v : {&a, &b})
      sphere.radius = std::max(sphere.radius, (v->head<3>() - sphere.centre).norm() + v->w());
  });
  return drawn;
}

// As Cluster::group unpacks it; never smaller than the sphere given.
std::uint32_t packed(const Sphere& sphere, const Sphere& of_cluster) {
  const float unit = std::max(of_cluster.radius, 1e-6f) / 127.f;
  std::uint32_t bits = 0;
  Vec3 centre;
  for (int i = 0; i < 3; ++i) {
    const float steps =
        std::clamp(std::round((sphere.centre[i] - of_cluster.centre[i]) / unit), -127.f, 127.f);
    bits |= (std::uint32_t(int(steps)) & 255u) << (8 * i);
    centre[i] = of_cluster.centre[i] + steps * unit;
  }
  const float radius = sphere.radius + (sphere.centre - centre).norm();
  return bits | std::uint32_t(std::clamp(std::ceil(radius * 1.0001f / unit), 0.f, 255.f)) << 24;
}

}  // namespace

std::vector<std::uint32_t> branch_numbers(const Morphology& m) {
  const std::size_t count = m.sections().size();
  std::vector<double> below(count);  // longest path from the start of the section to a tip
  for (std::size_t i = count; i-- > 0;) {
    const SectionId id(i);
    double longest = 0.;
    for (const SectionId child : m.children(id)) longest = std::max(longest, below[child.value()]);
    below[i] = section_length(m, id) + longest;
  }
  // Every section that does not continue its parent's longest path begins a branch of its own.
  std::vector<std::uint32_t> starts, branch_start(count), numbers(count);
  for (std::size_t i = 0; i < count; ++i) {
    const SectionId parent = m.sections()[i].parent;
    bool continues = false;
    if (parent.valid()) {
      const auto siblings = m.children(parent);
      const auto longest =
          std::ranges::max_element(siblings, {}, [&](SectionId s) { return below[s.value()]; });
      continues = longest->value() == i;
    }
    branch_start[i] = continues ? branch_start[parent.value()] : std::uint32_t(i);
    if (!continues) starts.push_back(std::uint32_t(i));
  }
  std::ranges::stable_sort(starts, [&](std::uint32_t a, std::uint32_t b) { return below[a] > below[b]; });
  std::vector<std::uint32_t> number_of(count);
  for (std::uint32_t n = 0; n < starts.size(); ++n) number_of[starts[n]] = n;
  for (std::size_t i = 0; i < count; ++i) numbers[i] = number_of[branch_start[i]];
  return numbers;
}

ClusterTree build_clusters(const Morphology& m) {
  const std::size_t sections = m.sections().size();
  const Point soma = m.soma().sphere();
  Vec3 origin = soma.position();
  if (m.soma().kind == SomaKind::none && !m.points().empty()) origin = m.points()[0].position();
  const auto vertex = [&](const Point& p) {
    return Vec4(p.x - origin.x(), p.y - origin.y(), p.z - origin.z(), p.radius);
  };

  ClusterTree tree;
  tree.soma_radius = soma.radius;

  // Ranks: the share of the neuron's length that lies in branches of smaller number.
  const std::vector<std::uint32_t> numbers = branch_numbers(m);
  std::vector<double> lengths(sections + 1);
  for (std::size_t i = 0; i < sections; ++i) lengths[numbers[i] + 1] += section_length(m, SectionId(i));
  std::vector<double> means(sections);  // of the radius along each branch
  for (std::size_t i = 0; i < sections; ++i)
    means[numbers[i]] += section_area(m, SectionId(i)) / (2. * std::numbers::pi);
  for (std::size_t n = 0; n < sections; ++n) means[n] /= std::max(lengths[n + 1], 1e-9);
  // A branch that is thicker than the one it leaves must not be seen without it.
  for (std::size_t i = 0; i < sections; ++i)
    if (const SectionId parent = m.section(SectionId(i)).parent; parent.valid())
      means[numbers[i]] = std::min(means[numbers[i]], means[numbers[parent.value()]]);
  std::partial_sum(lengths.begin(), lengths.end(), lengths.begin());
  const double total = std::max(lengths.back(), 1e-9);
  const auto rank_of = [&](std::size_t i) {
    return std::uint32_t(std::min(255., 256. * lengths[numbers[i]] / total));
  };

  // Depth first, the longest path first, so that a run of segments follows a branch. Node 0 is the soma, node s + 1
  // the end of section s; nodes beyond are where a run is cut inside a section.
  std::vector<Strip> runs;
  if (soma.radius > 0.f) {
    const Vec4 centre(soma.x - origin.x(), soma.y - origin.y(), soma.z - origin.z(), soma.radius);
    runs.push_back({.vertices = {centre, centre},
                    .places = {{}, {}},
                    .kind = 1,
                    .rank = 0,
                    .mean = 0.f,
                    .begin = 0,
                    .end = 0});
  }
  std::vector<SectionId> open(m.roots().rbegin(), m.roots().rend());
  std::vector<float> ways(sections);  // along the points of each section
  while (!open.empty()) {
    const SectionId id = open.back();
    open.pop_back();
    const auto points = m.points(id);
    const Section& section = m.section(id);
    Strip strip{.vertices = {},
                .places = {},
                .kind = std::uint32_t(section.kind),
                .rank = rank_of(id.value()),
                .mean = float(means[numbers[id.value()]]),
                .begin = section.parent.valid() ? section.parent.value() + 1 : 0,
                .end = id.value() + 1};
    float way = 0.f;
    for (const Point& p : points) {
      if (!strip.vertices.empty()) way += (vertex(p) - strip.vertices.back()).head<3>().norm();
      strip.vertices.push_back(vertex(p));
      strip.places.push_back({id.value(), way});
    }
    for (reports::Place& place : strip.places) place.position = way > 0.f ? place.position / way : .5f;
    ways[id.value()] = way;
    if (!section.parent.valid() && soma.radius > 0.f) {
      // A cone from inside the soma to the stem, when it begins near enough to belong there.
      const Vec4 first = strip.vertices.front();
      const float gap = first.head<3>().norm();
      if (gap > 0.f && gap < 6.f * soma.radius) {
        const float inside = std::max(.3f * soma.radius, 0.f);
        const Vec3 direction = first.head<3>() / gap;
        const float width = std::clamp(2.2f * first.w(), .2f * soma.radius, .75f * soma.radius);
        Strip cone{
            .vertices = {}, .places = {{}, {}}, .kind = 1, .rank = 0, .mean = 0.f, .begin = 0, .end = 0};
        Vec4 start;
        start << direction * inside, width;
        cone.vertices = {start, first};
        if (gap > inside) runs.push_back(std::move(cone));
      }
    }
    if (strip.vertices.size() >= 2) runs.push_back(std::move(strip));
    std::vector<SectionId> next(m.children(id).begin(), m.children(id).end());
    std::ranges::stable_sort(
        next, [&](SectionId a, SectionId b) { return numbers[a.value()] > numbers[b.value()]; });
    open.insert(open.end(), next.begin(), next.end());
  }
  if (runs.empty()) return tree;

  // Leaves: runs of at most `limit` segments, sections cut where a leaf is full.
  std::vector<Draft> drafts;
  std::uint32_t nodes = std::uint32_t(sections + 1);
  std::size_t filled = limit;
  for (const Strip& run : runs) {
    std::uint32_t begin = run.begin;
    for (std::size_t at = 0; at + 1 < run.vertices.size();) {
      if (filled == limit) {
        drafts.push_back({});
        drafts.back().leaf_first = tree.original_count;
        filled = 0;
      }
      const std::size_t take = std::min(limit - filled, run.vertices.size() - 1 - at);
      const bool last = at + take + 1 == run.vertices.size();
      const auto part = [&](const auto& list) {
        return std::remove_cvref_t<decltype(list)>(list.begin() + std::ptrdiff_t(at),
                                                   list.begin() + std::ptrdiff_t(at + take + 1));
      };
      Strip piece{.vertices = part(run.vertices),
                  .places = part(run.places),
                  .kind = run.kind,
                  .rank = run.rank,
                  .mean = run.mean,
                  .begin = begin,
                  .end = last ? run.end : nodes++};
      begin = piece.end;
      drafts.back().strips.push_back(std::move(piece));
      drafts.back().leaf_count += std::uint32_t(take);
      tree.original_count += std::uint32_t(take);
      filled += take;
      at += take;
    }
  }
  std::vector<std::uint32_t> degree(nodes);
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    Draft& d = drafts[i];
    d.first_leaf = i, d.last_leaf = i + 1;
    d.sphere = around(d.strips);
    for (const Strip& s : d.strips) ++degree[s.begin], ++degree[s.end];
  }
  degree[0] += 1;  // nothing is joined through the soma

  // Merge neighbours in pairs, level by level.
  std::vector<std::size_t> level(drafts.size());
  std::iota(level.begin(), level.end(), 0u);
  while (level.size() > 1) {
    std::vector<std::size_t> above;
    for (std::size_t i = 0; i < level.size(); i += 2) {
      if (i + 1 == level.size()) {
        above.push_back(level[i]);
        continue;
      }
      const Draft &a = drafts[level[i]], &b = drafts[level[i + 1]];
      std::vector<std::uint32_t> outside = degree;
      for (std::size_t leaf = a.first_leaf; leaf < b.last_leaf; ++leaf)
        for (const Strip& s : drafts[leaf].strips) --outside[s.begin], --outside[s.end];
      Draft parent = parent_of(a, b, outside);
      const std::span leaves(&drafts[a.first_leaf], b.last_leaf - a.first_leaf);
      parent.error = std::max({a.error, b.error, measured_error(parent.strips, leaves)});
      parent.children[0] = std::int64_t(level[i]);
      parent.children[1] = std::int64_t(level[i + 1]);
      above.push_back(drafts.size());
      drafts.push_back(std::move(parent));
    }
    level = std::move(above);
  }

  // Out: leaf segments first and in order, then the coarser ones; clusters root first.
  const Middle middle{m, std::move(ways)};
  std::vector<Drawn> drawn(drafts.size());
  std::vector<std::uint32_t> first(drafts.size());
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    first[i] = std::uint32_t(tree.segments.size());
    drawn[i] = emit(drafts[i].strips, middle, tree);
  }
  for (std::uint32_t i = 0; i < tree.original_count; ++i) tree.section.push_back(tree.places[i].section);
  const std::size_t count = drafts.size();
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
              .segment_count = std::uint32_t(segment_count(d.strips)),
              .children = {index(d.children[0]), index(d.children[1])},
              .leaf_first = d.leaf_first,
              .leaf_count = d.leaf_count};
    std::ranges::transform(drawn[i].groups, c.groups, [&](const Sphere& g) { return packed(g, sphere); });
    std::ranges::copy(drawn[i].visible, c.visible);
    tree.clusters.push_back(c);
  }
  return tree;
}

}  // namespace forest::scene
