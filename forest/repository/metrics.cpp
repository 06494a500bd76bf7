// SPDX-License-Identifier: Apache-2.0
// Metrics that are stored because somebody asked for it.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/repository/impl.h"
#include "forest/repository/stored_metrics.h"
#include "forest/statistics/metric.h"

namespace forest::repository {

bool can_store(const statistics::Metric& metric) { return metric.name != "type"; }

/// Its number in the table `metrics`, where it is entered if it is not there.
int Repository::Impl::number_of_metric(const statistics::Metric& metric) {
  if (const int number = stored_number(metric)) return number;
  const std::string name(metric.name), level(statistics::name_of(metric.level)), unit(metric.unit),
      definition(metric.definition);
  if (const auto known = ask<int>("select id from metrics where name = :name", name)) return *known;
  const int number = std::max(first_further_number, ask<int>("select max(id) from metrics").value_or(0) + 1);
  sql << "insert into metrics (id, name, level, unit, definition) values (:id, :name, :level, :unit, "
         ":definition)",
      use(number), use(name), use(level), use(unit), use(definition);
  return number;
}

void Repository::store_metrics(NeuronId id,
                               std::span<const std::pair<const statistics::Metric*, double>> values) {
  for (const auto& [metric, value] : values)
    if (!can_store(*metric))
      throw Error("the metric type cannot be stored, for a neuron has a type anyway; leave it out");
  impl_->write([&] {
    const int neuron = number_of(id);
    if (!impl_->ask<int>("select id from neurons where id = :id", neuron))
      throw Error(fmt::format("{} holds no neuron of id {}", impl_->place, neuron));
    for (const auto& [metric, value] : values) {
      const int number = impl_->number_of_metric(*metric);
      impl_->sql << fmt::format("delete from neuron_metrics where metric = {} and neuron = {}", number,
                                neuron);
      if (!std::isfinite(value)) continue;
      impl_->sql << fmt::format("insert into neuron_metrics (metric, neuron, value) values ({}, {}, :value)",
                                number, neuron),
          use(value);
    }
    return true;
  });
}

}  // namespace forest::repository
