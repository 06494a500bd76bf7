// SPDX-License-Identifier: Apache-2.0
// What is measured, for people and for machines.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace forest::cli {

class Console;

struct Figure {
  const char* key;  // in JSON; null where one before it says it, too
  nlohmann::ordered_json value;
  const char* label = nullptr;  // in the table; null: not there
  std::string shown = {}, what = {};
};

/// One object, or a table.
void print(std::vector<Figure> figures, Console& console);

}  // namespace forest::cli
