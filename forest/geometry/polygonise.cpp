// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/polygonise.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "forest/core/bounds.h"
#include "forest/core/distinct.h"
#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest {
namespace {

// Lattice point (i, j, k) lies at voxel·(i b1 + j b2 + k b3) with b1 = (-1, 1, 1)/2, b2 = (1, -1, 1)/2, b3 = (1, 1, -1)/2.
// The image of Kuhn's six tetrahedra of a cube, whose edges run from a point along the sums of a subset of the axes, are
// then the tetrahedra of the body-centred cubic lattice. A block owns 8³ points and looks one point further.
constexpr int block_points = 8, look_points = block_points + 1;
constexpr float block_reach =
    6.64f;  // voxels from the middle of what a block looks at to its furthest corner
constexpr std::size_t most_entries = std::size_t(1) << 25;  // of the lists of all blocks: 0.5 GiB
constexpr std::int64_t most_blocks_across = std::int64_t(1) << 20;
constexpr std::uint32_t solid = 0xffffffffu;  // in place of a cone: the block lies within one

using Cell = std::array<std::int64_t, 3>;

Vec3 lattice_place(float i, float j, float k) { return 0.5f * Vec3(-i + j + k, i - j + k, i + j - k); }

/// In the list of a block.
struct Entry {
  std::uint64_t block;  // its place, packed
  std::uint32_t item;   // a cone, or a joint
  auto operator<=>(const Entry&) const = default;
};

std::uint64_t pack(const Cell& at) {
  return std::uint64_t(at[2]) << 40 | std::uint64_t(at[1]) << 20 | std::uint64_t(at[0]);
}
Cell unpack(std::uint64_t key) {
  return {std::int64_t(key & 0xfffff), std::int64_t(key >> 20 & 0xfffff), std::int64_t(key >> 40 & 0xfffff)};
}

/// What is around every block.
struct Field {
  std::vector<BranchCone> cones;  // relative to the lattice's origin
  std::vector<Joint> joints;
  float voxel = 1.f;
  std::vector<Entry> near_cones, near_joints;  // sorted

  Vec3 middle(const Cell& block) const {
    const auto at = [&](std::size_t i) { return float(block[i] * block_points) + block_points / 2.f; };
    return voxel * lattice_place(at(0), at(1), at(2));
  }

  /// Calls visit(block, middle) for blocks whose looked-at points may come within `radius` of a point.
  template <class Visit>
  void blocks_around(const Bounds& box, Visit&& visit) const {
    // i = Y + Z, j = X + Z, k = X + Y in voxels
    Cell low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const int p = (axis + 1) % 3, q = (axis + 2) % 3;
      const float from = (box.low[p] + box.low[q]) / voxel, to = (box.high[p] + box.high[q]) / voxel;
      low[std::size_t(axis)] =
          std::max<std::int64_t>(0, std::int64_t(std::floor((from - 1.f) / block_points)) - 1);
      high[std::size_t(axis)] = std::int64_t(std::floor((to + 1.f) / block_points));
    }
    for (std::int64_t z = low[2]; z <= high[2]; ++z)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t x = low[0]; x <= high[0]; ++x) visit(Cell{x, y, z}, middle({x, y, z}));
  }

  /// Notes the cone in all blocks that come within `band` of it, and within `reach` of `centre`.
  void note(std::uint32_t item, float band, const Vec3& centre, float reach) {
    const RoundCone& cone = cones[item].shape;
    const Vec3 axis = cone.b - cone.a;
    const float block = block_points * voxel, r = std::max(cone.radius_a, cone.radius_b);
    const int pieces = std::max(1, int(std::ceil(axis.norm() / std::max(block, r))));
    for (int i = 0; i < pieces; ++i) {
      Bounds box;
      box.add(cone.a + float(i) / float(pieces) * axis, r + band);
      box.add(cone.a + float(i + 1) / float(pieces) * axis, r + band);
      if (std::isfinite(reach)) {
        box.low = box.low.cwiseMax(centre - Vec3::Constant(reach));
        box.high = box.high.cwiseMin(centre + Vec3::Constant(reach));
        if ((box.low.array() > box.high.array()).any()) continue;
      }
      blocks_around(box, [&](const Cell& at, const Vec3& middle) {
        const float d = signed_distance(middle, cone);
        if (d > block_reach * voxel + band) return;
        near_cones.push_back({pack(at), d < -(block_reach + 1.f) * voxel ? solid : item});
      });
      if (near_cones.size() > most_entries)
        throw LimitError(
            fmt::format("a surface with voxels of {} µm needs too much memory; choose a coarser one", voxel));
    }
  }
};

