// SPDX-License-Identifier: Apache-2.0
// Files as bytes: read by mapping, written whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include "forest/core/unfinished.h"

namespace forest {

/// A file mapped read-only into memory. Throws InputError when it cannot be opened.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;

  std::span<const std::byte> bytes() const { return {data_, size_}; }
  std::string_view text() const { return {reinterpret_cast<const char*>(data_), size_}; }

 private:
  const std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Whether some NewFile was for standard output (/dev/stdout): what a person reads belongs elsewhere then.
bool standard_output_taken();

/// A file on its way: written without a name on the disk of its place, put there by commit() once the disk has it, so that
/// a killed program, or a computer without power, leaves the old file or the new one, and nothing else. (Where the file system
/// knows no files without names, and after path(), it has a passing name beside its place until then, which an interruption
/// takes away and SIGKILL leaves behind.) Links are followed: what they point to is replaced, they stay. Where no file can lie
/// (a pipe, a terminal, /dev/null, /dev/stdout) commit() sends the bytes into what is there.
///
/// This is the one way to a whole file. What is made over hours goes on in a PartFile; a folder is an io::NewFolder.
class NewFile {
 public:
  /// Throws Error when the folder is missing or cannot be written.
  explicit NewFile(const std::filesystem::path& wanted);
  ~NewFile();  // without commit() nothing is left behind
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  const std::filesystem::path& path();  // where to write until then, for libraries that ask for a name
  /// Appends. Throws Error when the disk is full.
  void write(std::span<const std::byte> bytes);
  /// Writes over what is there, or beyond, by any thread; the next write() still goes behind the last.
  void overwrite(std::uint64_t at, std::span<const std::byte> bytes);
  void commit();
  /// Only where there is none: of several programs the first wins. Returns whether it did.
  bool commit_new();

 private:
  friend class ScratchFile;
  [[noreturn]] void fail(const char* what) const;
  std::string own_name() const;
  void give_name();
  void sync();

  std::filesystem::path wanted_, place_, folder_, part_;
  std::optional<Unfinished> unfinished_;  // as long as it has a passing name, part_
  bool stream_ = false;                   // the place takes bytes, not a file
  int file_ = -1;
};

/// What does not fit into memory while a new file is made: a file without a name on the same disk, gone with the object and
/// with the program, however that ends. Errors are those of the new file.
class ScratchFile {
 public:
  explicit ScratchFile(const NewFile& of);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  void write(std::span<const std::byte> bytes);  // appends
  /// Some of what was written, where it lies; until the next call, which gives its room back to the disk and to the memory.
  /// @param at  a multiple of 1 MiB
  std::span<const std::byte> take(std::uint64_t at, std::size_t count);

 private:
  void forget();
  const NewFile& of_;
  int file_ = -1;
  std::uint64_t at_ = 0;  // of what is mapped
  std::span<const std::byte> mapped_;
};

/// A file that is made over hours. Until commit() it lies beside its place, with .part behind its name; a program that was
/// killed leaves it there, and the next one goes on with it. One program at a time.
class PartFile {
 public:
  /// Opens what lies there or makes it. Throws Error when that cannot be, or another program writes it.
  explicit PartFile(const std::filesystem::path& wanted);
  ~PartFile();  // leaves it there
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  const std::filesystem::path& path() const { return part_; }
  std::uint64_t size() const { return size_; }
  void cut(std::uint64_t size);  // what lies behind is gone
  /// Appends. Throws Error when the disk is full; whatever was written of these bytes is there.
  void write(std::span<const std::byte> bytes);
  void commit();   // it gets its name
  void discard();  // it is gone

 private:
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path place_, part_;
  std::uint64_t size_ = 0;
  int file_ = -1;
};

/// What the user's mask (umask) leaves of the permissions of something new.
unsigned permissions(unsigned wanted);

/// Where a path leads: symbolic links are followed, also one to a file that is not there yet. Throws Error for a circle.
std::filesystem::path followed(const std::filesystem::path& path);

/// Writes a file whole or not at all, as NewFile does.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& path, std::string_view text);

}  // namespace forest
