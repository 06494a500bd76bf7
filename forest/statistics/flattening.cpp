// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/flattening.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace forest::statistics {
namespace {

bool is_dendrite(SectionKind kind) { return kind == SectionKind::basal || kind == SectionKind::apical; }

/// The sums of |Δx|, |Δy| and |Δz| over pieces of a section.
Eigen::Vector3d ways(std::span<const Point> points) {
  constexpr double piece = 20.;  // µm of path
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double path = 0.;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    path += double((points[i].position() - points[i - 1].position()).norm());
    if (path < piece && i + 1 < points.size()) continue;
    sum += (points[i].position() - points[begin].position()).cwiseAbs().cast<double>();
    begin = i, path = 0.;
  }
  return sum;
}

}  // namespace

Flattening flattening(std::span<const Morphology> neurons) {
  std::vector<Eigen::Vector3d> of(neurons.size(), Eigen::Vector3d::Zero());
  Eigen::Vector3d all = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < neurons.size(); ++n) {
    const auto sections = neurons[n].sections();
    const bool dendrites = std::ranges::any_of(sections, is_dendrite, &Section::kind);
    for (std::size_t s = 0; s < sections.size(); ++s)
      if (!dendrites || is_dendrite(sections[s].kind)) of[n] += ways(neurons[n].points(SectionId(s)));
    all += of[n];
  }
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (!(all.z() > 0.)) return {nan, nan};
  const double ratio = all.x() / all.z(), count = double(neurons.size());
  double squares = 0.;
  for (const Eigen::Vector3d& one : of) {
    const Eigen::Vector3d others = all - one;
    squares += std::pow(others.x() / others.z() - ratio, 2);
  }
  const double error = neurons.size() > 1 ? std::sqrt((count - 1.) / count * squares) : nan;
  return {ratio, std::isfinite(error) ? error : nan};
}

}  // namespace forest::statistics
