// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/console.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "forest/core/file.h"
#include "forest/core/standard_error.h"

namespace forest::cli {

using namespace std::chrono_literals;

void ProgressBar::begin(std::string_view stage, std::size_t total) {
  end();
  const std::lock_guard lock(mutex_);
  stage_ = stage, total_ = total, done_ = 0;
  begin_ = drawn_ = Clock::now();
}

void ProgressBar::advance(std::size_t steps) {
  const std::lock_guard lock(mutex_);
  done_ += steps;
  const auto now = Clock::now();
  if (now - begin_ > 300ms && now - drawn_ > 100ms) draw(now);
}

void ProgressBar::end() {
  const std::lock_guard lock(mutex_);
  if (shown_) tell("\r\033[K");
  shown_ = false;
}

void ProgressBar::draw(Clock::time_point now) {
  static const bool terminal = ::isatty(2) != 0;
  drawn_ = now;
  if (!terminal) {  // a line a minute, for who reads the log of a long run
    if (now - told_ < 60s) return;
    told_ = now;
    tell(fmt::format("{}: {}{}\n", stage_, done_, total_ ? fmt::format(" of {}", total_) : ""));
    return;
  }
  constexpr std::size_t width = 30;
  if (total_) {
    const std::size_t filled = std::min(width, width * done_ / total_);
    tell(fmt::format("\r\033[K{:<12} {}{} {}/{}", stage_, std::string(filled, '#'),
                     std::string(width - filled, '.'), done_, total_));
  } else {
    tell(fmt::format("\r\033[K{:<12} {}", stage_, done_));
  }
  shown_ = true;
}

// A file that was sent to standard output has it for itself.
static void put(std::string_view text) {
  if (standard_output_taken())
    tell(text);
  else
    fmt::print("{}", text);
}

void Console::say(std::string_view line) {
  bar_.end();
  if (!json) put(fmt::format("{}\n", line));
}

void Console::warn(std::string_view sentence) {
  bar_.end();
  std::fflush(stdout);  // in one file or pipe with what was said before
  tell(fmt::format("{}\n", sentence));
  warnings_.emplace_back(sentence);
}

void Console::fail(std::string_view sentence) {
  if (!printed_) print({{"error", sentence}});
  warn(fmt::format("brainforest: {}", sentence));
}

void Console::print(nlohmann::ordered_json value) {
  bar_.end();
  if (!json) return;
  printed_ = true;
  if (value.is_object() && !warnings_.empty() && !value.contains("warnings")) value["warnings"] = warnings_;
  put(value.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

void Console::table(const std::vector<std::string>& header,
                    const std::vector<std::vector<std::string>>& rows) {
  if (json) return;
  bar_.end();
  const auto number = [](const std::string& cell) {
    return !cell.empty() && cell.find_first_not_of("0123456789.,+-e% ") == std::string::npos;
  };
  std::vector<std::size_t> widths(header.size());
  std::vector<bool> right(header.size(), !rows.empty());
  const auto measure = [&](const std::vector<std::string>& row, bool head) {
    for (std::size_t i = 0; i < header.size() && i < row.size(); ++i) {
      std::size_t glyphs = 0;
      for (const char c : row[i]) glyphs += (c & 0xc0) != 0x80;
      widths[i] = std::max(widths[i], glyphs);
      if (!head && !number(row[i])) right[i] = false;
    }
  };
  measure(header, true);
  for (const auto& row : rows) measure(row, false);
  const auto print = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t i = 0; i < header.size() && i < row.size(); ++i) {
      std::size_t glyphs = 0;
      for (const char c : row[i]) glyphs += (c & 0xc0) != 0x80;
      const std::string pad(widths[i] - glyphs, ' ');
      line += right[i] ? pad + row[i] : row[i] + pad;
      line += "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    put(line + "\n");
  };
  print(header);
  for (const auto& row : rows) print(row);
}

std::string counted(std::size_t count, std::string_view noun, std::string_view plural) {
  if (count != 1 && !plural.empty()) return fmt::format("{} {}", count, plural);
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::uint64_t peak_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * 1024;
}

std::filesystem::path data_folder() {
  if (const char* chosen = std::getenv("BRAINFOREST_SHARE")) return chosen;
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const auto installed = program.parent_path().parent_path() / "share" / "brainforest";
  return std::filesystem::exists(installed, ignored) ? installed
                                                     : std::filesystem::path(FOREST_SOURCE_DIR) / "data";
}

}  // namespace forest::cli
