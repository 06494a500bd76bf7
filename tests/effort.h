// SPDX-License-Identifier: Apache-2.0
// What tests may cost.
#pragma once

#include <gtest/gtest.h>

namespace forest {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace forest

/// Begins a test of something very long, the code of which other tests run through as well: under sanitizers, which take thirty
/// times as long and look for wrong memory rather than wrong numbers, it is left out.
#define LONG_TEST() \
  if (forest::sanitized) GTEST_SKIP() << "too long under sanitizers"
