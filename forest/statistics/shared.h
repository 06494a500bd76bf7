// SPDX-License-Identifier: Apache-2.0
// Work that several metrics share: functions for Arbors::once.
#pragma once

#include <array>
#include <vector>

#include "forest/statistics/arbors.h"
#include "forest/statistics/barcode.h"
#include "forest/statistics/hull.h"

namespace forest::statistics {

Barcodes radial_barcodes(const Arbors& arbors);
Barcodes path_barcodes(const Arbors& arbors);

struct Hulls {
  std::vector<double> arbor_volumes;  // of each arbor's hull, µm³
  double volume = 0.;                 // of the hull of all points, µm³
  PlanarHull front;                   // of the points seen along z
};

Hulls hulls(const Arbors& arbors);

/// Of each arbor's points, along its principal axes, the greatest first, µm.
std::vector<std::array<double, 3>> principal_extents(const Arbors& arbors);

/// Exponent of Rall's law of each bifurcation, see the metric rall_power.
std::vector<double> rall_powers(const Arbors& arbors);

/// Sections of one Strahler order that follow one another are a stream.
struct Streams {                                          // of order 1, 2, …
  std::vector<double> count, mean_length, mean_diameter;  // µm
};

Streams streams(const Arbors& arbors);

}  // namespace forest::statistics
