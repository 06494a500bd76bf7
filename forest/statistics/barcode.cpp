// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/barcode.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forest::statistics {

Barcodes::Barcodes(const Arbors& arbors, Filtration filtration) {
  const auto sections = arbors.sections();
  const Columns& c = arbors.columns();
  first_.push_back(0);
  for (const std::uint32_t stem : arbors.stems()) first_.push_back(first_.back() + sections[stem].degree);
  bars_.resize(first_.back());

  const auto distance = [&](const Branch& b) {  // of its end
    const std::size_t start = sections[arbors.stems()[b.arbor]].first_row, end = b.last_row();
    if (filtration == Filtration::path) return c.path[end] - c.path[start];
    const double x = c.x[end] - c.x[start], y = c.y[end] - c.y[start], z = c.z[end] - c.z[start];
    return std::sqrt(x * x + y * y + z * z);
  };
  // From the tips inwards, daughters before their parent.
  std::vector<std::size_t> free(first_.begin() + 1,
                                first_.end());         // where each arbor's next bar goes, from its end
  std::vector<double> furthest(sections.size(), -1.);  // tip of what arrived at a section's end so far
  for (std::size_t i = sections.size(); i-- > 0;) {
    const Branch& b = sections[i];
    const double tip = b.daughters == 0 ? distance(b) : furthest[i];
    if (b.parent < 0) {
      bars_[--free[b.arbor]] = {tip, 0.};
      continue;
    }
    double& other = furthest[std::size_t(b.parent)];
    if (other >= 0.)
      bars_[--free[b.arbor]] = {std::min(tip, other), distance(sections[std::size_t(b.parent)])};
    other = std::max(tip, other);
  }
}

double total_persistence(std::span<const Bar> bars) {
  double total = 0.;
  for (const Bar& bar : bars) total += bar.length();
  return total;
}

double longest_bar(std::span<const Bar> bars) {
  double longest = 0.;
  for (const Bar& bar : bars) longest = std::max(longest, bar.length());
  return longest;
}

double entropy(std::span<const Bar> bars) {
  const double total = total_persistence(bars);
  if (!(total > 0.)) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0.;
  for (const Bar& bar : bars)
    if (const double share = bar.length() / total; share > 0.) sum -= share * std::log(share);
  return sum;
}

}  // namespace forest::statistics
