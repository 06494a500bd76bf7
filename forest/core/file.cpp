// SPDX-License-Identifier: Apache-2.0
#include "forest/core/file.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <random>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "forest/core/error.h"

namespace forest {
namespace {

const char* kind_of(mode_t mode) {
  return S_ISDIR(mode) ? "a folder" : S_ISFIFO(mode) ? "a pipe" : S_ISSOCK(mode) ? "a socket" : "a device";
}

bool write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(file, bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    bytes = bytes.subspan(std::size_t(wrote));
  }
  return true;
}

/// What was written sets out for the disk now, so that fsync waits for little. It may fail: nothing depends on it.
void send(int file, std::uint64_t at, std::uint64_t count) {
  ::sync_file_range(file, off64_t(at), off64_t(count), SYNC_FILE_RANGE_WRITE);
}
constexpr std::uint64_t piece = 1 << 20;  // sent at a time

constexpr std::string_view open_files = "/proc/self/fd/";

/// A new file in a folder, without a name; -1 where that cannot be.
int open_nameless(const std::filesystem::path& folder) {
  return ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
}

/// Gives a file another name, unless that is taken. Names of open files are followed.
bool link_to(const std::filesystem::path& file, const std::filesystem::path& name) {
  return ::linkat(AT_FDCWD, file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

/// The number of an open file of this program when the path is a name of one (/dev/stdout, /dev/fd/3), or -1.
int open_file_at(const std::filesystem::path& place) {
  const std::string text = place.string();
  int number = -1;
  if (text.starts_with(open_files))
    std::from_chars(text.data() + open_files.size(), text.data() + text.size(), number);
  return number;
}

std::atomic<bool> output_taken = false;

}  // namespace

bool standard_output_taken() { return output_taken; }

unsigned permissions(unsigned wanted) {
  // It can only be asked by being set.
  static const mode_t mask = [] {
    const mode_t own = ::umask(0);
    ::umask(own);
    return own;
  }();
  return wanted & ~mask;
}

std::filesystem::path followed(const std::filesystem::path& path) {
  std::filesystem::path place = path;
  for (int links = 0; links < 40; ++links) {  // as many as the kernel follows
    std::error_code none;
    // Names of open files lead to what need have no path.
    if (open_file_at(place) >= 0 || !std::filesystem::is_symlink(place, none)) return place;
    const auto target = std::filesystem::read_symlink(place, none);
    place = target.is_absolute() ? target : place.parent_path() / target;
    if (place.parent_path() == "/dev/fd") place = "/proc/self/fd" / place.filename();
  }
  throw Error(path.string() + ": links lead in a circle; name a file");
}

MappedFile::MappedFile(const std::filesystem::path& path) {
  // A pipe would block until somebody writes into it.
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0)
    throw InputError(path, 0, std::string("cannot be opened (") + std::strerror(errno) + "); check the path");
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    throw InputError(
        path, 0, fmt::format("is {} and no file; name a file with the bytes in it", kind_of(status.st_mode)));
  }
  size_ = std::size_t(status.st_size);
  if (size_) {
    void* map = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
    if (map == MAP_FAILED) {
      ::close(file);
      throw InputError(path, 0, std::string("cannot be mapped into memory (") + std::strerror(errno) + ")");
    }
    data_ = static_cast<const std::byte*>(map);
  }
  ::close(file);
}

