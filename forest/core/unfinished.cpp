// SPDX-License-Identifier: Apache-2.0
#include "forest/core/unfinished.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <fcntl.h>
#include <mutex>
#include <set>
#include <thread>
#include <unistd.h>
#include <utility>

namespace forest {
namespace {

namespace fs = std::filesystem;

constexpr std::array interruptions{SIGINT, SIGTERM, SIGHUP};

// Files cannot be removed within a signal, so that a thread waits for it. It begins with the first of them, and is never destroyed.
struct Watch {
  std::mutex mutex;
  std::multiset<fs::path> paths;
  int pipe[2] = {-1, -1};
  pid_t waits = 0;  // the program whose thread waits: what is forked off has none, and other paths
  std::array<bool, interruptions.size()> ours{};
};
Watch& watch() {
  static auto* one = new Watch;
  return *one;
}

void on_interruption(int signal) {
  const int before = errno;
  const char byte = char(signal);
  [[maybe_unused]] const ssize_t told = ::write(watch().pipe[1], &byte, 1);
  errno = before;
}

void wait_for_interruption() {
  Watch& w = watch();
  char signal = 0;
  while (::read(w.pipe[0], &signal, 1) < 0 && errno == EINTR) {
  }
  const std::lock_guard lock(w.mutex);
  for (const fs::path& path : w.paths) {
    std::error_code none;
    fs::path gone = path;
    gone += "~";
    fs::rename(path, gone, none);  // nobody writes there any more
    fs::remove_all(none ? path : gone, none);
  }
  std::signal(signal, SIG_DFL);
  ::kill(::getpid(), signal);
  for (;;) ::pause();  // whoever waits for the lock waits for the end
}

}  // namespace

Unfinished::Unfinished(fs::path path) : path_(std::move(path)) {
  Watch& w = watch();
  const std::lock_guard lock(w.mutex);
  if (w.waits != ::getpid()) {
    if (::pipe2(w.pipe, O_CLOEXEC) != 0) return;
    w.waits = ::getpid();
    w.paths.clear();
    std::thread(wait_for_interruption).detach();
  }
  if (w.paths.empty())
    for (std::size_t k = 0; k < interruptions.size(); ++k) {
      struct sigaction now {};
      w.ours[k] = ::sigaction(interruptions[k], nullptr, &now) == 0 && now.sa_handler == SIG_DFL;
      if (w.ours[k]) std::signal(interruptions[k], on_interruption);
    }
  w.paths.insert(path_);
}

Unfinished::~Unfinished() {
  Watch& w = watch();
  const std::lock_guard lock(w.mutex);
  if (const auto found = w.paths.find(path_); found != w.paths.end()) w.paths.erase(found);
  if (w.paths.empty())
    for (std::size_t k = 0; k < interruptions.size(); ++k)
      if (std::exchange(w.ours[k], false)) std::signal(interruptions[k], SIG_DFL);
}

}  // namespace forest
