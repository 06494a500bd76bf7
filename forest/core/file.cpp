// SPDX-License-Identifier: Apache-2.0
#include "forest/core/file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include <sys/mman.h>
#include <sys/stat.h>

#include "forest/core/error.h"

namespace forest {

MappedFile::MappedFile(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    throw InputError(path, 0, std::string("cannot be opened (") + std::strerror(errno) + "); check the path");
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    throw InputError(path, 0, "is not a regular file; name a file, not a folder or device");
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

void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::string part = path.string() + ".XXXXXX";
  const int file = ::mkstemp(part.data());
  const auto fail = [&](const char* what) {
    const int reason = errno;
    if (file >= 0) ::close(file), ::unlink(part.c_str());
    throw Error(path.string() + ": cannot be " + what + " (" + std::strerror(reason) +
                "); check that the folder exists and the disk has room");
  };
  if (file < 0) fail("created");
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote = ::write(file, bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) fail("written");
    done += std::size_t(wrote);
  }
  ::fchmod(file, 0644);
  if (::fsync(file) != 0 && errno != EINVAL) fail("written");
  if (::rename(part.c_str(), path.c_str()) != 0) fail("renamed");
  ::close(file);
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  write_file(path, std::as_bytes(std::span(text)));
}

}  // namespace forest