MappedFile::~MappedFile() {
  if (data_) ::munmap(const_cast<std::byte*>(data_), size_);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

NewFile::NewFile(const std::filesystem::path& wanted) : wanted_(wanted), place_(followed(wanted)) {
  if (wanted == "-")
    throw Error(
        "'-' is no place to write to; name /dev/stdout for standard output, or ./- for a file of that name");
  if (place_.parent_path() == "/dev/fd") place_ = "/proc/self/fd" / place_.filename();
  struct stat status {};
  const bool there = ::stat(place_.c_str(), &status) == 0;
  if (there && S_ISDIR(status.st_mode)) throw Error(wanted_.string() + ": is a folder; name a file");
  if (open_file_at(place_) == STDOUT_FILENO) output_taken = true;
  stream_ = open_file_at(place_) >= 0 || (there && !S_ISREG(status.st_mode));
  folder_ = stream_                    ? std::filesystem::temp_directory_path()
            : place_.has_parent_path() ? place_.parent_path()
                                       : std::filesystem::path(".");
  file_ = open_nameless(folder_);
  if (file_ >= 0 && ::access(own_name().c_str(), F_OK) != 0) {  // nothing it could be named by
    ::close(file_);
    file_ = -1;
  }
  if (file_ < 0) {
    std::string part = (stream_ ? folder_ / "brainforest" : place_).string() + ".XXXXXX";
    file_ = ::mkostemp(part.data(), O_CLOEXEC);
    if (file_ < 0) fail("created");
    part_ = part;
    unfinished_.emplace(part_);
  }
  ::fchmod(file_, there && !stream_ ? status.st_mode & 0777 : permissions(0666));
}

NewFile::~NewFile() {
  if (file_ >= 0) ::close(file_);
  if (!part_.empty()) ::unlink(part_.c_str());
}

/// The open file as a path, for calls that take one.
std::string NewFile::own_name() const { return fmt::format("{}{}", open_files, file_); }

void NewFile::give_name() {
  if (!part_.empty()) return;
  for (std::random_device chance;;) {
    const auto part =
        fmt::format("{}.{:06x}", (stream_ ? folder_ / "brainforest" : place_).string(), chance() & 0xffffff);
    if (link_to(own_name(), part)) {
      part_ = part;
      unfinished_.emplace(part_);
      return;
    }
    if (errno != EEXIST) fail("created");
  }
}

const std::filesystem::path& NewFile::path() {
  give_name();
  return part_;
}

void NewFile::write(std::span<const std::byte> bytes) {
  if (!write_all(file_, bytes)) fail("written");
  // Piece by piece, as they fill up.
  const auto end = std::uint64_t(std::max<off_t>(0, ::lseek(file_, 0, SEEK_CUR)));
  const std::uint64_t begin = end - std::min<std::uint64_t>(end, bytes.size()), full = end / piece * piece;
  if (!stream_ && full > begin) send(file_, begin / piece * piece, full - begin / piece * piece);
}

void NewFile::overwrite(std::uint64_t at, std::span<const std::byte> bytes) {
  const std::uint64_t begin = at, count = bytes.size();
  while (!bytes.empty()) {
    const ssize_t wrote = ::pwrite(file_, bytes.data(), bytes.size(), off_t(at));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) fail("written");
    bytes = bytes.subspan(std::size_t(wrote));
    at += std::uint64_t(wrote);
  }
  if (!stream_ && count >= piece) send(file_, begin, count);
}

void NewFile::sync() {
  if (::fsync(file_) != 0 && errno != EINVAL) fail("written");
}

