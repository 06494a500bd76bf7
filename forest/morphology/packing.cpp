// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/packing.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>

#include "forest/core/error.h"

namespace forest {
namespace {

constexpr std::array<double, 6> scales{1., 10., 100., 1e3, 1e4, 1e5};  // steps a micrometre
constexpr std::size_t in_floats = scales.size();                       // instead of a number of decimals
constexpr std::uint64_t minus_zero = 1ull << 63;                       // no difference is so large
constexpr double most_steps = 1e15;  // whole numbers a double holds, and some room

std::array<float, 4> numbers(const Point& p) { return {p.x, p.y, p.z, p.radius}; }

float number_of(std::int64_t steps, double scale) { return float(double(steps) / scale); }

// Floats counted in their order: the next larger one is the next number, 0 is 0 and -0 is -1.
std::int64_t order_of(float value) {
  const auto bits = std::bit_cast<std::int32_t>(value);
  return bits < 0 ? bits ^ 0x7fffffff : bits;
}

float at_order(std::int64_t order) {
  const auto bits = std::int32_t(order);
  return std::bit_cast<float>(bits < 0 ? bits ^ 0x7fffffff : bits);
}

bool is_minus_zero(float value) { return std::bit_cast<std::uint32_t>(value) == 0x80000000u; }

bool is_decimal(float value, double scale) {
  if (is_minus_zero(value)) return true;
  const double steps = std::round(double(value) * scale);
  return std::abs(steps) < most_steps &&
         std::bit_cast<std::uint32_t>(number_of(std::int64_t(steps), scale)) ==
             std::bit_cast<std::uint32_t>(value);
}

// The decimals that all numbers need; in_floats when some needs more.
std::size_t decimals(std::span<const Point> points) {
  std::size_t places = 0;
  for (const Point& p : points)
    for (const float value : numbers(p))
      while (places < scales.size() && !is_decimal(value, scales[places])) ++places;
  if (places == in_floats) return places;
  // More places may not hold what fewer do: large numbers have no room for them.
  for (const Point& p : points)
    for (const float value : numbers(p))
      if (!is_decimal(value, scales[places])) return in_floats;
  return places;
}

using Steps = std::array<std::int64_t, 4>;

Steps steps_of(const Point& p, bool decimal, double scale) {
  Steps steps;
  const std::array<float, 4> values = numbers(p);
  for (std::size_t k = 0; k < 4; ++k)
    steps[k] = decimal ? std::int64_t(std::round(double(values[k]) * scale)) : order_of(values[k]);
  return steps;
}

/// Walks over the runs as their points come.
class Walk {
 public:
  explicit Walk(const PointRuns& runs) : runs_(runs), ends_(runs.counts.size()) {}

  /// Of the next point, which is number `at`: from which point it is the difference, or none: from the one before.
  std::optional<std::size_t> from(std::size_t at) {
    std::optional<std::size_t> from;
    for (; run_ < ends_.size() && at == end_; ++run_) {  // some may have no point
      const std::int32_t parent = runs_.parents[run_], count = runs_.counts[run_];
      if (count < 0 || parent >= std::int32_t(run_)) throw Error("its sections are damaged");
      from = parent >= 0 && ends_[std::size_t(parent)] ? std::optional(ends_[std::size_t(parent)] - 1)
                                                       : std::nullopt;
      ends_[run_] = end_ += std::size_t(count);
    }
    return from;
  }

 private:
  PointRuns runs_;
  std::vector<std::size_t> ends_;  // one after the last point of each run
  std::size_t run_ = 0, end_ = 0;
};

}  // namespace

std::string pack_points(std::span<const Point> points, const PointRuns& runs) {
  if (points.empty()) return {};
  const std::size_t places = decimals(points);
  const bool decimal = places != in_floats;
  const double scale = decimal ? scales[places] : 0.;
  std::string bytes(1, char(places));
  bytes.reserve((decimal ? 8 : 14) * points.size());
  Steps before{};
  Walk walk(runs);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::array<float, 4> values = numbers(points[i]);
    if (const auto from = walk.from(i)) before = steps_of(points[*from], decimal, scale);
    const Steps steps = steps_of(points[i], decimal, scale);
    std::array<char, 40> written;  // ten bytes a number at most
    std::size_t count = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::int64_t difference = steps[k] - before[k];
      std::uint64_t zigzag = (std::uint64_t(difference) << 1) ^ std::uint64_t(difference >> 63);
      if (decimal && is_minus_zero(values[k])) zigzag = minus_zero;
      for (; zigzag > 127; zigzag >>= 7) written[count++] = char(zigzag | 128);
      written[count++] = char(zigzag);
    }
    before = steps;
    bytes.append(written.data(), count);
  }
  return bytes.size() < points.size() * sizeof(Point) ? bytes : std::string();
}

std::vector<Point> unpack_points(std::string_view bytes, const PointRuns& runs) {
  const auto damaged = [] { return Error("its packed points are damaged"); };
  const std::size_t places = bytes.empty() ? in_floats + 1 : static_cast<unsigned char>(bytes[0]);
  if (places > in_floats) throw damaged();
  const bool decimal = places != in_floats;
  const double scale = decimal ? scales[places] : 0.;
  std::vector<Point> points;
  points.reserve(bytes.size() / 6);
  Steps before{};
  Walk walk(runs);
  for (std::size_t at = 1; at < bytes.size();) {
    if (const auto from = walk.from(points.size())) before = steps_of(points[*from], decimal, scale);
    std::array<float, 4> values{};
    for (std::size_t k = 0; k < 4; ++k) {
      std::uint64_t zigzag = 0;
      for (int shift = 0;; shift += 7) {
        if (at == bytes.size() || shift > 63) throw damaged();
        const auto byte = static_cast<unsigned char>(bytes[at++]);
        zigzag |= std::uint64_t(byte & 127) << shift;
        if (byte < 128) break;
      }
      if (decimal && zigzag == minus_zero) {
        before[k] = 0, values[k] = -0.f;
        continue;
      }
      const std::int64_t difference = std::int64_t(zigzag >> 1) ^ -std::int64_t(zigzag & 1);
      before[k] = std::int64_t(std::uint64_t(before[k]) + std::uint64_t(difference));
      if (!decimal && before[k] != std::int32_t(before[k])) throw damaged();
      values[k] = decimal ? number_of(before[k], scale) : at_order(before[k]);
    }
    points.push_back({values[0], values[1], values[2], values[3]});
  }
  return points;
}

}  // namespace forest
