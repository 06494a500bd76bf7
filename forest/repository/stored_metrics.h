// SPDX-License-Identifier: Apache-2.0
// Which metrics are stored with every neuron, so that neurons are found by them: those of whole neurons, and means of others
// that tell cells apart. Storing all would take most of the time of an import.
#pragma once

#include <span>

namespace forest::statistics {
struct Metric;
}

namespace forest::repository {

/// In the order of their numbers in the table `metrics`, which count from 1.
std::span<const statistics::Metric* const> stored_metrics();

/// 0 for a metric that is not stored with every neuron.
int stored_number(const statistics::Metric& metric);

/// Others that somebody stored (Repository::store_metrics) have numbers from here on, in the order in which they came.
inline constexpr int first_further_number = 1000;

}  // namespace forest::repository
