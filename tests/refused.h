// SPDX-License-Identifier: Apache-2.0
// What is said of input that is wrong.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "forest/core/error.h"

namespace forest {

/// The sentence with which something is refused, which must be one line; empty where it is not refused. Whatever else it
/// throws fails the test.
template <class Refusal = Error>
std::string refused(auto&& act) {
  try {
    act();
  } catch (const Refusal& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  return "";
}

}  // namespace forest
