// SPDX-License-Identifier: Apache-2.0
// Barcodes of cells as pictures, to be averaged and compared (Adams et al. 2017, Kanari et al. 2018): every bar a Gaussian
// in the plane of where it begins and where it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "forest/statistics/barcode.h"
#include "forest/statistics/sample_distance.h"

namespace forest::statistics {

using Bars = std::vector<Bar>;

/// Of all cells on the same grid.
struct PersistenceImages {
  Eigen::Index side = 0;  // pixels
  double reach = 0.;  // µm at the end of both axes: 95 of 100 cells have no bar beyond, which counts there
  Eigen::MatrixXd images;  // cells × pixels, birth fastest, each with sum 1 (0 for a cell without bars)
};

/// @param width  standard deviation of the Gaussians over the length of the axes
PersistenceImages persistence_images(std::span<const Bars> cells, Eigen::Index side = 24, double width = .03);

/// Half the sum of differences between the mean images of the first cells and of the others: 0 for the same, 1 where
/// nothing lies on top of one another; p by dealing the cells anew.
DistanceTest barcode_distance(const PersistenceImages& images, std::size_t first, std::size_t dealings,
                              std::uint64_t seed, std::span<const std::uint32_t> slices = {});

}  // namespace forest::statistics
