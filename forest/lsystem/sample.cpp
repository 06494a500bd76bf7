// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/sample.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::lsystem {
namespace {

constexpr float far = -1e30f;  // the logarithm of no chance at all

// sums[i] -= ½ (column[i] - wanted)².
void add_kernel(const float* column, float wanted, std::size_t count, float* sums) {
  for (std::size_t i = 0; i < count; ++i) {
    const float off = column[i] - wanted;
    sums[i] -= .5f * off * off;
  }
}

}  // namespace

Vec3 heading_at_end(const Vec3& from, std::span<const Trace::Stop> stops) {
  if (stops.empty()) return Vec3::Zero();
  const Vec3 end = stops.back().at;
  float left = heading_reach;
  Vec3 at = end;
  for (std::size_t i = stops.size(); i-- > 0;) {
    const Vec3 before = i ? stops[i - 1].at : from;
    const float length = (at - before).norm();
    if (length >= left) {
      at += (before - at) * (left / length);
      break;
    }
    left -= length, at = before;
  }
  const Vec3 way = end - at;
  const float length = way.norm();
  return length > 0.f ? Vec3(way / length) : Vec3(Vec3::Zero());
}

float Trace::diameter_at(float part) const {
  const float wanted = part * length();
  const auto i = std::size_t(std::ranges::lower_bound(lengths, wanted) - lengths.begin());
  if (i == 0) return stops.front().diameter;
  if (i == stops.size()) return stops.back().diameter;
  return stops[wanted - lengths[i - 1] < lengths[i] - wanted ? i - 1 : i].diameter;
}

void Sample::add(std::span<const double> condition_row, std::span<const double> outcome_row,
                 std::vector<Trace> branches) {
  for (const double value : condition_row) condition_values_.push_back(float(value));
  outcome_values_.insert(outcome_values_.end(), outcome_row.begin(), outcome_row.end());
  for (Trace& t : branches) {
    t.ahead = heading_at_end(Vec3::Zero(), t.stops);
    float length = 0.f;
    Vec3 last = Vec3::Zero();
    for (const Trace::Stop& stop : t.stops)
      t.lengths.push_back(length += (stop.at - last).norm()), last = stop.at;
  }
  branches_.push_back(std::move(branches));
}

void Sample::finish() {
  const std::size_t wide = conditions.size();
  const auto value = [&](std::size_t row, std::size_t c) { return condition_values_[row * wide + c]; };
  std::map<std::vector<float>, std::vector<std::uint32_t>> by_key;
  for (std::size_t row = 0; row < rows(); ++row) {
    std::vector<float> key;
    for (std::size_t c = 0; c < wide; ++c)
      if (conditions[c].match == Match::same) key.push_back(value(row, c));
    by_key[std::move(key)].push_back(std::uint32_t(row));
  }
  groups_.clear();
  for (auto& [key, members] : by_key) {
    Group group{key, std::move(members), {}, {}};
    for (std::size_t c = 0; c < wide; ++c) {
      const Condition& condition = conditions[c];
      if (condition.match == Match::same) continue;
      const double width = condition.widths.values.empty()
                               ? condition.width
                               : condition.widths.lookup(double(value(group.rows[0], condition.by)));
      group.widths.push_back(condition.match == Match::like ? float(width) : 1.f);
      for (const std::uint32_t row : group.rows) group.columns.push_back(value(row, c) / group.widths.back());
    }
    groups_.push_back(std::move(group));
  }
}

std::size_t Sample::draw(std::span<const double> wanted, Random& random) const {
  thread_local std::vector<float> key, chances;
  key.clear();
  for (std::size_t c = 0; c < conditions.size(); ++c)
    if (conditions[c].match == Match::same) key.push_back(float(wanted[c]));
  const auto group = std::ranges::lower_bound(groups_, key, {}, &Group::key);
  if (group == groups_.end() || group->key != key)
    throw Error(fmt::format("sample {} has no row for {}; add one or ask for what there is", name,
                            fmt::join(key, ", ")));
  const std::size_t count = group->rows.size();
  chances.assign(count, 0.f);
  const float *column = group->columns.data(), *width = group->widths.data();
  for (std::size_t c = 0; c < conditions.size(); ++c) {
    if (conditions[c].match == Match::same) continue;
    if (conditions[c].match == Match::like) {
      add_kernel(column, float(wanted[c]) / *width, count, chances.data());
    } else {
      const float other = float(wanted[c]);
      if (std::any_of(column, column + count, [&](float x) { return x != other; }))
        for (std::size_t i = 0; i < count; ++i) chances[i] += column[i] == other ? far : 0.f;
    }
    column += count, ++width;
  }
  const float best = *std::ranges::max_element(chances);
  float total = 0.f;
  for (float& chance : chances) total += chance = chance > best - 20.f ? std::exp(chance - best) : 0.f;
  float left = float(random.uniform()) * total;
  std::size_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (chances[i] == 0.f) continue;
    last = i;
    if ((left -= chances[i]) < 0.f) break;
  }
  return group->rows[last];
}

}  // namespace forest::lsystem
