// SPDX-License-Identifier: Apache-2.0
// What the command line says to a person (progress, tables, warnings) or, with --json, to a machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forest/core/progress.h"

namespace forest::cli {

/// A progress bar on standard error, for stages of a third of a second and more; where that is no terminal, a line a minute.
class ProgressBar final : public Progress {
 public:
  void begin(std::string_view stage, std::size_t total) override;
  void advance(std::size_t steps = 1) override;
  void end() override;

 private:
  using Clock = std::chrono::steady_clock;
  void draw(Clock::time_point now);

  std::mutex mutex_;
  std::string stage_;
  std::size_t total_ = 0, done_ = 0;
  Clock::time_point begin_, drawn_, told_ = Clock::now();
  bool shown_ = false;
};

class Console {
 public:
  bool json = false;     // --json: machine-readable results on standard output
  unsigned threads = 0;  // --threads: 0 for all cores

  Progress& progress() { return bar_; }
  void say(std::string_view line);       // to standard output, unless --json
  void warn(std::string_view sentence);  // to standard error
  /// Why the command ends with status 1; with --json also as `error` of an object, where nothing was printed.
  void fail(std::string_view sentence);
  /// To standard output, when --json; an object has, as `warnings`, what was warned of before.
  void print(nlohmann::ordered_json value);
  /// Columns aligned, numbers right; to standard output, unless --json.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

 private:
  ProgressBar bar_;
  std::vector<std::string> warnings_;
  bool printed_ = false;
};

/// "1 finding", "2 findings", "2 losses": an s where no plural is given.
std::string counted(std::size_t count, std::string_view noun, std::string_view plural = {});

/// The most memory that this program has had so far.
std::uint64_t peak_bytes();

/// Where the project's own grammars and recipes are: the folder `data` of the source tree or of the
/// installation, or what BRAINFOREST_SHARE names.
std::filesystem::path data_folder();

}  // namespace forest::cli