float smooth_minimum(float a, float b, float k) {
  const float h = std::max(k - std::abs(a - b), 0.f) / k;
  return std::min(a, b) - h * h * k / 4.f;
}

/// What one block has to say. A vertex lies on the edge from an owned point along a subset of the axes; its key is
/// 8·point + subset. A corner of a triangle is a key, and in the upper bits which neighbour owns it.
struct Block {
  std::vector<std::uint16_t> keys;  // ascending
  std::vector<Vec3> positions, normals;
  std::vector<std::uint8_t> labels;
  std::vector<std::uint32_t> cones;  // nearest
  std::vector<std::array<std::uint16_t, 3>> triangles;
};

class BlockMaker {
 public:
  /// @param with_normals  and with the nearest cones
  BlockMaker(const Field& field, std::uint64_t key, std::span<const Entry> cones,
             std::span<const Entry> joints, bool with_normals = false)
      : field_(field),
        cones_(cones),
        joints_(joints),
        with_normals_(with_normals),
        corner_(unpack(key)),
        distances_(cones.size()) {
    for (std::int64_t& i : corner_) i *= block_points;
  }

  Block make() {
    bool inside = false, outside = false;
    for (int z = 0; z < look_points; ++z)
      for (int y = 0; y < look_points; ++y)
        for (int x = 0; x < look_points; ++x) {
          const float d = distance(place(x, y, z));
          values_[index(x, y, z)] = d;
          (d < 0.f ? inside : outside) = true;
        }
    if (!inside || !outside) return {};
    for (int z = 0; z < block_points; ++z)
      for (int y = 0; y < block_points; ++y)
        for (int x = 0; x < block_points; ++x) add_vertices(x, y, z), add_triangles(x, y, z);
    return std::move(block_);
  }

 private:
  static std::size_t index(int x, int y, int z) {
    return std::size_t((z * look_points + y) * look_points + x);
  }
  Vec3 place(int x, int y, int z) const {  // the same number in every block that looks at the point
    return field_.voxel * lattice_place(float(corner_[0] + x), float(corner_[1] + y), float(corner_[2] + z));
  }

  /// Cones further than a voxel, and branches further than that and the rounding, count as if they were just there:
  /// a block does not know whether there are any, and all blocks must agree.
  float distance(const Vec3& p) {
    float least = field_.voxel;
    for (std::size_t i = 0; i < cones_.size(); ++i)
      least = std::min(least, distances_[i] = signed_distance(p, field_.cones[cones_[i].item].shape));
    for (const Entry& entry : joints_) {
      const Joint& joint = field_.joints[entry.item];
      const float out = (p - joint.centre).squaredNorm() / (joint.reach * joint.reach);
      if (!(out < 1.f)) continue;
      const float far = field_.voxel + joint.rounding, k = joint.rounding * (1.f - out);
      float sum = far;
      for (const std::uint32_t branch : joint.branches) {
        float own = far;
        for (std::size_t i = 0; i < cones_.size(); ++i)
          if (field_.cones[cones_[i].item].branch == branch) own = std::min(own, distances_[i]);
        sum = k > 1e-6f * field_.voxel ? smooth_minimum(sum, own, k) : std::min(sum, own);
      }
      least = std::min(least, sum);
    }
    return least;
  }

