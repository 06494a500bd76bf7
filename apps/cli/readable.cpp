// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/readable.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace forest::cli {
namespace {

constexpr double many = 1e9, few = 1e-4;  // where powers of ten begin, as those of %g do below

/// "10170.5" as "10,170.5".
std::string in_thousands(std::string number) {
  const std::size_t first = number.starts_with('-');
  for (std::size_t at = std::min(number.find('.'), number.size()); at > first + 3;)
    number.insert(at -= 3, ",");
  return number;
}

}  // namespace

std::string readable(double value) {
  if (std::isnan(value)) return "-";
  const double size = std::abs(value);
  if (!(size >= 999.95 && size < many)) return fmt::format("{:.4g}", value);
  // Four digits, and noughts; a count is told to the last one.
  const double unit = value == std::round(value) ? 1. : std::pow(10., std::floor(std::log10(size)) - 3.);
  return in_thousands(fmt::format("{:.0f}", unit * std::round(value / unit)));
}

std::string readable_range(double low, double high) {
  return readable(low) + (low < 0. || high < 0. ? " to " : "–") + readable(high);
}

std::string readable_mark(double value, double step) {
  if (std::abs(value) < 1e-6 * step) return "0";
  if (std::abs(value) >= many || step < few) return fmt::format("{:.3g}", value);
  const int digits = std::max(0, int(std::ceil(-std::log10(step) - 1e-9)));
  return in_thousands(fmt::format("{:.{}f}", value, digits));
}

}  // namespace forest::cli
