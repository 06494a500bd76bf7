// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/brick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/scene/grove.h"
#include "forest/scene/placed.h"

namespace forest::scene {
namespace {

constexpr float straw_length = 24.f;  // µm: a branch runs straight for about so long
constexpr float straws_a_neuron = 48.f;
constexpr std::size_t most_straws =
    9'000'000;  // of the finest bricks, 360 MB; larger forests have fewer a neuron
constexpr std::uint32_t children = 4;

// The order in which straws of a brick come: van der Corput's, so that any first few are spread over all of it.
constexpr std::uint32_t reversed(std::uint32_t i) {
  return (i & 1u) << 4 | (i & 2u) << 2 | (i & 4u) | (i & 8u) >> 2 | (i & 16u) >> 4;
}

// Which straws have a rank below k / 32.
constexpr auto first_by_rank = [] {
  std::array<std::uint32_t, 33> masks{};
  for (std::uint32_t k = 0; k <= 32; ++k)
    for (std::uint32_t i = 0; i < 32; ++i) masks[k] |= std::uint32_t(reversed(i) < k) << i;
  return masks;
}();

float uniform(std::uint32_t key) { return (float(frame::forest_mixed(key) >> 8) + .5f) * 0x1p-24f; }

// What all straws of a level look like.
struct Look {
  float length, width;
  explicit Look(float area) : length(std::max(straw_length, std::sqrt(area))), width(area / length) {}
};

frame::Segment straw_at(const Vec3& middle, const Vec3& along, const Look& look, std::uint32_t kind,
                        std::uint32_t number) {
  const Vec3 a = middle - .5f * look.length * along, b = middle + .5f * look.length * along;
  const std::uint32_t radius = to_half(.5f * look.width);
  return {a.x(), a.y(), a.z(), radius | radius << 16,
          b.x(), b.y(), b.z(), kind | reversed(number) << 11 | radius << 16};
}

// The spheres of a brick whose straws are known.
void enclose(Brick& brick, std::span<const frame::Segment> straws, std::span<const Brick> below) {
  Bounds box;
  std::array<Bounds, Brick::group_count> boxes;
  for (std::size_t i = 0; i < straws.size(); ++i)
    for (const Vec3& p :
         {Vec3(straws[i].ax, straws[i].ay, straws[i].az), Vec3(straws[i].bx, straws[i].by, straws[i].bz)})
      box.add(p, .5f * brick.width), boxes[i / Brick::group_size].add(p, .5f * brick.width);
  for (const Brick& child : below) box.add({child.x, child.y, child.z}, child.radius);
  const Sphere all = around(box);
  brick.x = all.centre.x(), brick.y = all.centre.y(), brick.z = all.centre.z(), brick.radius = all.radius;
  for (std::size_t g = 0; g < Brick::group_count; ++g)
    if (!boxes[g].empty()) brick.groups[g] = packed_group(around(boxes[g]), all);
}

}  // namespace

std::uint32_t Brick::shown(float magnification) const {
  const float share = float(FOREST_MEAN_STRETCH / FOREST_STRAW_WIDTH) * width * magnification *
                      std::min(1.f, length * magnification / float(FOREST_STRAW_LENGTH));
  return first_by_rank[std::size_t(std::clamp(std::ceil(share * 32.f), 0.f, 32.f))] & all();
}

Pieces pieces_of(std::span<const frame::Segment> originals, std::size_t count) {
  Pieces result;
  const auto ends = [&](std::size_t i) {
    const frame::Segment& s = originals[i];
    return std::pair(Vec3(s.ax, s.ay, s.az), Vec3(s.bx, s.by, s.bz));
  };
  std::vector<double> before(originals.size() + 1, 0.);
  for (std::size_t i = 0; i < originals.size(); ++i) {
    const auto [a, b] = ends(i);
    const float ra = from_half(originals[i].radii), rb = from_half(originals[i].radii >> 16);
    const float length = (b - a).norm();
    // A sphere shows π r², a straight piece π / 4 of its length × diameter on the mean over directions.
    before[i + 1] = before[i] + double(length > 0.f ? length * (ra + rb) : 4.f * ra * ra);
  }
  const double area = before.back();
  result.area = float(area);
  if (!(area > 0.)) return result;
  result.pieces.reserve(count);
  std::size_t i = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double at = area * (double(k) + .5) / double(count);
    while (i + 1 < originals.size() && before[i + 1] <= at) ++i;
    const auto [a, b] = ends(i);
    const float along = float((at - before[i]) / (before[i + 1] - before[i]));
    const Vec3 way = b - a;
    result.pieces.push_back({a + along * way, way.norm() > 0.f ? Vec3(way.normalized()) : Vec3(Vec3::UnitY()),
                             std::uint32_t(i), originals[i].meta & 7u});
  }
  return result;
}