  std::uint32_t nearest_cone(const Vec3& p) {
    distance(p);
    const auto at = std::ranges::min_element(distances_);
    return at == distances_.end() ? 0u : cones_[std::size_t(at - distances_.begin())].item;
  }

  /// Differences towards the corners of a tetrahedron.
  Vec3 gradient(const Vec3& p) {
    static constexpr float ways[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    Vec3 sum = Vec3::Zero();
    for (const auto& way : ways) sum += distance(p + .2f * field_.voxel * Vec3::Map(way)) * Vec3::Map(way);
    const float length = sum.norm();
    return length > 0.f ? Vec3(sum / length) : Vec3(Vec3::UnitY());
  }

  void add_vertices(int x, int y, int z) {
    const float d = values_[index(x, y, z)];
    for (int subset = 1; subset < 8; ++subset) {
      const int u = x + (subset & 1), v = y + (subset >> 1 & 1), w = z + (subset >> 2);
      const float e = values_[index(u, v, w)];
      if ((d < 0.f) == (e < 0.f)) continue;
      const Vec3 p = crossing(place(x, y, z), d, place(u, v, w), e);
      block_.keys.push_back(std::uint16_t(8 * ((z * block_points + y) * block_points + x) + subset));
      block_.positions.push_back(p);
      const std::uint32_t nearest = nearest_cone(p);
      block_.labels.push_back(cones_.empty() ? std::uint8_t(0) : field_.cones[nearest].label);
      if (with_normals_) block_.cones.push_back(nearest), block_.normals.push_back(gradient(p));
    }
  }

  /// Regula falsi with Illinois' halving. Away from the ends, so that no two vertices coincide.
  Vec3 crossing(const Vec3& a, float value_a, const Vec3& b, float value_b) {
    float low = 0.f, high = 1.f, t = .5f;
    for (int step = 0; step < 4; ++step) {
      t = low + (high - low) * value_a / (value_a - value_b);
      if (step == 3) break;
      const float d = distance(a + t * (b - a));
      if ((d < 0.f) == (value_a < 0.f))
        low = t, value_a = d, value_b *= .5f;
      else
        high = t, value_b = d, value_a *= .5f;
      if (value_a == 0.f || value_b == 0.f) break;
    }
    return a + std::clamp(t, .01f, .99f) * (b - a);
  }

  void add_triangles(int x, int y, int z) {
    static constexpr std::array<std::array<int, 4>, 6> tetrahedra{
        {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 4, 6, 7}}};
    // Even orders of the four corners, by which are inside (bits): the first alone, or the first two.
    static constexpr std::array<std::array<int, 4>, 16> orders{{{},
                                                                {0, 1, 2, 3},
                                                                {1, 0, 3, 2},
                                                                {0, 1, 2, 3},
                                                                {2, 0, 1, 3},
                                                                {0, 2, 3, 1},
                                                                {1, 2, 0, 3},
                                                                {3, 0, 2, 1},
                                                                {3, 0, 2, 1},
                                                                {0, 3, 1, 2},
                                                                {1, 3, 2, 0},
                                                                {2, 0, 1, 3},
                                                                {2, 3, 0, 1},
                                                                {1, 0, 3, 2},
                                                                {0, 1, 2, 3},
                                                                {}}};
    for (std::size_t t = 0; t < 6; ++t) {
      const auto& corners = tetrahedra[t];
      unsigned inside = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const int c = corners[i];
        inside |= unsigned(values_[index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))] < 0.f) << i;
      }
      if (inside == 0 || inside == 15) continue;
      const auto& order = orders[inside];
      const auto edge = [&](std::size_t i, std::size_t j) {
        const int a = corners[std::size_t(order[i])], b = corners[std::size_t(order[j])];
        return key(x, y, z, a & b, a ^ b);
      };
      const int count = std::popcount(inside);
      const bool odd = t >= 3;
      if (count == 2) {
        const auto a = edge(0, 2), b = edge(0, 3), c = edge(1, 3), d = edge(1, 2);
        add(a, b, c, odd), add(a, c, d, odd);
      } else {
        add(edge(0, 1), edge(0, 2), edge(0, 3), odd != (count == 3));
      }
    }
  }

  void add(std::uint16_t a, std::uint16_t b, std::uint16_t c, bool turned) {
    block_.triangles.push_back(turned ? std::array{a, c, b} : std::array{a, b, c});
  }

  static std::uint16_t key(int x, int y, int z, int from, int subset) {
    x += from & 1, y += from >> 1 & 1, z += from >> 2;
    const int neighbour =
        (x == block_points ? 1 : 0) | (y == block_points ? 2 : 0) | (z == block_points ? 4 : 0);
    x %= block_points, y %= block_points, z %= block_points;
    return std::uint16_t(neighbour << 12 | (8 * ((z * block_points + y) * block_points + x) + subset));
  }

  const Field& field_;
  std::span<const Entry> cones_, joints_;
  bool with_normals_;
  Cell corner_;
  std::vector<float> distances_;
  std::array<float, look_points * look_points * look_points> values_;
  Block block_;
};

