// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/packing.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

constexpr double side = PackedCube::side;
constexpr std::size_t count = std::size_t(PackedCube::side) * PackedCube::side * PackedCube::side;
static_assert(count <= 65536, "an item has 16 bits for the number of a point in its cube");

enum Stream : std::uint32_t { cube_stream = 0x70636b00, frame_stream };

// Sorts points by the cells of a grid of n³; returns where each cell begins.
std::vector<std::uint32_t> sort_by_cells(std::vector<Place>& points, int n) {
  const auto cell_of = [n](const Place& p) {
    std::size_t c = 0;
    for (int a = 2; a >= 0; --a) c = c * std::size_t(n) + std::size_t(std::min(n - 1, int(p[a] * n / side)));
    return c;
  };
  std::vector<std::uint32_t> first(std::size_t(n) * std::size_t(n) * std::size_t(n) + 1);
  for (const Place& p : points) ++first[cell_of(p) + 1];
  for (std::size_t c = 1; c < first.size(); ++c) first[c] += first[c - 1];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  std::vector<Place> sorted(points.size());
  for (const Place& p : points) sorted[next[cell_of(p)]++] = p;
  points = std::move(sorted);
  return first;
}

// The part of an element between two corners in (u, v, w).
Hexahedron part(Hexahedron h, const Place& low, const Place& high) {
  for (int a = 0; a < 3; ++a) {
    if (high[a] < 1.) h = split(h, a, high[a])[0];
    if (low[a] > 0.) h = split(h, a, low[a] / high[a])[1];
  }
  return h;
}

}  // namespace

// Points too near to one another push each other apart, all at once, somewhat further than they must; half of space filled takes
// some fifty rounds. They begin evenly spread over cubes of eight.
PackedCube pack_cube(double spacing, std::uint64_t seed) {
  if (!(spacing > 0. && spacing <= PackedCube::most_spacing))
    throw Error(
        fmt::format("points cannot keep {:.3g} times their mean distance from one another; {} is the most",
                    spacing, PackedCube::most_spacing));
  PackedCube cube{spacing, {}, {}};
  Random random(seed, 0, cube_stream);
  for (int z = 0; z < side; z += 2)
    for (int y = 0; y < side; y += 2)
      for (int x = 0; x < side; x += 2)
        for (int k = 0; k < 8; ++k) {
          const double a = random.uniform(), b = random.uniform();
          cube.points.emplace_back(x + 2. * a, y + 2. * b, z + 2. * random.uniform());
        }
  const double reach = 1.02 * spacing;
  constexpr double zeal = 1.25;
  const int n = int(side / reach);
  std::vector<Place> moved(count);
  constexpr int most_rounds = 1000;
  for (int round = 0;; ++round) {
    const auto first = sort_by_cells(cube.points, n);
    const std::vector<Place>& points = cube.points;
    std::atomic<bool> near = false;
    parallel_ranges(std::size_t(n) * std::size_t(n), 4, [&](std::size_t begin, std::size_t end) {
      bool here = false;
      for (std::size_t row = begin; row < end; ++row)
        for (int x = 0; x < n; ++x) {
          struct Neighbour {
            std::uint32_t begin, end;
            Place shift;
          };
          std::array<Neighbour, 27> around;
          std::size_t k = 0;
          for (int c = -1; c <= 1; ++c)
            for (int b = -1; b <= 1; ++b)
              for (int a = -1; a <= 1; ++a) {
                Eigen::Vector3i at(x + a, int(row) % n + b, int(row) / n + c);
                Place shift = Place::Zero();
                for (int i = 0; i < 3; ++i)
                  if (at[i] < 0)
                    at[i] += n, shift[i] = -side;
                  else if (at[i] >= n)
                    at[i] -= n, shift[i] = side;
                const auto cell = std::size_t((at[2] * n + at[1]) * n + at[0]);
                around[k++] = {first[cell], first[cell + 1], shift};
              }
          const std::size_t own = row * std::size_t(n) + std::size_t(x);
          for (std::uint32_t i = first[own]; i < first[own + 1]; ++i) {
            Place push = Place::Zero();
            for (const Neighbour& cell : around)
              for (std::uint32_t j = cell.begin; j < cell.end; ++j) {
                const Place away = points[i] - points[j] - cell.shift;
                const double squared = away.squaredNorm();
                if (j == i || squared >= reach * reach) continue;
                const double distance = std::sqrt(squared);
                here |= distance < spacing;
                if (distance > 0.) push += (.5 * zeal * (reach - distance) / distance) * away;
              }
            moved[i] = points[i] + push;
            for (int a = 0; a < 3; ++a) {
              if (moved[i][a] < 0.) moved[i][a] += side;
              if (moved[i][a] >= side) moved[i][a] -= side;
            }
          }
        }
      if (here) near = true;
    });
    if (!near) break;
    if (round == most_rounds) throw Error("points do not come to rest; take another seed");
    cube.points.swap(moved);
  }
  cube.first = sort_by_cells(cube.points, PackedCube::cells);
  return cube;
}

