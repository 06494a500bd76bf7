// SPDX-License-Identifier: Apache-2.0
// How long work tells the person who waits. A parameter, never a global; the library itself prints nothing.
#pragma once

#include <cstddef>
#include <string_view>

namespace forest {

/// Receives progress. `advance` may be called from any thread.
class Progress {
 public:
  virtual ~Progress() = default;
  /// A new stage of `total` steps begins ("planting", 10000); total 0 means unknown.
  virtual void begin(std::string_view stage, std::size_t total) = 0;
  virtual void advance(std::size_t steps = 1) = 0;
  virtual void end() = 0;

  static Progress& none();  // hears and says nothing
};

}  // namespace forest
