// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/few_features.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/morphology/transform.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {

void FewFeatures::add(std::string_view name) {
  static constexpr std::pair<std::string_view, Part> parts[] = {
      {"", Part::whole}, {"mean", Part::mean}, {"sd", Part::sd}, {"median", Part::median}};
  auto word = [rest = name]() mutable {
    const std::string_view first = rest.substr(0, rest.find(' '));
    rest.remove_prefix(std::min(rest.size(), first.size() + 1));
    return first;
  };
  const KindSet kinds = kind_set(word());
  const std::string_view metric_name = word(), part_name = word(), beyond = word();
  const auto metric = std::ranges::find(metrics(), metric_name, &Metric::name);
  const auto part = std::ranges::find(parts, part_name, &std::pair<std::string_view, Part>::first);
  if (metric == metrics().end() || metric->level == Level::shell || part == std::end(parts) ||
      !beyond.empty() || (metric->level == Level::neuron) != (part->second == Part::whole))
    throw Error(fmt::format(
        "there is no feature '{}'; name a kind of section, a metric of docs/statistics/metrics.md "
        "and, when that is of parts of a neuron, mean, sd or median, as in basal contraction sd",
        name));
  auto group = std::ranges::find(groups_, kinds, &OfKinds::kinds);
  if (group == groups_.end()) group = groups_.insert(group, {kinds, {}});
  auto one = std::ranges::find(group->metrics, &*metric, &One::metric);
  if (one == group->metrics.end()) one = group->metrics.insert(one, {&*metric, {}});
  one->parts.emplace_back(part->second, count_++);
}

std::vector<double> FewFeatures::measure(const Morphology& neuron) const {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> measured(count_, nan);
  const Morphology placed = centred(neuron);
  for (const OfKinds& group : groups_) {
    const Arbors arbors(placed, group.kinds);
    for (const One& one : group.metrics) {
      const std::vector<double> values = one.metric->values(arbors);
      const Moments of = one.metric->level == Level::neuron ? Moments{1, values.at(0), nan} : moments(values);
      for (const auto& [part, place] : one.parts) {
        const double value = part == Part::sd       ? (of.count > 1 ? of.sd : nan)
                             : part == Part::median ? summarize(values).median
                                                    : of.mean;
        if (std::isfinite(value)) measured[place] = value;  // else coordinates at the end of a float's range
      }
    }
  }
  return measured;
}

}  // namespace forest::statistics
