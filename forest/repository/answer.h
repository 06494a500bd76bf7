// SPDX-License-Identifier: Apache-2.0
// What a database answers to a question in SQL.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace forest::repository {

struct Answer {
  using Value = std::variant<std::monostate, std::int64_t, double, std::string>;  // null; bytes as \xHH…
  std::vector<std::string> columns;
  std::vector<std::vector<Value>> rows;  // each as long as columns
};

}  // namespace forest::repository