Bricks build_bricks(std::span<const frame::Instance> instances, std::span<const Pieces> pieces,
                    std::span<const std::uint32_t> first_segments, std::uint32_t first_straw) {
  Bricks result;
  double area = 0.;
  for (const frame::Instance& i : instances) area += double(pieces[i.morphology].area);
  const double wanted = std::min(double(straws_a_neuron) * double(instances.size()), double(most_straws));
  if (!(area > 0.)) return result;
  const double straw_area = area / wanted;

  // How many straws each neuron gives, by chance where it is no whole number, and where they are.
  std::vector<std::uint64_t> first(instances.size() + 1, 0);
  for (std::size_t i = 0; i < instances.size(); ++i)
    first[i + 1] = first[i] + std::uint64_t(double(pieces[instances[i].morphology].area) / straw_area +
                                            double(uniform(std::uint32_t(i))));
  struct Place {
    const Pieces::Piece* piece;
    Vec3 at, along;
  };
  const auto place = [&](std::size_t i, std::uint64_t k) -> Place {
    const frame::Instance& instance = instances[i];
    const auto& of = pieces[instance.morphology].pieces;
    const double step = double(of.size()) / double(first[i + 1] - first[i]);
    const double turn = double(uniform(std::uint32_t(i) ^ 0x9e3779b9u));
    const Pieces::Piece& piece = of[std::size_t((double(k) + turn) * step) % of.size()];
    const Placed placed(instance);
    return {&piece, placed.position + placed.turn * piece.at, placed.turn * piece.along};
  };

  const std::uint64_t finest = first.back();
  if (!finest) return result;
  Bounds bounds;
  for (const frame::Instance& i : instances) bounds.add({i.x, i.y, i.z}, 1000.f);
  std::vector<Keyed> order(finest);
  parallel_for(instances.size(), 256, [&](std::size_t i) {
    for (std::uint64_t n = first[i]; n < first[i + 1]; ++n)
      order[n] = {morton_code(place(i, n - first[i]).at, bounds), std::uint64_t(i) << 32 | (n - first[i])};
  });
  parallel_sort(order);

  // Levels, the finest last.
  struct Level {
    std::size_t bricks, straws, first_brick = 0, first_straw = 0;
  };
  std::vector<Level> levels;
  for (std::size_t straws = finest;;) {
    levels.insert(levels.begin(), {(straws + Brick::straws - 1) / Brick::straws, straws});
    if (straws <= Brick::straws) break;
    straws = (straws + children - 1) / children;
  }
  for (std::size_t l = 1; l < levels.size(); ++l)
    levels[l].first_brick = levels[l - 1].first_brick + levels[l - 1].bricks,
    levels[l].first_straw = levels[l - 1].first_straw + levels[l - 1].straws;
  result.bricks.resize(levels.back().first_brick + levels.back().bricks);
  result.straws.resize(levels.back().first_straw + finest);
  result.owners.resize(result.straws.size());

  double level_area = straw_area;
  for (std::size_t l = levels.size(); l-- > 0; level_area *= double(children)) {
    const Level& level = levels[l];
    const Look look{float(level_area)};
    const bool leaf = l + 1 == levels.size();
    parallel_for(level.bricks, 256, [&](std::size_t n) {
      Brick& brick = result.bricks[level.first_brick + n];
      const std::size_t begin = level.first_straw + n * Brick::straws;
      brick.width = look.width, brick.length = look.length;
      brick.segment_count =
          std::uint32_t(std::min<std::size_t>(Brick::straws, level.straws - n * Brick::straws));
      brick.first_segment = first_straw + std::uint32_t(begin);
      for (std::uint32_t s = 0; s < brick.segment_count; ++s) {
        const std::size_t own = begin + s;
        if (leaf) {
          const auto [code, key] = order[n * Brick::straws + s];
          const auto i = std::size_t(key >> 32);
          const Place p = place(i, key & 0xffffffffu);
          result.owners[own] = {std::uint32_t(i), first_segments[instances[i].morphology] + p.piece->segment};
          result.straws[own] = straw_at(p.at, p.along, look, p.piece->kind, s);
        } else {  // every fourth of those below: of each of four bricks the eight that come first
          const std::size_t from = levels[l + 1].first_straw + children * (n * Brick::straws + s);
          const frame::Segment& f = result.straws[from];
          const Vec3 a(f.ax, f.ay, f.az), b(f.bx, f.by, f.bz);
          result.owners[own] = result.owners[from];
          result.straws[own] = straw_at(.5f * (a + b), (b - a).normalized(), look, f.meta & 7u, s);
        }
      }
      std::span<const Brick> below;
      if (!leaf) {
        const Level& next = levels[l + 1];
        const std::size_t first_child = n * children;
        brick.child_count = std::uint32_t(std::min<std::size_t>(children, next.bricks - first_child));
        brick.first_child = std::uint32_t(next.first_brick + first_child);
        below = std::span(result.bricks).subspan(brick.first_child, brick.child_count);
      }
      enclose(brick, std::span(result.straws).subspan(begin, brick.segment_count), below);
      for (const Brick& child : below)
        brick.neurons =
            std::max(brick.neurons, (child.sphere().centre - brick.sphere().centre).norm() + child.neurons);
      if (leaf)
        for (const frame::Owner& owner : std::span(result.owners).subspan(begin, brick.segment_count)) {
          const frame::Instance& i = instances[owner.instance];
          const Sphere whole = Placed(i)(pieces[i.morphology].sphere);
          brick.neurons =
              std::max(brick.neurons, 1.001f * (whole.centre - brick.sphere().centre).norm() + whole.radius);
        }
    });
  }
  return result;
}

}  // namespace forest::scene
