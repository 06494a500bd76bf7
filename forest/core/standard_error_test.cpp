// SPDX-License-Identifier: Apache-2.0
#include "forest/core/standard_error.h"

#include <cerrno>
#include <fcntl.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace forest {
namespace {

// In a program of its own, for the streams are the program's.
#define EXPECT_THAT_ENDS(...) EXPECT_EXIT(__VA_ARGS__, testing::ExitedWithCode(0), "")

TEST(StandardError, MayBeFull) {
  EXPECT_THAT_ENDS({
    ::dup2(::open("/dev/full", O_WRONLY), STDERR_FILENO);
    tell("nobody hears this\n");
    std::_Exit(0);
  });
}

TEST(StandardError, IsNoOtherFileWhereItWasClosed) {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    EXPECT_THAT_ENDS({
      ::close(stream);
      keep_standard_streams();
      char byte = 'a';
      const bool fails = (stream == STDIN_FILENO ? ::read(stream, &byte, 1) : ::write(stream, &byte, 1)) < 0;
      std::_Exit(fails && ::open("/dev/null", O_RDONLY) > STDERR_FILENO ? 0 : 1);
    });
}

}  // namespace
}  // namespace forest