Packing::Packing(std::shared_ptr<const PackedCube> cube, double density, std::uint64_t seed,
                 std::uint32_t stream)
    : cube_(std::move(cube)), unit_(1. / std::cbrt(density)) {
  Random random(seed, stream, frame_stream);
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q[i] = random.normal();
  turn_ = Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  for (int i = 0; i < 3; ++i) shift_[i] = random.uniform(0., side);
}

// The element is cut into blocks small enough to be nearly straight. What lies in a block's box in its own affine frame is
// found by Newton's method within the element, and belongs to the block whose parameters it has.
std::vector<Packed> places_in(const Packing& packing, const Hexahedron& element, double from_w, double to_w) {
  constexpr double rim = 1e-7;
  constexpr int across = 4;
  const int deep = std::max(1, int(std::ceil((to_w - from_w) * 8.)));
  std::vector<std::vector<Packed>> blocks(std::size_t(across * across * deep));
  parallel_for(blocks.size(), 1, [&](std::size_t b) {
    const int i = int(b) % across, j = int(b) / across % across, k = int(b) / (across * across);
    const auto depth = [&](int n) { return n == deep ? to_w : from_w + (to_w - from_w) * n / deep; };
    const Place low(double(i) / across, double(j) / across, depth(k)),
        high(double(i + 1) / across, double(j + 1) / across, depth(k + 1));
    const Hexahedron block = part(element, low, high);
    const Linear middle = linear(block, Place::Constant(.5));
    const Eigen::Matrix3d inverse = middle.jacobian.inverse();
    Place near = Place::Constant(INFINITY), far = -near, box_low = near, box_high = far;
    for (const Place& p : block.points) {
      const Place at = inverse * (p - middle.at), in_cube = packing.to_cube(p);
      near = near.cwiseMin(at), far = far.cwiseMax(at);
      box_low = box_low.cwiseMin(in_cube), box_high = box_high.cwiseMax(in_cube);
    }
    const Place own_low = low.cwiseMax(Place(rim, rim, from_w)),
                own_high = high.cwiseMin(Place(1. - rim, 1. - rim, to_w)), size = high - low;
    packing.for_box(box_low, box_high, [&](std::uint64_t item, const Place& in_cube) {
      const Place place = packing.from_cube(in_cube), at = inverse * (place - middle.at);
      if ((at.array() < near.array() - 1e-6).any() || (at.array() > far.array() + 1e-6).any()) return;
      Place uvw = low + size.cwiseProduct(at + Place::Constant(.5));
      bool arrived = false;
      for (int step = 0; step < 12 && !arrived; ++step) {
        uvw = uvw.cwiseMax(-.2).cwiseMin(1.2);
        const Linear here = linear(element, uvw);
        const Place move = here.jacobian.inverse() * (place - here.at);
        uvw += move;
        arrived = move.squaredNorm() < 1e-14;  // the next step would be some 1e-14
      }
      if (!arrived) return;
      if ((uvw.array() >= own_low.array()).all() && (uvw.array() < own_high.array()).all())
        blocks[b].push_back({item, uvw});
    });
  });
  std::vector<Packed> all;
  std::size_t size = 0;
  for (const auto& block : blocks) size += block.size();
  all.reserve(size);
  for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
  return all;
}

}  // namespace forest::cortex
