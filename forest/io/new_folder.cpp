// SPDX-License-Identifier: Apache-2.0
#include "forest/io/new_folder.h"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <stdlib.h>
#include <string>
#include <unistd.h>

#include <sys/file.h>
#include <sys/stat.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest::io {

namespace fs = std::filesystem;

namespace {

// Removes what programs that were killed left behind: of that name, with nobody who holds it, and not made just now, when its
// maker might be about to.
void sweep(const fs::path& above, const std::string& prefix) {
  std::error_code ignored;
  for (const fs::directory_entry& e : fs::directory_iterator(above.empty() ? "." : above, ignored)) {
    const std::string name = e.path().filename().string();
    if (!name.starts_with(prefix) || name.size() != prefix.size() + 6 || e.is_symlink(ignored)) continue;
    const auto age = fs::file_time_type::clock::now() - e.last_write_time(ignored);
    const int folder = ::open(e.path().c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0) continue;
    if (age > std::chrono::minutes(1) && ::flock(folder, LOCK_EX | LOCK_NB) == 0)
      fs::remove_all(e.path(), ignored);
    ::close(folder);
  }
}

}  // namespace

NewFolder::NewFolder(const fs::path& wanted) : wanted_(wanted) {
  if (!wanted_.has_filename()) wanted_ = wanted_.parent_path();  // "circuit/"
  wanted_ = followed(wanted_);
  if (std::error_code none; fs::exists(wanted_, none) && !fs::is_directory(wanted_, none))
    throw Error(wanted_.string() + ": is there and no folder; name another");
  const std::string prefix = "." + wanted_.filename().string() + ".unfinished-";
  sweep(wanted_.parent_path(), prefix);
  std::string name = (wanted_.parent_path() / (prefix + "XXXXXX")).string();
  if (!::mkdtemp(name.data())) fail("created");
  part_ = name;
  lock_ = ::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ >= 0) ::flock(lock_, LOCK_EX | LOCK_NB);
  unfinished_.emplace(part_);
  ::chmod(name.c_str(), permissions(0777));
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!part_.empty()) fs::remove_all(part_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

void NewFolder::write(const fs::path& name, std::string_view bytes) const {
  std::ofstream file(part_ / name, std::ios::binary);
  file.write(bytes.data(), std::streamsize(bytes.size()));
  file.close();
  if (!file) throw Error((wanted_ / name).string() + ": cannot be written; check that the disk has room");
}

void NewFolder::commit() {
  if (::rename(part_.c_str(), wanted_.c_str()) == 0) {  // there was none, or an empty one
    part_.clear(), unfinished_.reset();
    return;
  }
  // Swapped in one step, so that a whole folder is there at every moment; the destructor removes the old one.
  if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, wanted_.c_str(), RENAME_EXCHANGE) != 0) fail("replaced");
}

void NewFolder::fail(const char* what) const {
  const int reason = errno;
  throw Error(wanted_.string() + ": cannot be " + what + " (" + std::strerror(reason) +
              "); check that the folder above it exists and can be written");
}

}  // namespace forest::io
