// SPDX-License-Identifier: Apache-2.0
// A neuron as columns of the tables sections, arbors, somata, spines and annotations, and back. No database
// here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "forest/morphology/morphology.h"
#include "forest/morphology/packing.h"

namespace forest::repository {

/// Bytes are little-endian, as on every machine this runs on: a blob is the array itself.
struct Rows {
  std::string points;  // blob: x, y, z, radius as float32, section after section; see morphology/packing.h
  std::string soma_points, soma_links;  // blobs
  SomaKind soma_kind = SomaKind::none;

  struct {  // one entry a section
    std::vector<std::int32_t> parent, arbor, order, kind, tag, soma_point, first_point, point_count,
        daughters;  // parent: -1 for a root
    std::vector<double> length, area, start_diameter, end_diameter, end_x, end_y, end_z;  // pm, nm²: whole
    std::size_t size() const { return parent.size(); }
  } sections;
  struct {  // one entry a root
    std::vector<std::int32_t> root, kind, sections, terminals, order;
    std::vector<double> length;
    std::size_t size() const { return root.size(); }
  } arbors;
  std::vector<int> metric;           // numbers (stored_metrics.h) of those that are defined
  std::vector<double> metric_value;  // of the neuron, or the mean over its sections, bifurcations, …
  std::vector<Spine> spines;
  Annotations annotations;
};

/// How `points` are divided into sections (morphology/packing.h); stands as long as the rows do.
PointRuns runs_of(const Rows& rows);

/// With `measured` the metrics too, which take most of the time.
Rows rows_of(const Morphology& morphology, bool measured = true);

/// The inverse; reads no length, arbor or order, which follow from the rest. Throws Error when the rows fit
/// no neuron.
Morphology morphology_of(const Rows& rows);

/// Of everything the inverse reads.
std::uint64_t checksum(const Rows& rows);

std::string_view name_of(SomaKind kind);  // "none", "sphere", "cylinders", "contours"
std::optional<SomaKind> soma_kind(std::string_view name);

}  // namespace forest::repository
