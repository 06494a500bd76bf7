// SPDX-License-Identifier: Apache-2.0
// What a growing neuron finds around it: the pia, layers, the somata of other cells, and what attracts or repels it. It
// answers questions about places and changes nothing; how a neurite answers to it is the grammar's matter (open L-systems:
// Měch & Prusinkiewicz 1996, "Visual models of plants interacting with their environment").
//
// Coordinates are the tissue's: µm, y grows towards the pia. Where something is missing a question has an answer all the
// same, the one that it would have if the thing were infinitely far: a model grows with and without it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/core/vec.h"
#include "forest/cortex/column.h"

namespace forest::cortex {

/// A source of a substance that diffuses and decays: at a distance r its concentration is strength * exp(-r / reach).
struct Attractor {
  Vec3 at = Vec3::Zero();  // µm
  float strength = 1.f;    // below 0 it repels
  float reach = 100.f;     // µm, > 0

  bool operator==(const Attractor&) const = default;
};

class Environment {
 public:
  using Place = Eigen::Vector3d;
  static constexpr double far_away = 1e9;  // µm: the distance of what is not there

  /// Nothing at all.
  Environment();
  /// @param layers  from the pia downwards; the pia is the top of the first. A border belongs to the layer above it. None:
  ///                there is no pia
  /// Throws Error that names the first layer, soma or attractor whose numbers are not finite or out of range.
  explicit Environment(std::vector<Slab> layers, std::vector<Sphere> somata = {},
                       std::vector<Attractor> attractors = {});

  std::optional<double> pia() const;  // its y
  std::span<const Slab> layers() const { return layers_; }
  std::span<const Sphere> somata() const { return somata_; }
  std::span<const Attractor> attractors() const { return attractors_; }
  /// The same for environments in which there is the same, wherever they were read; for the provenance of what grows in it.
  const std::string& hash() const { return hash_; }

  /// Below the pia, µm; above it negative. Without a pia: far_away.
  double depth(const Place& place) const;

  struct Stratum {
    int layer = 0;  // the number in its name, "L2/3" is 2, or its rank from 1 on; 0 outside of all layers
    double above = far_away;  // µm to its upper border, seen from below it
    double below = far_away;  // … and to its lower one
  };
  Stratum stratum(const Place& place) const;

  struct Nearest {
    double distance = far_away;              // µm to its surface; negative within
    Place direction = Place::Zero();         // unit, to its centre
    std::optional<std::uint32_t> soma = {};  // in somata()
  };
  /// Whether the place lies in the soma. One that encloses the place where a neuron grows is that neuron's own.
  static bool encloses(const Sphere& soma, const Place& place) {
    const double radius = double(soma.radius);
    return (soma.centre.cast<double>() - place).squaredNorm() <= radius * radius;
  }
  /// The nearest soma but those that enclose `own`.
  Nearest nearest_soma(const Place& place, const Place& own) const;

  struct Field {
    double density = 0.;              // the sum of all attractors
    Place direction = Place::Zero();  // unit: where it grows most
  };
  Field field(const Place& place) const;

  /// Calls visit(const Sphere&) for every soma that may come nearer than `reach` to the place, and for some others.
  template <class Visit>
  void for_somata(const Place& place, double reach, Visit&& visit) const {
    const Cells cells = cells_around(place, reach + widest_);
    for (int z = cells.low[2]; z <= cells.high[2]; ++z)
      for (int y = cells.low[1]; y <= cells.high[1]; ++y)
        for (std::uint32_t i = first_[row(y, z) + std::size_t(cells.low[0])];
             i < first_[row(y, z) + std::size_t(cells.high[0]) + 1]; ++i)
          visit(somata_[order_[i]]);
  }

 private:
  struct Cells {  // of the grid, both ends included; none when low > high
    Eigen::Vector3i low = Eigen::Vector3i::Zero(), high = Eigen::Vector3i::Constant(-1);
  };
  Cells cells_around(const Place& place, double reach) const;
  std::size_t row(int y, int z) const {
    return (std::size_t(z) * std::size_t(size_[1]) + std::size_t(y)) * std::size_t(size_[0]);
  }

  std::vector<Slab> layers_;
  std::vector<int> numbers_;  // of layers
  std::string hash_;
  std::vector<Sphere> somata_;
  std::vector<Attractor> attractors_;
  // A grid over the centres of the somata: those of cell c are order_[first_[c]] to order_[first_[c + 1]].
  Place low_ = Place::Zero();
  double cell_ = 1., widest_ = 0.;
  Eigen::Vector3i size_ = Eigen::Vector3i::Ones();
  std::vector<std::uint32_t> first_, order_;
};

/// The environment and where in it a neuron grows: the place of its origin. The environment must outlive it.
struct Site {
  const Environment* environment = nullptr;  // none: nothing around it
  Vec3 at = Vec3::Zero();
  std::string name = {};  // of the environment, for people
};

}  // namespace forest::cortex
