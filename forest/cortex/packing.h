// SPDX-License-Identifier: Apache-2.0
// Places without end: points all over space, of a given density, no two of them nearer to one another than a spacing. They are
// fixed before anybody asks, as the trees of a forest are, so that whoever asks for those in one piece of tissue gets the same
// ones whatever else is asked for, and places on both sides of a border never come too near.
//
//     ┌──────┬──────┐    One cube of 24³ points is relaxed until none are too near, also across its sides, and
//     │ ·  · │ ·  · │    repeats; it is turned and shifted at random. That reaches half of space filled by spheres
//     │·  ·  │·  ·  │    (spacing .985), where adding one after the other jams at 38 % (Feder 1980); and points keep
//     └──────┴──────┘    apart evenly, as blue noise does. The cube repeats every 240 µm at 10⁶/mm³, 650 at 50,000.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

/// A cube of one point a unit of volume that repeats in all directions.
struct PackedCube {
  static constexpr int side = 24;   // units of length
  static constexpr int cells = 12;  // along a side
  static constexpr double most_spacing = .985;

  double spacing = 0.;                  // no two points, copies included, are nearer
  std::vector<Eigen::Vector3d> points;  // in [0, side)³, sorted by cells, x fastest
  std::vector<std::uint32_t> first;     // points of cell c: first[c] to first[c + 1]
};
/// The same cube for the same spacing and seed, at any number of threads. Throws Error for a spacing above `most_spacing`.
PackedCube pack_cube(double spacing, std::uint64_t seed);

class Packing {
 public:
  /// @param density  points/µm³, > 0
  /// @param stream   of the seed: packings of different streams have nothing to do with one another
  Packing(std::shared_ptr<const PackedCube> cube, double density, std::uint64_t seed, std::uint32_t stream);

  double spacing() const { return cube_->spacing * unit_; }  // µm

  /// Calls visit(item, place) for all within a distance in µm, and for some others; place in µm. An item is the
  /// number of a point among all points everywhere.
  template <class Visit>
  void for_near(const Eigen::Vector3d& place, double distance, Visit&& visit) const {
    const Eigen::Vector3d at = to_cube(place), reach = Eigen::Vector3d::Constant(distance / unit_);
    for_box(at - reach, at + reach,
            [&](std::uint64_t item, const Eigen::Vector3d& p) { visit(item, from_cube(p)); });
  }

  /// In the cube's frame, where the unit of length is density^(−1/3): calls visit(item, place) for all in a box, and some others.
  template <class Visit>
  void for_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Visit&& visit) const;
  Eigen::Vector3d to_cube(const Eigen::Vector3d& place) const {
    return turn_.transpose() * place / unit_ - shift_;
  }
  Eigen::Vector3d from_cube(const Eigen::Vector3d& place) const { return turn_ * (place + shift_) * unit_; }

 private:
  std::shared_ptr<const PackedCube> cube_;
  double unit_;  // µm
  Eigen::Matrix3d turn_;
  Eigen::Vector3d shift_;
};

struct Packed {
  std::uint64_t item;
  Eigen::Vector3d uvw;
};
/// The places of a packing in an element between two depths, from_w <= w < to_w, always in the same order. None of them is given to
/// two elements that share a face: what lies on a side, to a ten-millionth of its length, is given to neither.
std::vector<Packed> places_in(const Packing& packing, const Hexahedron& element, double from_w, double to_w);

template <class Visit>
void Packing::for_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Visit&& visit) const {
  constexpr int n = PackedCube::cells;
  constexpr double cell = double(PackedCube::side) / n;
  const auto index = [](double x) { return int(std::floor(x / cell)); };
  const auto copy_of = [](int c) { return (c - (c < 0 ? n - 1 : 0)) / n; };
  for (int z = index(low.z()); z <= index(high.z()); ++z)
    for (int y = index(low.y()); y <= index(high.y()); ++y)
      for (int x = index(low.x()); x <= index(high.x()); ++x) {
        const Eigen::Vector3i copy(copy_of(x), copy_of(y), copy_of(z));
        const int c = ((z - copy[2] * n) * n + (y - copy[1] * n)) * n + (x - copy[0] * n);
        const Eigen::Vector3d corner = double(PackedCube::side) * copy.cast<double>();
        std::uint64_t block = 0;  // 16 bits an axis: some metres of tissue
        for (int a = 0; a < 3; ++a) block = block << 16 | std::uint16_t(copy[a]);
        for (std::uint32_t i = cube_->first[std::size_t(c)]; i < cube_->first[std::size_t(c) + 1]; ++i)
          visit(block << 16 | i, Eigen::Vector3d(corner + cube_->points[i]));
      }
}

}  // namespace forest::cortex
