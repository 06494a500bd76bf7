// SPDX-License-Identifier: Apache-2.0
// Types of cells, found without being told: k medoids (Kaufman & Rousseeuw 1990) in the space of principal components. How
// many there are is told by the silhouette (Rousseeuw 1987), and whether there is more than one by what it reaches on a
// single cloud of the same extent, a Gaussian as in SigClust (Liu et al. 2008). How surely: by dealing anew.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forest/core/progress.h"
#include "forest/statistics/features.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {

/// A way to divide cells into so many types.
struct Division {
  std::size_t types = 1;
  std::vector<std::uint32_t> type;     // of each cell, 0 … types - 1, the largest first
  std::vector<std::uint32_t> medoids;  // the most central cell of each type
  double silhouette = 0.;  // mean over cells (Rousseeuw 1987): 1 far apart, 0 touching; 0 for one type
  double by_chance = 0.;   // what it is in 95 of 100 single clouds, at most
  double stability = 1.;   // mean adjusted Rand index of divisions of four fifths of the cells, drawn anew
};

/// A feature by which cells of one type differ from all others.
struct Trait {
  Feature feature;
  Estimate delta;  // Cliff's: cells of the type against the others
  double mean_inside = 0., mean_outside = 0.;
};

struct Types {
  std::vector<Division> divisions;  // into 1, 2, … types
  double p = 1.;                    // that one cloud has as high a silhouette, for whichever number of types
  std::size_t chosen = 0;           // of divisions
  std::vector<std::vector<Trait>>
      traits;                  // of each type, the most telling first, at most eight, no two nearly the same
  Eigen::MatrixXd components;  // cells × principal components, for pictures
  Eigen::VectorXd shares;      // of the variance

  const Division& division() const { return divisions[chosen]; }
};

struct TypesOptions {
  std::size_t most =
      8;  // types that are tried; twice as many where more than half of them are the best, three cells a type at least
  std::optional<std::size_t> types = {};  // as many; found when not said
  std::uint64_t seed = 0;
};

/// Throws Error for fewer than six cells, or more than 1,500.
Types find_types(const FeatureTable& table, const TypesOptions& options,
                 Progress& progress = Progress::none());

/// How well two divisions agree, corrected for chance (Hubert & Arabie 1985): 1 the same, 0 as by chance.
double adjusted_rand(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b);

}  // namespace forest::statistics
