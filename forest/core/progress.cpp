// SPDX-License-Identifier: Apache-2.0
#include "forest/core/progress.h"

namespace forest {

Progress& Progress::none() {
  struct None final : Progress {
    void begin(std::string_view, std::size_t) override {}
    void advance(std::size_t) override {}
    void end() override {}
  };
  static None none;
  return none;
}

}  // namespace forest
