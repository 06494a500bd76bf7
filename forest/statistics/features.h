// SPDX-License-Identifier: Apache-2.0
// A population as numbers: one row a cell, one column a feature. Features are the rows of the table of metrics, of
// several groups of sections: what belongs to the neuron as it is, what belongs to its parts by mean and standard
// deviation (and median where values are skewed), Sholl's curve at fixed radii.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "forest/statistics/arbors.h"
#include "forest/statistics/barcode.h"

namespace forest::statistics {

struct Metric;

/// Whether its values change when the same cell is traced by more points.
bool depends_on_points(const Metric& metric);

struct Feature {
  std::string name;  // "basal contraction sd": group, metric, summary
  std::string unit;
  bool diameters = false;  // changes when nothing but diameters do
  bool tracing = false;    // changes with how densely branches were traced, or how the cell lay in its slice
  bool slope = false;      // says how steeply branches leave the plane of the slice
  std::string_view alone = {};  // what the protocol calls it where it asks of it by itself: "depth", "level"

  bool operator==(const Feature&) const = default;
};

/// Sections that are measured together.
struct Group {
  std::string name;
  KindSet kinds;
};

/// The selection itself and, of axon, basal and apical, those that are among it. `word` is one that kind_set() takes.
std::vector<Group> groups_of(std::string_view word);

/// The columns that measure() fills, in its order.
std::vector<Feature> features_of(std::span<const Group> groups);

/// What is measured of one cell.
struct Measured {
  std::vector<double>
      features;  // NaN where not defined, such as the contraction of a kind that the cell has not
  std::vector<double> sholl;  // crossings of spheres of radius sholl_step, 2 sholl_step, … by the first group
  std::vector<Bar> bars;      // of the radial barcodes of the first group
};

/// Where the neuron lies in its file does not matter: it is measured with its soma at the origin.
Measured measure(const Morphology& neuron, std::span<const Group> groups);

struct FeatureTable {
  std::vector<std::string> cells;
  std::vector<Feature> features;
  Eigen::MatrixXd values;                  // cells × features, NaN where not defined
  std::vector<std::vector<double>> sholl;  // of each cell; may be empty for tables that were not measured
  std::vector<std::vector<Bar>> bars;      // likewise
  std::vector<std::string> slices;         // that cells come from (dealing.h); empty: each from its own

  std::size_t size() const { return cells.size(); }
};

FeatureTable table_of(std::vector<std::string> cells, std::span<const Group> groups,
                      std::span<const Measured> measured);

/// Rows one below the other. The tables must have the same features.
FeatureTable stacked(std::span<const FeatureTable> tables);
FeatureTable rows_of(const FeatureTable& table, std::span<const std::size_t> rows);
/// Only what does not depend on diameters: the structure.
FeatureTable structure_of(const FeatureTable& table);
/// Of the structure what is the same however densely branches were traced and however the cell lay: turned about the direction of the
/// pia; it may be nothing.
FeatureTable branching_of(const FeatureTable& table);
/// Only how steep branches are in the slice; it may be nothing.
FeatureTable slopes_of(const FeatureTable& table);

/// What of a table may tell cells apart: without columns that are the same in all cells, repeat another, or are defined in
/// fewer than one of twenty cells. For features that are missing in some cells a column "… is defined" (0 or 1) is added,
/// one for all that are missing in the same.
FeatureTable distinct(const FeatureTable& table);

/// A distinct table as classifiers and distances take it, every value defined: what is missing becomes the median of its
/// column, and so says nothing beyond "… is defined". Cells that are compared must be completed together, so that the
/// population of a cell cannot be seen from how it was completed.
FeatureTable completed(const FeatureTable& table);

/// The values of a completed table with mean 0 and standard deviation 1 in every column.
Eigen::MatrixXd standardised(const FeatureTable& completed);

/// Of the columns in `order` the first `count` that say something of their own: none whose order of cells is nearly that of
/// one before it (Spearman's correlation beyond ±0.8).
std::vector<std::size_t> unlike(const FeatureTable& completed, std::span<const std::size_t> order,
                                std::size_t count);

}  // namespace forest::statistics
