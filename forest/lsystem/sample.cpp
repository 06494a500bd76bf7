// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/clones.h"
#include "forest/core/error.h"

namespace forest::lsystem {
namespace {

constexpr float far = -1e30f;    // the logarithm of no chance at all
constexpr float hardly = -20.f;  // … of what has none beside the best

// The logarithm of a kernel.
float kernel(float value, float wanted) {
  const float off = value - wanted;
  return -(.5f * off * off);
}
FOREST_CLONES void add_kernel(const float* column, float wanted, std::size_t count, float* sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += kernel(column[i], wanted);
}
FOREST_CLONES void forbid(const float* column, float value, std::size_t count, float* sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += column[i] == value ? far : 0.f;
}
// Those above a limit, in their order.
FOREST_CLONES void find_above(const float* values, std::size_t count, float limit,
                              std::vector<std::uint32_t>& found) {
  constexpr std::size_t lanes = 16;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    int any = 0;
    for (std::size_t k = 0; k < lanes; ++k) any |= int(values[i + k] > limit);
    if (!any) continue;
    for (std::size_t k = 0; k < lanes; ++k)
      if (values[i + k] > limit) found.push_back(std::uint32_t(i + k));
  }
  for (; i < count; ++i)
    if (values[i] > limit) found.push_back(std::uint32_t(i));
}
FOREST_CLONES std::size_t largest(const float* values, std::size_t count) {
  constexpr std::size_t lanes = 16;
  float best[lanes];
  std::fill_n(best, lanes, values[0]);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    for (std::size_t k = 0; k < lanes; ++k) best[k] = values[i + k] > best[k] ? values[i + k] : best[k];
  const float most = std::max(*std::max_element(best, best + lanes),
                              *std::max_element(values + std::min(i, count - 1), values + count));
  const float* const found = std::find(values, values + count, most);
  return found == values + count ? 0 : std::size_t(found - values);  // when they are no numbers
}

// How long the step is that ends at a place, when these are the ways to all of them.
float step_to(std::span<const float> lengths, std::size_t i) {
  return lengths[i] - (i ? lengths[i - 1] : 0.f);
}

// Where a diameter never changes, it does so evenly.
void share_changes(std::vector<Calibre>& places) {
  for (std::size_t i = 1; i < places.size(); ++i) {
    const float before = places[i - 1].diameter, after = places[i].diameter;
    places[i].change =
        places[i - 1].change + (before > 0.f && after > 0.f ? std::abs(std::log(after / before)) : 0.f);
  }
  const float all = places.back().change;
  for (std::size_t i = 0; i < places.size(); ++i)
    places[i].change =
        all > 0.f ? places[i].change / all : float(i) / float(std::max<std::size_t>(1, places.size() - 1));
  places.back().change = 1.f;
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
  places.reserve(std::size_t(wanted)), lengths.reserve(std::size_t(wanted));
  for (long i = 1; i <= first; ++i) places.push_back(place(i)), lengths.push_back(way(i));
  const Vec3 aside = place(first) - place(first + skip);
  const float longer = way(first) - way(first + skip);
  for (long i = first + skip + 1; i <= count; ++i)
    places.push_back(place(i) + aside), lengths.push_back(way(i) + longer);
  if (!skip) return;
  const float times = t.length() / length();
  Vec3 rest = (t.end() - times * places.back()) / length();
  const float higher = std::exchange(rest.z(), 0.f) * length();
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = times * places[i] + rest * lengths[i];
  climb(higher);
}

void Course::climb(float by) {
  if (by == 0.f) return;
  const std::vector<float> heights = climbed(by);
  for (std::size_t i = 0; i < places.size(); ++i) places[i].z() = heights[i];
}

std::vector<float> Course::climbed(float by) const {
  std::vector<float> heights(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) heights[i] = places[i].z();
  if (by == 0.f) return heights;
  // Of each step: how far along z, and its length unless it is level.
  std::vector<float> climbs(places.size()), sloping(places.size());
  float before = 0.f;
  for (std::size_t i = 0; i < places.size(); ++i) {
    climbs[i] = std::abs(places[i].z() - std::exchange(before, places[i].z()));
    sloping[i] = climbs[i] > as_high ? step_to(lengths, i) : 0.f;
  }
  const float whole = std::reduce(climbs.begin(), climbs.end());
  float along = std::reduce(sloping.begin(), sloping.end());
  if (!(along > 0.f)) {
    for (std::size_t i = 0; i < places.size(); ++i) sloping[i] = step_to(lengths, i);
    along = length();
  }
  constexpr float most = .4f;  // of how far it goes along z
  const float share = std::min(1.f, most * whole / std::abs(by));
  float more = 0.f;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (whole > 0.f) more += by * share * climbs[i] / whole;
    if (along > 0.f) more += by * (1.f - share) * sloping[i] / along;
    heights[i] += more;
  }
  return heights;
}

