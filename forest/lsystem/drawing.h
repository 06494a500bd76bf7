// SPDX-License-Identifier: Apache-2.0
// What a turtle has drawn, line by line, until it is made a neuron. Private to this room.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "forest/lsystem/body.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

class Drawing {
 public:
  using Node = std::uint32_t;  // a drawn point
  static constexpr Node none = 0xffffffffu;

  /// With what is drawn.
  struct Pen {
    SectionKind kind = SectionKind::undefined;
    std::int32_t tag = 0;
    std::uint32_t gauge = 0, spines = 0;  // as they were added; 0: none
  };

  void reserve(std::size_t points) { points_.reserve(points); }
  std::uint32_t add_gauge(std::span<const Trace::Stop> stops, double even);  // the same one has one number
  std::uint32_t add_spines(const Spines& spines);
  const Gauge& gauge(std::uint32_t i) const { return gauges_[i]; }

  Node next() const { return Node(points_.size()); }
  /// A root of one point.
  Node begin(const Eigen::Vector3d& place, float radius, const Pen& pen);
  /// A segment from a point to a place.
  Node line(Node from, const Eigen::Vector3d& to, float start_radius, float radius, const Pen& pen);

  /// Turns the end of a traced branch, which begins at one point and leads to another, so that its last step has this direction (unit):
  /// how a fork stands on the step before it belongs to the fork. The turn fades over the steps before; what lies farther away stays.
  void approach(Node begun, Node end, const Eigen::Vector3d& direction);
  /// Takes diameters under a gauge to being as frequent as it says, by its share `even`.
  void even_out();

  /// A section runs on while a point has one drawn daughter, which is the next point, of the same kind.
  Morphology build(const std::optional<Soma>& soma, const Annotations& annotations);

 private:
  struct Drawn {
    Eigen::Vector3d position;
    float radius, start_radius;  // of the segment that ends here
    Node parent;
    std::uint32_t children;
    Pen pen;
  };
  std::vector<Drawn> points_;
  std::vector<Gauge> gauges_{Gauge()};
  std::vector<Spines> spines_{Spines()};
};

}  // namespace forest::lsystem
