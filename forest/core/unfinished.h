// SPDX-License-Identifier: Apache-2.0
// What an interrupted program would leave half-written.
#pragma once

#include <filesystem>

namespace forest {

/// A file or folder that goes away, with all that it holds, when the program is interrupted while this lives (SIGINT, SIGTERM or
/// SIGHUP, where nobody else has taken or ignored them); then the program ends as it would have. On SIGKILL nothing can be done.
class Unfinished {
 public:
  explicit Unfinished(std::filesystem::path path);
  ~Unfinished();
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

 private:
  std::filesystem::path path_;
};

}  // namespace forest
