// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/arbors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "forest/core/clones.h"
#include "forest/core/error.h"
#include "forest/morphology/measure.h"

namespace forest::statistics {
namespace {

// Of each point and the one before it, whatever section that is of; as truncated cones.
FOREST_CLONES void measure_segments(std::size_t count, const double* __restrict x, const double* __restrict y,
                                    const double* __restrict z, const double* __restrict r,
                                    double* __restrict length, double* __restrict area,
                                    double* __restrict volume) {
  for (std::size_t i = 1; i < count; ++i) {
    const double dx = x[i] - x[i - 1], dy = y[i] - y[i - 1], dz = z[i] - z[i - 1], taper = r[i] - r[i - 1];
    const double l = std::sqrt(dx * dx + dy * dy + dz * dz);
    length[i] = l;
    area[i] = std::numbers::pi * (r[i - 1] + r[i]) * std::sqrt(l * l + taper * taper);
    volume[i] = std::numbers::pi / 3. * l * (r[i - 1] * r[i - 1] + r[i - 1] * r[i] + r[i] * r[i]);
  }
}

FOREST_CLONES void measure_distances(std::size_t count, const double* __restrict x,
                                     const double* __restrict y, const double* __restrict z, double ox,
                                     double oy, double oz, double* __restrict distance) {
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = x[i] - ox, dy = y[i] - oy, dz = z[i] - oz;
    distance[i] = std::sqrt(dx * dx + dy * dy + dz * dz);
  }
}

}  // namespace

KindSet kind_set(std::string_view word) {
  if (word == "all") return KindSet::all();
  if (word == "dendrite") return dendrites;
  const SectionKind kind = section_kind(word);
  if (kind == SectionKind::custom && word != name_of(kind))
    throw Error(
        fmt::format("there is no kind of section called '{}'; use all, dendrite, axon, basal, apical, glia, "
                    "custom, undefined or unspecified",
                    word));
  return {kind};
}

Arbors::Arbors(const Morphology& neuron, KindSet kinds) : neuron_(neuron) {
  const auto all = neuron.sections();
  if (neuron.soma().kind != SomaKind::none) {
    origin_ = neuron.soma().sphere();
  } else if (!neuron.roots().empty()) {
    origin_ = neuron.points(neuron.roots().front()).front();
  }

  std::vector<std::int32_t> index(all.size(), -1);  // of each section of the neuron among the selected
  std::vector<Bifurcation> forks;                   // of each selected section: its first and last daughter
  std::uint32_t rows = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!kinds.contains(all[i].kind)) continue;
    const auto here = std::uint32_t(sections_.size());
    const SectionId above = all[i].parent;
    Branch branch{.id = SectionId(i), .first_row = rows, .row_count = all[i].point_count};
    rows += branch.row_count;
    if (above.valid()) branch.parent = index[above.value()];
    if (branch.parent >= 0) {
      Branch& parent = sections_[std::size_t(branch.parent)];
      Bifurcation& fork = forks[std::size_t(branch.parent)];
      (parent.daughters++ == 0 ? fork.left : fork.right) = here;
      branch.arbor = parent.arbor;
    } else {
      branch.arbor = std::uint32_t(stems_.size());
      stems_.push_back(here);
    }
    index[i] = std::int32_t(here);
    sections_.push_back(branch);
    forks.push_back({here, 0, 0});
  }
  for (const Bifurcation& fork : forks)
    if (sections_[fork.parent].daughters == 2) bifurcations_.push_back(fork);
  measure(rows);

  // From the tips inwards: a section is complete when it is reached, because its daughters come after it.
  std::vector<int> equals(sections_.size(), 0);  // how many daughters share the highest Strahler order
  for (std::size_t i = sections_.size(); i-- > 0;) {
    Branch& b = sections_[i];
    if (b.daughters == 0) b.degree = 1, b.strahler = 1;
    if (equals[i] > 1) ++b.strahler;
    if (b.parent < 0) continue;
    Branch& above = sections_[std::size_t(b.parent)];
    int& ties = equals[std::size_t(b.parent)];
    above.degree += b.degree;
    ties = b.strahler > above.strahler ? 1 : ties + (b.strahler == above.strahler);
    above.strahler = std::max(above.strahler, b.strahler);
  }
}

/// Fills the columns and what the sections say of them.
void Arbors::measure(std::size_t rows) {
  Columns& c = columns_;
  for (auto* column : {&c.x, &c.y, &c.z, &c.radius, &c.length, &c.path, &c.distance}) column->resize(rows);
  for (const Branch& b : sections_) {
    std::size_t row = b.first_row;
    for (const Point& p : points(b))
      c.x[row] = p.x, c.y[row] = p.y, c.z[row] = p.z, c.radius[row++] = p.radius;
  }
  std::vector<double> area(rows), volume(rows);
  measure_segments(rows, c.x.data(), c.y.data(), c.z.data(), c.radius.data(), c.length.data(), area.data(),
                   volume.data());
  measure_distances(rows, c.x.data(), c.y.data(), c.z.data(), origin_.x, origin_.y, origin_.z,
                    c.distance.data());

  // Ways begin at the roots, also through sections that are not selected.
  std::vector<double> ends;
  if (sections_.size() != neuron_.sections().size()) ends = path_distances(neuron_);
  for (Branch& b : sections_) {
    const SectionId above = neuron_.section(b.id).parent;
    const double start = !above.valid()  ? 0.
                         : b.parent >= 0 ? sections_[std::size_t(b.parent)].path_distance
                                         : ends[above.value()];
    c.length[b.first_row] = 0., c.path[b.first_row] = start;
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
      b.length += c.length[row], b.area += area[row], b.volume += volume[row];
      c.path[row] = start + b.length;
    }
    b.path_distance = start + b.length;
  }
}

}  // namespace forest::statistics