std::span<const Entry> of_block(const std::vector<Entry>& entries, std::uint64_t block) {
  const auto before = [block](const Entry& e) { return e.block < block; };
  const auto first = std::partition_point(entries.begin(), entries.end(), before);
  return {first, std::find_if(first, entries.end(), [block](const Entry& e) { return e.block != block; })};
}

/// @param part  blocks beside this sphere may be left out
Field field_of(const std::vector<BranchCone>& cones, const std::vector<Joint>& joints, float voxel,
               const Vec3& origin, const std::optional<Sphere>& part = {}) {
  Field field{.cones = cones, .joints = joints, .voxel = voxel, .near_cones = {}, .near_joints = {}};
  std::vector<std::vector<std::uint32_t>> branches;
  for (std::uint32_t i = 0; i < cones.size(); ++i) {
    field.cones[i].shape.a -= origin, field.cones[i].shape.b -= origin;
    if (cones[i].branch >= branches.size()) branches.resize(cones[i].branch + 1);
    branches[cones[i].branch].push_back(i);
  }
  constexpr float anywhere = std::numeric_limits<float>::infinity();
  const Vec3 centre = part ? Vec3(part->centre - origin) : Vec3::Zero();
  for (std::uint32_t i = 0; i < cones.size(); ++i)
    field.note(i, voxel, centre, part ? part->radius : anywhere);
  for (std::uint32_t i = 0; i < joints.size(); ++i) {
    Joint& joint = field.joints[i];
    joint.centre -= origin;
    const float band = voxel + joint.rounding;
    Bounds around;
    around.add(joint.centre, joint.reach);
    field.blocks_around(around, [&](const Cell& at, const Vec3& middle) {
      if ((middle - joint.centre).norm() <= joint.reach + block_reach * voxel)
        field.near_joints.push_back({pack(at), i});
    });
    for (const std::uint32_t branch : joint.branches)
      if (branch < branches.size())
        for (const std::uint32_t cone : branches[branch])
          if (signed_distance(joint.centre, field.cones[cone].shape) < joint.reach + band)
            field.note(cone, band, joint.centre, joint.reach);
  }
  for (auto* list : {&field.near_cones, &field.near_joints}) *list = distinct(std::move(*list));
  return field;
}

/// Of blocks, ascending, without those that lie within a cone.
std::vector<std::uint64_t> places_of(const Field& field) {
  std::vector<std::uint64_t> places;
  for (const auto& entry : field.near_cones)
    if (places.empty() || places.back() != entry.block) places.push_back(entry.block);
  std::erase_if(places,
                [&](std::uint64_t at) { return of_block(field.near_cones, at).back().item == solid; });
  return places;
}

constexpr std::int64_t piece_blocks = 8;  // along an edge

}  // namespace