void Course::levels(float share) {
  if (share == 0.f) return;
  std::vector<float> climbs;
  std::vector<std::size_t> to_change;  // if all of them were to
  climbs.reserve(places.size()), to_change.reserve(places.size());
  float before = 0.f;
  for (std::size_t i = 0; i < places.size(); ++i) {
    climbs.push_back(places[i].z() - std::exchange(before, places[i].z()));
    if ((std::abs(climbs[i]) > as_high) == (share > 0.f)) to_change.push_back(i);
  }
  const auto rounded = [&](std::size_t count) { return std::size_t(std::abs(share) * float(count) + .5f); };
  std::vector<bool> changes(places.size());
  if (share > 0.f) {
    if (to_change.empty()) return;
    std::ranges::stable_sort(to_change, {}, [&](std::size_t i) { return std::abs(climbs[i]); });
    to_change.resize(std::min(rounded(to_change.size()), to_change.size() - 1));  // one has to climb
    for (const std::size_t i : to_change) changes[i] = true;
  } else {
    if (to_change.size() == places.size()) return;
    for (std::size_t k = 0; k < to_change.size(); ++k) changes[to_change[k]] = rounded(k + 1) > rounded(k);
  }
  // What changes, with the step that climbs next, or at the end with the last that does.
  std::vector<std::size_t> together;
  const auto share_out = [&](std::size_t climber) {
    together.push_back(climber);
    float climb = 0.f, length = 0.f;
    for (const std::size_t i : together) climb += climbs[i], length += step_to(lengths, i);
    const bool evenly = share < 0.f && length > 0.f;
    for (const std::size_t i : together) climbs[i] = evenly ? climb * step_to(lengths, i) / length : 0.f;
    if (!evenly) climbs[climber] = climb;
    together.clear();
  };
  std::size_t last = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (changes[i])
      together.push_back(i);
    else if (std::abs(climbs[i]) > as_high)
      share_out(last = i);
  }
  if (!together.empty()) share_out(last);
  float at = 0.f;
  for (std::size_t i = 0; i < places.size(); ++i) places[i].z() = at += climbs[i];
}

void Course::stairs(float power) {
  std::vector<float> climbs;
  std::array<float, 2> was{}, is{};  // in all, down and up
  Vec3 before = Vec3::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const float climb = places[i].z() - std::exchange(before, places[i]).z(), length = step_to(lengths, i),
                steep = length > 0.f ? std::min(1.f, std::abs(climb) / length) : 0.f;
    climbs.push_back(std::copysign(length * std::pow(steep, power), climb));
    was[climb > 0.f] += std::abs(climb), is[climb > 0.f] += std::abs(climbs.back());
  }
  float at = 0.f;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool up = climbs[i] > 0.f;
    if (is[up] > 0.f) at += climbs[i] * (was[up] / is[up]);
    places[i].z() = at;
  }
}

void Course::kinks(float times, float power) {
  const std::vector<Vec3> was = places;
  const auto before = [&](std::size_t i) { return i ? was[i - 1] : Vec3(Vec3::Zero()); };
  std::vector<float> turns, wanted;
  turns.reserve(was.size()), wanted.reserve(was.size());
  float sum = 0.f, sum_wanted = 0.f;
  for (std::size_t i = 0; i + 1 < was.size(); ++i) {
    const Vec3 step = was[i] - before(i), next = was[i + 1] - was[i];
    turns.push_back(std::atan2(step.cross(next).norm(), step.dot(next)));
    wanted.push_back(turns[i] > 0.f ? std::pow(turns[i], power) : 0.f);
    sum += turns[i], sum_wanted += wanted[i];
  }
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const float here = step_to(lengths, i), beside = step_to(lengths, i + 1);
    if (!(turns[i] > 0.f && here + beside > 0.f)) continue;
    // Places beside it move too: moved by all of what is wanted, angles of traced dendrites change by .6 of it.
    constexpr float share = 1.f / .6f, least = -.8f, most = 1.5f;
    const float more = times * wanted[i] * (sum / sum_wanted) / turns[i] - 1.f;
    Vec3 off = was[i] - (before(i) + (was[i + 1] - before(i)) * (here / (here + beside)));
    off.z() = 0.f;
    places[i] += std::clamp(share * more, least, most) * off;
  }
}

