// SPDX-License-Identifier: Apache-2.0
// A lattice along the crosses of a surface: a lattice point near every vertex, so that those of neighbours agree as well as they
// can, coarse levels first, and lines of the lattice lie on the valleys (Jakob, Tarini, Panozzo & Sorkine-Hornung 2015, "Instant
// field-aligned meshes", ACM Trans Graph 34:189). Private to this room.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "forest/cortex/crosses.h"

namespace forest::cortex {

// A vertex of one level of the hierarchy, and the lattice seen from it.
struct LatticeSite {
  Place at, normal, along;  // along: one arm of its cross
  double spacing, area;
  Place point;  // a point of the lattice, the nearest
  std::optional<Pass> line;

  Place up() const { return normal.cross(along); }
  Place rounded(const Place& from,
                const Place& to) const {  // the lattice point next to `to` of the lattice with `from`
    const Place d = to - from;
    return from + along * (std::floor(along.dot(d) / spacing + .5) * spacing) +
           up() * (std::floor(up().dot(d) / spacing + .5) * spacing);
  }
};

struct Level {
  std::vector<LatticeSite> sites;
  std::vector<std::uint32_t> starts, list;
  std::vector<float> weights;
  std::vector<std::uint32_t> coarser;  // of each site, in the next level
  std::vector<std::array<std::uint32_t, 2>>
      parts;  // of each site, in the finer level: twice the same where it is one
};

// Sites in waves, one after the other: each site in a later one than its neighbours of lower numbers, and in an earlier one than
// those of higher numbers. Sites of one wave are no neighbours.
struct Waves {
  std::vector<std::uint32_t> starts, sites;  // those of wave k from starts[k] on
};
Waves waves(const Level& level);

/// The sites of a surface, and fewer and fewer that stand for them.
class Lattice {
 public:
  explicit Lattice(Level finest);

  /// Settles it anew for a spacing at each of the finest sites. Sites are settled one after the other, in their order; those
  /// that do not see one another at the same time, so that the number of threads makes no difference.
  /// @return the finest level
  const Level& settle(std::span<const double> spacings);

 private:
  std::vector<Level> levels_;  // the finest first
  std::vector<Waves> waves_;   // of each level
};

/// The step of a lattice from the point of one site to that of another, in the frame of the first: none where they have one
/// point in common.
Eigen::Vector2i step_between(const LatticeSite& a, const LatticeSite& b);

}  // namespace forest::cortex