double expected_triangles(const std::vector<BranchCone>& cones, float voxel) {
  double area = 0.;
  for (const BranchCone& cone : cones) {
    const double r = cone.shape.radius_a, s = cone.shape.radius_b;
    const double length = (cone.shape.b - cone.shape.a).norm();
    area += length > 0. ? pi * (r + s) * std::hypot(length, r - s) : 4. * pi * r * r;
  }
  return 12.75 * area / (double(voxel) * double(voxel));
}

Mesh polygonise(const std::vector<BranchCone>& cones, const std::vector<Joint>& joints, float voxel) {
  assert(voxel > 0.f);
  if (cones.empty()) return {};
  if (const double expected = expected_triangles(cones, voxel); !(expected <= double(most_triangles)))
    throw LimitError(
        fmt::format("a surface with voxels of {} µm would have some {:.0f} million triangles, more than {}; "
                    "choose {:.2g} µm or more",
                    voxel, expected / 1e6, most_triangles / 1'000'000,
                    1.05 * voxel * std::sqrt(expected / double(most_triangles))));
  Bounds box;
  for (const BranchCone& cone : cones)
    box.add(cone.shape.a, cone.shape.radius_a), box.add(cone.shape.b, cone.shape.radius_b);
  float rounding = 0.f;
  for (const Joint& joint : joints) rounding = std::max(rounding, joint.rounding);
  const Vec3 origin = box.low - Vec3::Constant(2.f * block_points * voxel + rounding);
  const float across = 2.f * ((box.high - origin).maxCoeff() / voxel + 2 * block_points) / block_points;
  if (!(across < float(most_blocks_across)))
    throw LimitError(
        fmt::format("the neuron spans {:.4g} µm, too much for voxels of {} µm; choose coarser ones or "
                    "remove what lies far off",
                    box.extent().maxCoeff(), voxel));

  const Field field = field_of(cones, joints, voxel, origin);
  const std::vector<std::uint64_t> places = places_of(field);
  std::vector<Block> blocks(places.size());
  parallel_for(places.size(), 16, [&](std::size_t i) {
    blocks[i] = BlockMaker(field, places[i], of_block(field.near_cones, places[i]),
                           of_block(field.near_joints, places[i]))
                    .make();
  });

  std::vector<std::size_t> first_vertex(blocks.size() + 1, 0), first_triangle(blocks.size() + 1, 0);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    first_vertex[i + 1] = first_vertex[i] + blocks[i].positions.size();
    first_triangle[i + 1] = first_triangle[i] + blocks[i].triangles.size();
  }
  Mesh mesh;
  mesh.positions.resize(first_vertex.back());
  mesh.labels.resize(first_vertex.back());
  mesh.triangles.resize(first_triangle.back());
  parallel_for(blocks.size(), 64, [&](std::size_t i) {
    const Block& block = blocks[i];
    for (std::size_t v = 0; v < block.positions.size(); ++v) {
      mesh.positions[first_vertex[i] + v] = block.positions[v] + origin;
      mesh.labels[first_vertex[i] + v] = block.labels[v];
    }
    std::array<std::size_t, 8> owners;
    owners.fill(blocks.size());
    const auto vertex = [&](std::uint16_t corner) {
      const std::size_t neighbour = corner >> 12;
      std::size_t& owner = owners[neighbour];
      if (owner == blocks.size()) {
        Cell at = unpack(places[i]);
        for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += neighbour >> axis & 1;
        owner = std::size_t(std::ranges::lower_bound(places, pack(at)) - places.begin());
        assert(owner < places.size() && places[owner] == pack(at));
      }
      const auto& keys = blocks[owner].keys;
      const auto key = std::ranges::lower_bound(keys, std::uint16_t(corner & 0xfff));
      assert(key != keys.end() && *key == (corner & 0xfff));
      return std::uint32_t(first_vertex[owner] + std::size_t(key - keys.begin()));
    };
    for (std::size_t t = 0; t < block.triangles.size(); ++t) {
      const auto& [a, b, c] = block.triangles[t];
      mesh.triangles[first_triangle[i] + t] = {vertex(a), vertex(b), vertex(c)};
    }
  });
  return mesh;
}

