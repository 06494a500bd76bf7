// SPDX-License-Identifier: Apache-2.0
// The harmonic field between the two surfaces of a cortex: 1 on the outer one (pia), 0 on the inner one (white matter), and
// the mean of its surroundings everywhere between (Jones, Buchbinder & Aharon 2000, "Three-dimensional mapping of cortical
// thickness using Laplace's equation"). Its field lines leave one surface at right angles and reach the other at right angles,
// and no two of them meet: they are the w-curves.
//
//     pia  ───●────────●────   1        Solved on a lattice of cubes, with what a neighbour would be replaced by the surface
//             │        │                where that comes first, at its exact distance (Shortley & Weller 1938). Two banks of
//             ▼        ▼                a sulcus may lie closer than two nodes: a link that crosses a surface connects nothing,
//   white ────●────────●────   0        and a place takes its slope from the nodes of its own bank only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "forest/core/progress.h"
#include "forest/geometry/mesh.h"

namespace forest::cortex {

using Place = Eigen::Vector3d;  // µm

class Laplace {
 public:
  struct Options {
    double spacing = 300.;    // µm between nodes; a fifth of the least thickness or less
    double tolerance = 1e-6;  // the largest change of a value in the last round
    int most_rounds = 2000;
  };

  /// Both surfaces closed, triangles facing outwards, the inner one within the outer one.
  /// Throws Error when nothing lies between them, the field does not settle in so many rounds, or the lattice would have over 2³¹ nodes, or 65,535 along an axis.
  Laplace(const Mesh& outer, const Mesh& inner, const Options& options,
          Progress& progress = Progress::none());

  std::size_t size() const { return gradients_.size(); }  // nodes between the surfaces
  double spacing() const { return spacing_; }

  /// The slope of the field, 1/µm, along which it grows; `heading` says on which side of a narrow gap one is: roughly where
  /// it grows. None where no node is near.
  std::optional<Place> gradient(const Place& at, const Place& heading) const;

 private:
  struct Crossings;
  struct Nodes;
  std::optional<std::uint32_t> node(int i, int j, int k) const;
  void lay(const Mesh& outer, const Mesh& inner);
  Nodes number(const Crossings& crossings);
  std::vector<float> solve(const Nodes& nodes, const Crossings& crossings, const Options& options,
                           Progress& progress);
  void find_slopes(const Nodes& nodes, const Crossings& crossings, const std::vector<float>& values);

  double spacing_;
  Place origin_ = Place::Zero();
  std::array<int, 3> counts_{};
  std::vector<std::int32_t>
      index_;  // of every node of the lattice, x fastest; below 0: not between the surfaces
  std::vector<Eigen::Vector3f> gradients_;  // a unit of length is the spacing
};

}  // namespace forest::cortex
