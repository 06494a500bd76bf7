// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/isosurface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <queue>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest {
namespace {

// Neighbours by the bits of their offset: 1, 2 and 4 along the first, second and third axis; all forwards (1–7) or all
// backwards. Neighbours of a point are each other's when their difference is such an offset.
struct Step {
  int x, y, z;
};
constexpr std::array<Step, 14> neighbours = [] {
  std::array<Step, 14> all{};
  for (int bits = 1; bits < 8; ++bits) {
    const Step step{bits & 1, bits >> 1 & 1, bits >> 2 & 1};
    all[std::size_t(bits - 1)] = step;
    all[std::size_t(bits + 6)] = {-step.x, -step.y, -step.z};
  }
  return all;
}();

constexpr bool joined(const Step& a, const Step& b) {
  const int x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
  return (x || y || z) && ((x >= 0 && y >= 0 && z >= 0) || (x <= 0 && y <= 0 && z <= 0)) && x <= 1 &&
         y <= 1 && z <= 1 && x >= -1 && y >= -1 && z >= -1;
}

// Of the subset of neighbours: whether it is one piece.
bool one_piece(std::uint32_t subset) {
  static const auto around = [] {
    std::array<std::uint32_t, 14> masks{};
    for (std::size_t i = 0; i < 14; ++i)
      for (std::size_t j = 0; j < 14; ++j)
        if (joined(neighbours[i], neighbours[j])) masks[i] |= 1u << j;
    return masks;
  }();
  if (subset == 0) return false;
  std::uint32_t reached = subset & (~subset + 1), before = 0;
  while (reached != before) {
    before = reached;
    for (std::size_t i = 0; i < 14; ++i)
      if (reached >> i & 1) reached |= around[i] & subset;
  }
  return reached == subset;
}

// By the neighbours that are in the ball: whether the point may join it.
const std::vector<std::uint8_t>& simple_points() {
  static const auto table = [] {
    std::vector<std::uint8_t> simple(1u << 14);
    for (std::uint32_t inside = 0; inside < simple.size(); ++inside)
      simple[inside] = one_piece(inside) && one_piece(~inside & 0x3fffu);
    return simple;
  }();
  return table;
}

// The six tetrahedra of a box, by the bits of their corners: from 0 to 7 along three edges, one an axis.
constexpr std::array<std::array<int, 4>, 6> tetrahedra{
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

}  // namespace

Mesh isosurface(const ScalarGrid& grid) {
  const auto [nx, ny, nz] = grid.size;
  const auto inside = [&](std::size_t i) { return grid.values[i] < 0.f; };
  const std::size_t row = nx, layer = nx * ny;
  const auto offset = [&](int bits) {
    return std::size_t(bits & 1) + std::size_t(bits >> 1 & 1) * row + std::size_t(bits >> 2 & 1) * layer;
  };
  // A vertex on each of a point's seven edges forwards that crosses the surface.
  std::vector<std::uint8_t> edges(grid.count(), 0);
  std::vector<std::uint32_t> first(grid.count(), 0), in_layer(nz + 1, 0);
  parallel_for(nz, 1, [&](std::size_t z) {
    std::uint32_t count = 0;
    for (std::size_t y = 0; y < ny; ++y)
      for (std::size_t x = 0; x < nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        first[i] = count;
        for (int bits = 1; bits < 8; ++bits) {
          if (x + std::size_t(bits & 1) >= nx || y + std::size_t(bits >> 1 & 1) >= ny ||
              z + std::size_t(bits >> 2 & 1) >= nz)
            continue;
          if (inside(i) != inside(i + offset(bits))) edges[i] |= std::uint8_t(1 << bits), ++count;
        }
      }
    in_layer[z + 1] = count;
  });
  for (std::size_t z = 0; z < nz; ++z) in_layer[z + 1] += in_layer[z];
  Mesh mesh;
  mesh.positions.resize(in_layer[nz]);
  mesh.labels.assign(in_layer[nz], 0);
  const auto vertex = [&](std::size_t low, int bits, std::size_t z) {
    return in_layer[z] + first[low] +
           std::uint32_t(std::popcount(std::uint32_t(edges[low] & ((1 << bits) - 1))));
  };
  std::vector<std::vector<Triangle>> triangles(nz);
  parallel_for(nz, 1, [&](std::size_t z) {
    for (std::size_t y = 0; y < ny; ++y)
      for (std::size_t x = 0; x < nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        for (int bits = 1; bits < 8; ++bits) {
          if (!(edges[i] >> bits & 1)) continue;
          const double a = grid.values[i], b = grid.values[i + offset(bits)];
          // Away from the points, where vertices of several edges would fall together.
          const double share = std::clamp(a / (a - b), .01, .99);
          const Eigen::Vector3d at(double(x) + share * (bits & 1), double(y) + share * (bits >> 1 & 1),
                                   double(z) + share * (bits >> 2 & 1));
          mesh.positions[vertex(i, bits, z)] = (grid.origin + grid.step.cwiseProduct(at)).cast<float>();
        }
      }
    if (z + 1 == nz) return;
    for (std::size_t y = 0; y + 1 < ny; ++y)
      for (std::size_t x = 0; x + 1 < nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        std::uint32_t in = 0;
        for (int bits = 0; bits < 8; ++bits) in |= std::uint32_t(inside(i + offset(bits))) << bits;
        if (in == 0 || in == 255) continue;
        for (std::size_t k = 0; k < 6; ++k) {
          std::array<int, 4> within{}, without{};
          std::size_t a = 0, b = 0;
          for (const int bits : tetrahedra[k]) (in >> bits & 1 ? within[a++] : without[b++]) = bits;
          if (a == 0 || b == 0) continue;
          const auto on = [&](int p, int q) {
            const int low = std::min(p, q), high = std::max(p, q);
            return vertex(i + offset(low), high ^ low, z + std::size_t(low >> 2 & 1));
          };
          // Facing outwards: by which way round the corners stand.
          const auto point = [&](int bits) {
            return Eigen::Vector3i(bits & 1, bits >> 1 & 1, bits >> 2 & 1);
          };
          const auto add = [&](std::uint32_t u, std::uint32_t v, std::uint32_t w, bool flip) {
            triangles[z].push_back(flip ? Triangle{u, w, v} : Triangle{u, v, w});
          };
          const auto turn = [&](int p, int q, int r, int s) {
            return (point(q) - point(p)).cross(point(r) - point(p)).dot(point(s) - point(p)) > 0;
          };
          if (a == 1) {
            const bool flip = !turn(within[0], without[0], without[1], without[2]);
            add(on(within[0], without[0]), on(within[0], without[1]), on(within[0], without[2]), flip);
          } else if (b == 1) {
            const bool flip = turn(without[0], within[0], within[1], within[2]);
            add(on(within[0], without[0]), on(within[1], without[0]), on(within[2], without[0]), flip);
          } else {
            const bool flip = !turn(within[0], without[0], without[1], within[1]);
            const std::uint32_t p = on(within[0], without[0]), q = on(within[0], without[1]),
                                r = on(within[1], without[1]), s = on(within[1], without[0]);
            add(p, q, r, flip), add(p, r, s, flip);
          }
        }
      }
  });
  std::size_t total = 0;
  for (const auto& some : triangles) total += some.size();
  mesh.triangles.reserve(total);
  for (auto& some : triangles) {
    mesh.triangles.insert(mesh.triangles.end(), some.begin(), some.end());
    some = {};
  }
  return mesh;
}

BallChange grow_ball(ScalarGrid& grid, std::vector<std::uint8_t>& ball, float least) {
  const auto [nx, ny, nz] = grid.size;
  std::array<std::ptrdiff_t, 14> offsets{};
  for (std::size_t k = 0; k < 14; ++k)
    offsets[k] =
        neighbours[k].x + neighbours[k].y * std::ptrdiff_t(nx) + neighbours[k].z * std::ptrdiff_t(nx * ny);
  const auto& simple = simple_points();
  const auto in_ball = [&](std::size_t i) {
    std::uint32_t mask = 0;
    for (std::size_t k = 0; k < 14; ++k)
      mask |= std::uint32_t(ball[std::size_t(std::ptrdiff_t(i) + offsets[k])]) << k;
    return mask;
  };
  ball.resize(grid.count(), 0);
  BallChange change;
  // Points on the border have too few neighbours and stay outside.
  std::vector<std::uint8_t> state(grid.count(), 2);  // 0: may join, 1: waits in the queue, 2: never
  for (std::size_t z = 1; z + 1 < nz; ++z)
    for (std::size_t y = 1; y + 1 < ny; ++y)
      for (std::size_t x = 1; x + 1 < nx; ++x) {
        const std::size_t i = grid.index(x, y, z);
        if (grid.values[i] < 0.f && !ball[i]) state[i] = 0;
      }
  if (std::ranges::find(ball, 1) == ball.end()) {
    std::size_t deepest = 0;
    bool any = false;
    for (std::size_t i = 0; i < grid.count(); ++i)
      if (state[i] == 0 && (!any || grid.values[i] < grid.values[deepest])) deepest = i, any = true;
    if (!any) throw Error("the grid has no inside; give one that is larger than the surface");
    ball[deepest] = 1, state[deepest] = 2;
  }
  // Deepest first, by buckets of depth; within one the first that came.
  float low = 0.f;
  for (std::size_t i = 0; i < grid.count(); ++i)
    if (state[i] == 0) low = std::min(low, grid.values[i]);
  constexpr std::size_t buckets = 4096;
  std::vector<std::vector<std::size_t>> queue(buckets);
  std::size_t current = 0;
  const auto bucket_of = [&](std::size_t i) {
    return std::min<std::size_t>(buckets - 1,
                                 std::size_t(double(grid.values[i] - low) / -double(low) * buckets));
  };
  const auto call = [&](std::size_t i) {  // neighbours of a point of the ball come into question
    for (const std::ptrdiff_t offset : offsets) {
      const std::size_t j = std::size_t(std::ptrdiff_t(i) + offset);
      if (state[j] != 0) continue;
      state[j] = 1;
      const std::size_t bucket = bucket_of(j);
      queue[bucket].push_back(j);
      current = std::min(current, bucket);
    }
  };
  for (std::size_t i = 0; i < grid.count(); ++i)
    if (ball[i]) call(i);
  for (current = 0; current < buckets;) {
    // A call may lead back to a deeper bucket; points of one bucket come in the order in which they were called.
    std::vector<std::size_t> now = std::move(queue[current]);
    queue[current].clear();
    if (now.empty()) {
      ++current;
      continue;
    }
    const std::size_t here = current;
    for (const std::size_t i : now) {
      state[i] = 0;  // when it may not join now, a neighbour that does calls it again
      if (!simple[in_ball(i)]) continue;
      ball[i] = 1, state[i] = 2;
      call(i);
    }
    current = std::min(current, here);
  }
  for (std::size_t i = 0; i < grid.count(); ++i) {
    change.largest += ball[i];
    if (ball[i] || grid.values[i] >= 0.f) continue;
    grid.values[i] = least;
    ++change.cut;
  }
  return change;
}

long euler_number(const Mesh& mesh) {
  std::vector<std::uint8_t> used(mesh.positions.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t) used[corner] = 1;
  return std::ranges::count(used, 1) - long(mesh.triangles.size() / 2);
}

}  // namespace forest
