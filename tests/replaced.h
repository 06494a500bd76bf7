// SPDX-License-Identifier: Apache-2.0
// A good text with one thing changed, to see what is said of it.
#pragma once

#include <string>

#include <gtest/gtest.h>

namespace forest {

/// `text` with the first `from` as `to`; the test fails where there is none.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace forest