void NewFile::commit() {
  if (stream_) {
    const MappedFile whole(part_.empty() ? std::filesystem::path(own_name()) : part_);
    const int open = open_file_at(place_);
    const int stream = open >= 0 ? ::fcntl(open, F_DUPFD_CLOEXEC, 0)
                                 : ::open(place_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
    if (stream < 0) fail("opened");
    const bool written = write_all(stream, whole.bytes());
    const int reason = errno;
    const bool closed = ::close(stream) == 0;
    if (!written) errno = reason;
    if (!written || !closed) fail("written");
    return;
  }
  sync();
  // Where nothing is to be replaced the file gets its name at once, else by way of a passing one.
  if (part_.empty() && link_to(own_name(), place_)) return;
  if (::rename(path().c_str(), place_.c_str()) != 0) fail("renamed");
  part_.clear(), unfinished_.reset();
}

bool NewFile::commit_new() {
  sync();
  if (link_to(part_.empty() ? own_name() : part_.string(), place_)) return true;
  const bool no_links = errno == EPERM || errno == EOPNOTSUPP || errno == ENOSYS;  // in this file system
  if (no_links && ::renameat2(AT_FDCWD, path().c_str(), AT_FDCWD, place_.c_str(), RENAME_NOREPLACE) == 0) {
    part_.clear(), unfinished_.reset();
    return true;
  }
  if (errno != EEXIST) fail("renamed");
  return false;
}

void NewFile::fail(const char* what) const {
  throw Error(fmt::format("{}: cannot be {} ({}); check that the folder exists and the disk has room",
                          wanted_.string(), what, std::strerror(errno)));
}

ScratchFile::ScratchFile(const NewFile& of) : of_(of), file_(open_nameless(of.folder_)) {
  if (file_ >= 0) return;
  std::string part = (of_.folder_ / "brainforest.XXXXXX").string();
  file_ = ::mkostemp(part.data(), O_CLOEXEC);
  if (file_ < 0) of_.fail("created");
  ::unlink(part.c_str());
}

ScratchFile::~ScratchFile() {
  forget();
  if (file_ >= 0) ::close(file_);
}

void ScratchFile::write(std::span<const std::byte> bytes) {
  if (!write_all(file_, bytes)) of_.fail("written");
}

std::span<const std::byte> ScratchFile::take(std::uint64_t at, std::size_t count) {
  forget();
  if (!count) return {};
  void* const begin = ::mmap(nullptr, count, PROT_READ, MAP_SHARED | MAP_POPULATE, file_, off_t(at));
  if (begin == MAP_FAILED) of_.fail("written");
  at_ = at;
  return mapped_ = {static_cast<const std::byte*>(begin), count};
}

void ScratchFile::forget() {
  if (mapped_.empty()) return;
  ::munmap(const_cast<std::byte*>(mapped_.data()), mapped_.size());
  // What is written next finds these pages of memory, and they need not go to the disk. It may fail: nothing depends on it.
  ::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(at_), off_t(mapped_.size()));
  mapped_ = {};
}

PartFile::PartFile(const std::filesystem::path& wanted) : place_(followed(wanted)), part_(place_) {
  part_ += ".part";
  for (;;) {
    file_ = ::open(part_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
    struct stat ours {
    }, there{};
    if (file_ < 0 || ::fstat(file_, &ours) != 0) fail("created");
    if (!S_ISREG(ours.st_mode))
      throw Error(fmt::format("{}: is {} and no file; remove it or choose another place", part_.string(),
                              kind_of(ours.st_mode)));
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw Error(
          fmt::format("{}: is being written by another program; wait until it has ended", part_.string()));
    size_ = std::uint64_t(ours.st_size);
    // Who held it may have given it its name in the meantime.
    if (::stat(part_.c_str(), &there) == 0 && there.st_ino == ours.st_ino && there.st_dev == ours.st_dev)
      return;
    ::close(file_);
  }
}

PartFile::~PartFile() {
  if (file_ >= 0) ::close(file_);
}

void PartFile::cut(std::uint64_t size) {
  if (size < size_ && ::ftruncate(file_, off_t(size)) != 0) fail("cut");
  size_ = std::min(size, size_);
}

void PartFile::write(std::span<const std::byte> bytes) {
  if (::lseek(file_, off_t(size_), SEEK_SET) < 0 || !write_all(file_, bytes)) fail("written");
  const std::uint64_t begin = size_ / piece * piece, full = (size_ + bytes.size()) / piece * piece;
  if (full > begin) send(file_, begin, full - begin);
  size_ += bytes.size();
}

void PartFile::commit() {
  if (::fsync(file_) != 0 && errno != EINVAL) fail("written");
  if (::rename(part_.c_str(), place_.c_str()) != 0) fail("renamed");
}

void PartFile::discard() { ::unlink(part_.c_str()); }

void PartFile::fail(const char* what) const {
  throw Error(
      fmt::format("{}: cannot be {} ({}); check that the folder exists and the disk has room, then start "
                  "again: it goes on where it stopped",
                  part_.string(), what, std::strerror(errno)));
}

void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  NewFile file(path);
  file.write(bytes);
  file.commit();
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  write_file(path, std::as_bytes(std::span(text)));
}

}  // namespace forest
