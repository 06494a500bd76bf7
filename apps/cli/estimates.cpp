// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/estimates.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace forest::cli {

using namespace statistics;

nlohmann::ordered_json interval_of(const Estimate& e) {
  return {{"value", e.value}, {"lower", e.lower}, {"upper", e.upper}};
}

std::string with_interval(const Estimate& e) {
  return fmt::format("{:.3f} ({:.3f}–{:.3f})", e.value, e.lower, e.upper);
}

IntervalRow interval_row(std::string label, const Estimate& e, std::size_t colour, std::string note) {
  return {.label = std::move(label),
          .value = e.value,
          .lower = e.lower,
          .upper = e.upper,
          .note = std::move(note),
          .colour = colour};
}

StripPanel panel_of(const Feature& feature, std::span<const FeatureTable* const> tables) {
  StripPanel panel{.title = feature.name, .unit = feature.unit, .samples = {}};
  for (const FeatureTable* table : tables) {
    const auto column = std::ranges::find(table->features, feature) - table->features.begin();
    const auto values = table->values.col(column);
    panel.samples.emplace_back(values.begin(), values.end());
  }
  return panel;
}

}  // namespace forest::cli