namespace {

// Unit; zero when all is one place.
Vec3 last_step_at_end(std::span<const Trace::Stop> stops) {
  for (std::size_t i = stops.size(); i-- > 0;)
    if (const Vec3 step = stops[i].at - (i ? stops[i - 1].at : Vec3(Vec3::Zero())); !step.isZero(0.f))
      return step.stableNormalized();
  return Vec3::Zero();
}

// The places of a traced branch for one of so many: some that follow one another are left out, or come twice, where the step from
// what is before to what comes after is most like one that was there; rather in the middle.
std::vector<std::size_t> places_for(const Trace& of, std::size_t wanted) {
  std::vector<std::size_t> places(of.stops.size());
  std::iota(places.begin(), places.end(), 0);
  while (places.size() != wanted) {
    const std::size_t count = places.size();
    if (wanted < 3 || count < 3) {  // nothing to choose from
      const std::size_t last = places.back();
      places.resize(wanted, last);
      places.back() = last;
      break;
    }
    const bool fewer = wanted < count;
    const std::size_t skip = std::min(fewer ? count - wanted : wanted - count, count - 2);
    const auto diameter = [&](std::size_t i) { return of.stops[places[i]].diameter; };
    std::size_t best = 1;
    float least = INFINITY;
    for (std::size_t first = 1; first + skip < count; ++first) {
      // What came before the place that comes next, and what does now.
      const float was = diameter(fewer ? first + skip - 1 : first - 1),
                  is = diameter(fewer ? first - 1 : first + skip - 1);
      const float off = was + is > 0.f ? std::abs(was - is) / (was + is) : 0.f;
      const float aside = std::abs(float(2 * first + skip) / float(count) - 1.f);
      if (const float cost = off + .02f * aside; cost < least) least = cost, best = first;
    }
    const auto from = places.begin() + std::ptrdiff_t(best), to = from + std::ptrdiff_t(skip);
    if (fewer) {
      places.erase(from, to);
    } else {
      const std::vector<std::size_t> twice(from, to);
      places.insert(from, twice.begin(), twice.end());
    }
  }
  return places;
}

// Short steps change less: of so many changes that follow one another each goes where the step is about as long as its own, as long
// as no diameter leaves the range that they had. What comes after them stays.
constexpr std::size_t window = 4;
void match_lengths(std::span<float, window + 1> diameters, std::span<const float, window> own,
                   std::span<const float, window> here) {
  const auto [low, high] = std::ranges::minmax(diameters);
  if (low == high) return;
  constexpr float rounding = 1e-4f;
  std::array<float, window> changes{};
  std::array<std::size_t, window> order{}, best{};
  for (std::size_t k = 0; k < window; ++k)
    changes[k] = diameters[k + 1] - diameters[k], order[k] = best[k] = k;
  float most = -INFINITY;
  do {
    float fit = 0.f, at = diameters[0];
    bool within = true;
    for (std::size_t k = 0; k < window; ++k) {
      at += changes[order[k]];
      within &= at >= low - rounding && at <= high + rounding;
      fit += own[order[k]] * here[k];
    }
    if (within && fit > most + rounding) most = fit, best = order;
  } while (std::ranges::next_permutation(order).found);
  for (std::size_t k = 0; k + 1 < window; ++k) diameters[k + 1] = diameters[k] + changes[best[k]];
}

}  // namespace

std::vector<Calibre> calibres(const Trace& of, std::span<const float> along) {
  const std::vector<std::size_t> places = places_for(of, along.size());
  const auto size = [](std::span<const float> lengths, std::size_t i) {
    return std::log(std::max(step_to(lengths, i), 1e-3f));
  };
  std::vector<float> diameters, own, here;
  diameters.reserve(places.size()), own.reserve(places.size()), here.reserve(places.size());
  for (std::size_t n = 0; n < places.size(); ++n) {
    diameters.push_back(of.stops[places[n]].diameter);
    own.push_back(size(of.lengths, places[n]));
    here.push_back(size(along, n));
  }
  for (std::size_t n = 1; n + window <= places.size(); n += window)
    match_lengths(std::span<float, window + 1>(&diameters[n - 1], window + 1),
                  std::span<const float, window>(&own[n], window),
                  std::span<const float, window>(&here[n], window));
  std::vector<Calibre> told;
  told.reserve(diameters.size());
  for (const float diameter : diameters) told.push_back({diameter, 0.f});
  share_changes(told);
  return told;
}

