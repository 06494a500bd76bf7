// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/sample.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

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

// Where it never changes, it does so evenly.
std::vector<float> changes_of(std::span<const Trace::Stop> stops) {
  std::vector<float> changes(stops.size(), 0.f);
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const float before = stops[i - 1].diameter, after = stops[i].diameter;
    changes[i] = changes[i - 1] + (before > 0.f && after > 0.f ? std::abs(std::log(after / before)) : 0.f);
  }
  const float all = changes.back();
  for (std::size_t i = 0; i < changes.size(); ++i)
    changes[i] =
        all > 0.f ? changes[i] / all : float(i) / float(std::max<std::size_t>(1, changes.size() - 1));
  changes.back() = 1.f;
  return changes;
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

Course::Course(const Trace& t, float scale) {
  constexpr long few = 4;  // of so few steps each tells too much
  const auto count = long(t.stops.size());
  const long wanted = count < few ? count : std::clamp(std::lround(float(count) * scale), 1l, 2 * count);
  const auto place = [&](long i) { return i ? t.stops[std::size_t(i - 1)].at : Vec3(Vec3::Zero()); };
  const auto way = [&](long i) { return i ? t.lengths[std::size_t(i - 1)] : 0.f; };
  // The first steps, and then those from `skip` steps later, or earlier, on.
  long first = count, skip = 0;
  float least = INFINITY;
  for (long f = std::max(0l, wanted - count); wanted != count && f <= std::min(wanted, count); ++f) {
    const long next = f + count - wanted;
    const float whole = way(f) + t.length() - way(next);
    if (!(whole > 0.f)) continue;
    const Vec3 end = (place(f) + t.end() - place(next)) * (t.length() / whole);
    if (const float off = (end - t.end()).squaredNorm(); off < least)
      least = off, first = f, skip = count - wanted;
  }
  for (long i = 1; i <= first; ++i) places.push_back(place(i)), lengths.push_back(way(i));
  const Vec3 aside = place(first) - place(first + skip);
  const float longer = way(first) - way(first + skip);
  for (long i = first + skip + 1; i <= count; ++i)
    places.push_back(place(i) + aside), lengths.push_back(way(i) + longer);
  if (!skip) return;
  const float times = t.length() / length();
  const Vec3 rest = (t.end() - times * places.back()) / length();
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = times * places[i] + rest * lengths[i];
}

std::size_t Calibre::next(float part, bool long_step) {
  const auto& lengths = of_.lengths;
  const float wanted = part * of_.length();
  const std::size_t end = lengths.size() - 1;
  auto at = std::min(end, std::size_t(std::ranges::lower_bound(lengths, wanted) - lengths.begin()));
  if (at > 0 && wanted - lengths[at - 1] < lengths[at] - wanted) --at;
  if (last_ == none && part < 1.f) at = 0;
  if (at == last_ && at < end && long_step) ++at;
  return last_ = at;
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
    t.changes = changes_of(t.stops);
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

void Sample::ask(std::size_t condition, std::span<const double> of_rows) {
  for (std::size_t row = 0; row < of_rows.size(); ++row)
    condition_values_[row * conditions.size() + condition] = float(of_rows[row]);
  finish();
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