Sphere PieceLattice::around(const Cell& cell) const {
  // As a block, whose edge is an eighth of the piece's.
  const auto middle = [&](std::size_t i) {
    return (float(cell[i]) + .5f) * float(piece_blocks * block_points);
  };
  return {origin + voxel * lattice_place(middle(0), middle(1), middle(2)),
          block_reach / float(look_points - 1) * float(block_points) * float(piece_blocks) * voxel};
}

std::pair<PieceLattice::Cell, PieceLattice::Cell> PieceLattice::cells(const Bounds& box) const {
  Cell first, last;
  const Vec3 low = (box.low - origin) / voxel, high = (box.high - origin) / voxel;
  constexpr float edge = float(piece_blocks * block_points);
  for (int axis = 0; axis < 3; ++axis) {  // i = Y + Z, j = X + Z, k = X + Y
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    first[std::size_t(axis)] = std::int64_t(std::floor((low[p] + low[q] - 1.f) / edge));
    last[std::size_t(axis)] = std::int64_t(std::floor((high[p] + high[q] + 1.f) / edge));
  }
  return {first, last};
}

Piece polygonise_piece(const std::vector<BranchCone>& cones, const std::vector<Joint>& joints,
                       const PieceLattice& lattice, const PieceLattice::Cell& cell) {
  Piece piece;
  Sphere part = lattice.around(cell);
  part.radius += 4.f * block_reach * lattice.voxel;
  const Field field = field_of(cones, joints, lattice.voxel, lattice.origin, part);
  // Its blocks, and those behind, which own vertices of its triangles.
  std::vector<std::uint64_t> places = places_of(field);
  const auto inside = [&](std::uint64_t place, std::int64_t more) {
    const Cell at = unpack(place);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t from = cell[axis] * piece_blocks;
      if (at[axis] < from || at[axis] >= from + piece_blocks + more) return false;
    }
    return true;
  };
  std::erase_if(places, [&](std::uint64_t place) { return !inside(place, 1); });
  std::vector<Block> blocks(places.size());
  parallel_for(places.size(), 4, [&](std::size_t i) {
    blocks[i] = BlockMaker(field, places[i], of_block(field.near_cones, places[i]),
                           of_block(field.near_joints, places[i]), true)
                    .make();
  });
  std::vector<std::vector<std::uint32_t>> vertices(blocks.size());  // of blocks' vertices: in the piece, + 1
  for (std::size_t i = 0; i < blocks.size(); ++i) vertices[i].resize(blocks[i].positions.size());
  const auto vertex = [&](std::size_t from, std::uint16_t corner) {
    Cell at = unpack(places[from]);
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += corner >> (12 + axis) & 1;
    const auto owner = std::size_t(std::ranges::lower_bound(places, pack(at)) - places.begin());
    assert(owner < places.size() && places[owner] == pack(at));
    const Block& block = blocks[owner];
    const auto key = std::ranges::lower_bound(block.keys, std::uint16_t(corner & 0xfff));
    assert(key != block.keys.end() && *key == (corner & 0xfff));
    const auto which = std::size_t(key - block.keys.begin());
    std::uint32_t& known = vertices[owner][which];
    if (!known) {
      piece.mesh.positions.push_back(block.positions[which] + lattice.origin);
      piece.mesh.labels.push_back(block.labels[which]);
      piece.normals.push_back(block.normals[which]);
      piece.cones.push_back(block.cones[which]);
      known = std::uint32_t(piece.mesh.positions.size());
    }
    return known - 1;
  };
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (inside(places[i], 0))
      for (const auto& [a, b, c] : blocks[i].triangles)
        piece.mesh.triangles.push_back({vertex(i, a), vertex(i, b), vertex(i, c)});
  return piece;
}

}  // namespace forest
