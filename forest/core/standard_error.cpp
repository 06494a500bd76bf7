// SPDX-License-Identifier: Apache-2.0
#include "forest/core/standard_error.h"

#include <cstdio>
#include <fcntl.h>
#include <unistd.h>

namespace forest {

void keep_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0)  // open() takes the lowest number that is free, which is this one
      (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

void tell(std::string_view text) {
  [[maybe_unused]] const std::size_t told = std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace forest
