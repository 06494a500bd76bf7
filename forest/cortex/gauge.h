// SPDX-License-Identifier: Apache-2.0
// How well elements are shaped, eight of them at once: each number of a vector is of another element, so that all arithmetic is
// vector code, whatever the processor, and the same to the last bit. In floats, since a shape is sought and nothing is proven (that is
// certify's); places count from one of the element's own, which keeps them to .1 nm. Private to this room.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "forest/cortex/elements.h"

namespace forest::cortex {

inline constexpr int lanes = 8;
using Lanes [[gnu::vector_size(sizeof(float) * lanes)]] = float;  // a number of each of eight elements

/// The places of up to eight elements at u, v, w = 0, 1/3, 2/3, 1; u fastest, as in a Hexahedron.
class Batch {
 public:
  using Places = Eigen::Matrix<double, 3, 64>;

  void set(int lane, const Places& places) {
    origins_[std::size_t(lane)] = places.col(0);
    for (int p = 0; p < 64; ++p) move(lane, p, places.col(p));
  }
  void move(int lane, int place, const Eigen::Vector3d& to) {
    for (int one = 0; one < 3; ++one)
      at_[one][place][lane] = float(to[one] - origins_[std::size_t(lane)][one]);
  }
  const Lanes (&at() const)[3][64] { return at_; }  // by coordinate, µm

 private:
  Lanes at_[3][64];
  std::array<Eigen::Vector3d, lanes> origins_;
};

/// The first elements of a list, as many as there are lanes; where it ends, its last one again.
Batch batch_of(const Elements& elements, std::span<const std::uint32_t> list);

/// Looked at by 5×5×5 places, or by 9×9×9 where an element may fold between these.
enum class Samples : unsigned char { few, many };

struct Shape {
  Lanes least;   // scaled Jacobian (see Hexahedron)
  Lanes volume;  // µm³, by Boole's rule
  Lanes tilt;    // ∫ (1 − 2 w) dV, likewise: above 0 if it is wider outside than inside
};
Shape look(const Batch& batch, Samples samples);

/// Of each of some elements, or of all of them, at few places.
struct Looks {
  std::vector<float> least, volume, tilt;
};
Looks look(const Elements& elements, std::span<const std::uint32_t> of);
Looks look(const Elements& elements);

struct Wanted {
  float scaled;  // Jacobian, at every place
  float fold;    // how softly it begins to count that a place is nearly folded
};
struct Lack {
  Lanes value;  // Σ (wanted − s)² / χ(s) over places where s is less; χ is s well above 0, and never 0
  Lanes gradient[3][64];  // of that and of what `counts`, by the coordinates of places
};
struct Counts {
  Lanes volume, tilt;  // what a µm³ more of each counts
};
void weigh(const Batch& batch, Samples samples, const Wanted& wanted, const Counts& counts, Lack& lack);

}  // namespace forest::cortex