void Sample::add(std::span<const double> condition_row, std::span<const double> outcome_row,
                 std::vector<Trace> branches) {
  for (const double value : condition_row) condition_values_.push_back(float(value));
  outcome_values_.insert(outcome_values_.end(), outcome_row.begin(), outcome_row.end());
  for (Trace& t : branches) {
    t.ahead = heading_at_end(Vec3::Zero(), t.stops);
    t.own_last = last_step_at_end(t.stops);
    float length = 0.f;
    Vec3 last = Vec3::Zero();
    for (const Trace::Stop& stop : t.stops)
      t.lengths.push_back(length += (stop.at - last).norm()), t.level &= std::abs(stop.at.z()) <= as_high,
          last = stop.at;
    float before = t.diameter;
    for (std::size_t i = 0; i < t.stops.size(); ++i) {
      const float step = step_to(t.lengths, i);
      if (step > 0.f) t.steepest = std::max(t.steepest, std::abs(t.stops[i].diameter - before) / step);
      before = t.stops[i].diameter;
    }
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
    Group group;
    group.key = key, group.rows = std::move(members);
    const std::size_t count = group.rows.size();
    std::vector<double> differ;  // by condition: the variance, in units of the width
    for (std::size_t c = 0; c < wide; ++c) {
      const Condition& condition = conditions[c];
      double width = condition.width, sum = 0., squares = 0.;
      if (!condition.widths.values.empty())
        width = condition.widths.lookup(double(value(group.rows[0], condition.by)));
      for (const std::uint32_t row : group.rows) {
        const double x = double(value(row, c)) / width;
        sum += x, squares += x * x;
      }
      differ.push_back(squares - sum * sum / double(count));
      if (condition.match == Match::like) group.like.push_back({c, float(width)});
      if (condition.match == Match::another) group.another.push_back({c, 1.f});
    }
    std::ranges::stable_sort(group.like, std::ranges::greater{},
                             [&](const Group::Column& c) { return differ[c.condition]; });
    for (const Group::Column& c : group.another)
      for (const std::uint32_t row : group.rows) group.forbidden.push_back(value(row, c.condition));
    for (const Group::Column& c : group.like)
      for (const std::uint32_t row : group.rows) group.columns.push_back(value(row, c.condition) / c.width);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < group.like.size(); ++k)
        group.by_row.push_back(group.columns[k * count + i]);
    groups_.push_back(std::move(group));
  }
}

void Sample::ask(std::size_t condition, std::span<const double> of_rows) {
  for (std::size_t row = 0; row < of_rows.size(); ++row)
    condition_values_[row * conditions.size() + condition] = float(of_rows[row]);
  finish();
}

std::size_t Sample::draw(std::span<const double> wanted, Random& random) const {
  thread_local std::vector<float> key, asked, chances;
  thread_local std::vector<std::uint32_t> near;
  key.clear();
  for (std::size_t c = 0; c < conditions.size(); ++c)
    if (conditions[c].match == Match::same) key.push_back(float(wanted[c]));
  const auto group = std::ranges::lower_bound(groups_, key, {}, &Group::key);
  if (group == groups_.end() || group->key != key)
    throw Error(fmt::format("sample {} has no row for {}; add one or ask for what there is", name,
                            fmt::join(key, ", ")));
  const auto chance = float(random.uniform());
  const std::size_t count = group->rows.size(), wide = group->like.size();
  if (count == 1) return group->rows[0];
  chances.assign(count, 0.f);
  const float* column = group->forbidden.data();
  for (const Group::Column& c : group->another) {
    const auto other = float(wanted[c.condition]);
    if (std::any_of(column, column + count, [&](float x) { return x != other; }))
      forbid(column, other, count, chances.data());
    column += count;
  }
  asked.clear();
  for (const Group::Column& c : group->like) {
    asked.push_back(float(wanted[c.condition]) / c.width);
    if (std::isnan(asked.back()))
      throw Error(
          fmt::format("sample {} is asked for what is no number as {}; keep its expression in its domain",
                      name, conditions[c.condition].name));
  }
  // By the first kernels most rows are out of the question.
  const std::size_t first = std::min<std::size_t>(6, wide);
  for (std::size_t k = 0; k < first; ++k)
    add_kernel(group->columns.data() + k * count, asked[k], count, chances.data());
  // Sums only fall, so the best is no less than any whole one; what is far below that has no chance, and is not summed to its end.
  const auto whole = [&](std::size_t i, float least) {
    const float* row = group->by_row.data() + i * wide;
    float sum = chances[i];
    for (std::size_t k = first; k < wide && sum > least;) {
      const std::size_t next = std::min<std::size_t>(k + 4, wide);
      for (; k < next; ++k) sum += kernel(row[k], asked[k]);
    }
    return sum;
  };
  const std::size_t lead = largest(chances.data(), count);
  float best = whole(lead, -INFINITY), total = 0.f;
  near.clear();
  find_above(chances.data(), count, best + hardly, near);
  for (const std::uint32_t i : near) best = std::max(best, chances[i] = whole(i, best + hardly));
  for (const std::uint32_t i : near)
    total += chances[i] = chances[i] > best + hardly ? std::exp(chances[i] - best) : 0.f;
  float left = chance * total;
  std::size_t last = lead;  // also where all are so far that nothing is added to what is missing
  for (const std::uint32_t i : near) {
    if (chances[i] == 0.f) continue;
    last = i;
    if ((left -= chances[i]) < 0.f) break;
  }
  return group->rows[last];
}

}  // namespace forest::lsystem
