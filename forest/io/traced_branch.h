// SPDX-License-Identifier: Apache-2.0
// What the text and the XML files of Neurolucida (asc.cpp, nmf.cpp) have in common: a branch hangs on the point where the
// one before it split, and may repeat that point or not; spines stand among its points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// A branch while it is read.
struct TracedBranch {
  SectionId node;  // the section it leaves from; once its points are over, the one that ends there
  SectionKind kind = SectionKind::undefined;
  std::int32_t tag = 0, soma_point = -1;
  bool over = false;     // no point may follow
  bool own = false;      // has a section
  bool excused = false;  // has none, for a reason that was told
};

/// A spine until its section is known.
struct SpineSeat {
  std::size_t points = 0;  // of the branch before it
  Spine spine;
  Vec3 head = Vec3::Zero();  // place of the head, µm
  bool said = false;         // the spine is complete but for its section
};

/// Sections of such branches, put into a builder parents first.
class TracedSections {
 public:
  /// @param spines  whether there may be any; without them lengths need not be known
  TracedSections(MorphologyBuilder& builder, bool spines) : builder_(builder), has_spines_(spines) {}

  std::size_t size() const { return ends_.size(); }
  const Point& end(SectionId section) const { return ends_[section.value()]; }

  struct Closed {
    bool only_branch_point =
        false;                     // the branch held nothing but the point it leaves from, and has no section
    std::size_t lost_spines = 0;   // that stand where their tree has no point
    std::size_t early_spines = 0;  // that stand before the first point of their tree, and are put on it
  };
  /// The branch has no more points: `points` become a section and `spines` sit on it; both are left empty. A branch that
  /// does not repeat the point it leaves from begins there with the radius of its own first point.
  Closed close(TracedBranch& branch, std::vector<Point>& points, std::vector<SpineSeat>& spines);

  /// The spines, when all branches are closed.
  void add_spines();

 private:
  std::size_t seat(const TracedBranch& branch, const std::vector<Point>& points, std::size_t joint,
                   std::vector<SpineSeat>& spines);

  MorphologyBuilder& builder_;
  bool has_spines_;
  std::vector<Point> ends_;     // of each section
  std::vector<float> lengths_;  // of each section, µm, where there may be spines
  std::vector<Spine> spines_;
};

/// The soma that is traced as outlines (points and contour_starts): of fewer than three points a sphere of their size.
Soma soma_of_outlines(Soma outlines);

}  // namespace forest::io
