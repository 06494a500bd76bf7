// SPDX-License-Identifier: Apache-2.0
// A folder that is written whole or not at all, as core/file.h does for a single file.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "forest/core/unfinished.h"

namespace forest::io {

/// Collects files in a hidden folder beside the one that is wanted. commit() puts it in its place at once; without it
/// (an exception, an interruption) the hidden folder goes away and what was there before stays. A program that is killed
/// (SIGKILL) leaves it behind, `.NAME.unfinished-` and six letters, until the next one writes to the same place.
class NewFolder {
 public:
  /// Throws Error when the folder above is missing or cannot be written.
  explicit NewFolder(const std::filesystem::path& wanted);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  const std::filesystem::path& path() const { return part_; }  // where to write until then

  /// Writes one file. Throws Error when the disk is full.
  void write(const std::filesystem::path& name, std::string_view bytes) const;

  /// Takes the place of the wanted folder; one that was there is removed with all it holds, so look at it before.
  void commit();

 private:
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path wanted_, part_;
  int lock_ = -1;  // held as long as this lives: nobody takes it for one that was left behind
  std::optional<Unfinished> unfinished_;
};

}  // namespace forest::io
