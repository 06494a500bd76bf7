// SPDX-License-Identifier: Apache-2.0
#include "forest/io/traced_branch.h"

#include <algorithm>
#include <limits>

namespace forest::io {

TracedSections::Closed TracedSections::close(TracedBranch& branch, std::vector<Point>& points,
                                             std::vector<SpineSeat>& spines) {
  Closed closed;
  std::size_t joint = 0;  // points put before the branch's own
  branch.over = true;
  if (!branch.node.valid() && !points.empty())
    closed.early_spines = std::size_t(
        std::ranges::count_if(spines, [](const SpineSeat& s) { return s.points == 0 && !s.said; }));
  if (branch.node.valid() && !points.empty()) {
    const Point& node = end(branch.node);
    const bool repeated = points[0].x == node.x && points[0].y == node.y && points[0].z == node.z;
    if (repeated && points.size() == 1) {
      closed.only_branch_point = branch.excused = true;
      points.clear();
    } else if (!repeated) {
      points.insert(points.begin(), {node.x, node.y, node.z, points[0].radius});
      joint = 1;
    }
  }
  if (!points.empty()) {
    branch.node = builder_.add_section(branch.node, branch.kind, points, branch.tag, branch.soma_point);
    branch.own = true;
    ends_.push_back(points.back());
    if (has_spines_) {
      float length = 0.f;
      for (std::size_t i = 1; i < points.size(); ++i)
        length += (points[i].position() - points[i - 1].position()).norm();
      lengths_.push_back(std::min(length, std::numeric_limits<float>::max()));
    }
  }
  if (!spines.empty()) closed.lost_spines = seat(branch, points, joint, spines);
  points.clear();
  return closed;
}

std::size_t TracedSections::seat(const TracedBranch& branch, const std::vector<Point>& points,
                                 std::size_t joint, std::vector<SpineSeat>& spines) {
  std::size_t lost = 0, at = 0;
  float position = 0.f;
  for (SpineSeat& seat : spines) {
    if (!branch.node.valid()) {
      ++lost;
      continue;
    }
    seat.spine.section = branch.node;
    if (!seat.said) {
      if (points.empty()) {  // behind the section, or behind the one the branch leaves from
        seat.spine.position = lengths_[branch.node.value()];
        seat.spine.head = seat.head - end(branch.node).position();
      } else {
        const std::size_t to = seat.points == 0 ? 0 : seat.points - 1 + joint;
        for (; at < to; ++at) position += (points[at + 1].position() - points[at].position()).norm();
        seat.spine.position = std::min(position, std::numeric_limits<float>::max());
        seat.spine.head = seat.head - points[to].position();
      }
      if (!seat.spine.head.allFinite()) seat.spine.head = Vec3::Zero();
    }
    spines_.push_back(seat.spine);
  }
  spines.clear();
  return lost;
}

void TracedSections::add_spines() {
  for (const Spine& spine : spines_) builder_.add_spine(spine);
  spines_.clear();
}

Soma soma_of_outlines(Soma outlines) {
  outlines.kind = SomaKind::contours;
  if (outlines.points.size() >= 3) return outlines;
  if (outlines.points.size() == 1) outlines.kind = SomaKind::sphere;
  return {.kind = SomaKind::sphere, .points = {outlines.sphere()}, .parents = {}, .contour_starts = {}};
}

}  // namespace forest::io
