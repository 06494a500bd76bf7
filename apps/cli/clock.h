// SPDX-License-Identifier: Apache-2.0
// How long something took, for what tells it to a person.
#pragma once

#include <chrono>

namespace forest::cli {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

inline double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace forest::cli
