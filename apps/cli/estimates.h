// SPDX-License-Identifier: Apache-2.0
// What statistics found, as reports and programs see it: estimates with their intervals, and features cell by cell.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "forest/statistics/features.h"
#include "forest/statistics/two_samples.h"

#include "apps/cli/plots.h"

namespace forest::cli {

nlohmann::ordered_json interval_of(const statistics::Estimate& estimate);  // value, lower, upper
std::string with_interval(const statistics::Estimate& estimate);           // "0.512 (0.471–0.553)"
IntervalRow interval_row(std::string label, const statistics::Estimate& estimate, std::size_t colour,
                         std::string note = {});

/// The feature in each of the tables, all of which have it.
StripPanel panel_of(const statistics::Feature& feature,
                    std::span<const statistics::FeatureTable* const> tables);

}  // namespace forest::cli
