// SPDX-License-Identifier: Apache-2.0
// A row of a table by its name.
#pragma once

#include <string>
#include <string_view>

#include "forest/core/error.h"

namespace forest::cortex {

/// Throws Error "there is no <what> "name"; there are …" with the names of all rows.
template <class Rows>
const auto& named_row(const Rows& rows, std::string_view name, std::string_view what) {
  std::string names;
  for (const auto& row : rows) {
    if (row.name == name) return row;
    names += (names.empty() ? "" : ", ") + std::string(row.name);
  }
  throw Error("there is no " + std::string(what) + " \"" + std::string(name) + "\"; there are " + names);
}

}  // namespace forest::cortex
