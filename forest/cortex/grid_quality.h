// SPDX-License-Identifier: Apache-2.0
// How good the cells of a grid are, by the usual measures: P. Knupp (2000), "Achieving finite element mesh quality via optimization
// of the Jacobian matrix norm and associated quantities. Part II", Int J Numer Meth Eng 48:1165, and the definitions of Verdict
// (Stimpson, Ernst, Knupp, Pébay & Thompson 2007, "The Verdict geometric quality library", SAND2007-1751).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "forest/cortex/grid.h"

namespace forest::cortex {

/// A cell by its corners in the order of Hexahedron::corner; of a plane grid the first four.
using Corners = std::array<Eigen::Vector3d, 8>;

/// A measure. `of` is given the corners, the dimensions (2 or 3) and the mean volume (area) of the grid's cells.
struct CellMeasure {
  const char* name;
  const char* what;
  const char* unit;    // "" : none
  double best;         // of a cube
  bool large_is_good;  // or small is
  double (*of)(const Corners& corners, int dimensions, double mean_volume);
};
std::span<const CellMeasure> cell_measures();
/// Throws Error that lists the names there are.
const CellMeasure& cell_measure(std::string_view name);

/// What a measure says of all cells, in their order.
std::vector<double> measure(const Grid& grid, const CellMeasure& measure);

/// Of a measure over the cells: p1 and p99 are the values that a hundredth of the cells lies at or below (above).
struct QualityRow {
  const CellMeasure* measure;
  double least, p1, median, mean, p99, most;
  double worst() const { return measure->large_is_good ? least : most; }
};
std::vector<QualityRow> quality(const Grid& grid);

double volume(const Grid& grid);  // of the cells: µm³; plane: area

}  // namespace forest::cortex
