// SPDX-License-Identifier: Apache-2.0
#include "forest/core/unfinished.h"

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace forest {
namespace {

namespace fs = std::filesystem;

class UnfinishedWork : public testing::Test {
 protected:
  UnfinishedWork() {
    std::string name = (fs::temp_directory_path() / "forest-unfinished.XXXXXX").string();
    root_ = ::mkdtemp(name.data());
    part_ = root_ / "part";
  }
  ~UnfinishedWork() override { fs::remove_all(root_); }

  // How a program ends that begins a folder, perhaps is through with it, and gets a signal.
  int ended(int signal, bool through, bool ignored = false) const {
    const pid_t child = ::fork();
    if (child == 0) {
      if (ignored) std::signal(signal, SIG_IGN);
      fs::create_directories(part_ / "deep");
      std::ofstream(part_ / "deep" / "file") << "half";
      std::optional<Unfinished> unfinished(std::in_place, part_);
      if (through) unfinished.reset();
      ::kill(::getpid(), signal);
      if (!ignored && !through) ::sleep(20);
      std::_Exit(7);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  fs::path root_, part_;
};

TEST_F(UnfinishedWork, GoesAwayWhenTheProgramIsInterrupted) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const int status = ended(signal, false);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal);
    EXPECT_TRUE(fs::is_empty(root_));
  }
}

TEST_F(UnfinishedWork, StaysOnceItIsFinished) {
  const int status = ended(SIGTERM, true);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
  EXPECT_TRUE(fs::exists(part_ / "deep" / "file"));
}

TEST_F(UnfinishedWork, StaysWhereTheSignalIsIgnored) {
  const int status = ended(SIGHUP, false, true);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 7);
  EXPECT_TRUE(fs::exists(part_));
}

}  // namespace
}  // namespace forest
