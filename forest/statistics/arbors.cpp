// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/arbors.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"

namespace forest::statistics {

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

  const std::vector<double> distances = path_distances(neuron);
  std::vector<std::int32_t> index(all.size(), -1);  // of each section of the neuron among the selected
  std::vector<Bifurcation> forks;                   // of each selected section: its first and last daughter
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!kinds.contains(all[i].kind)) continue;
    const auto here = std::uint32_t(sections_.size());
    const SectionId above = all[i].parent;
    Branch branch{
        .id = SectionId(i), .length = section_length(neuron, SectionId(i)), .path_distance = distances[i]};
    if (above.valid()) branch.parent = index[above.value()];
    if (branch.parent >= 0) {
      Bifurcation& fork = forks[std::size_t(branch.parent)];
      (sections_[std::size_t(branch.parent)].daughters++ == 0 ? fork.left : fork.right) = here;
    }
    index[i] = std::int32_t(here);
    sections_.push_back(branch);
    forks.push_back({here, 0, 0});
  }
  for (const Bifurcation& fork : forks)
    if (sections_[fork.parent].daughters == 2) bifurcations_.push_back(fork);

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

}  // namespace forest::statistics
