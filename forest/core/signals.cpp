// SPDX-License-Identifier: Apache-2.0
#include "forest/core/signals.h"

#include <csignal>
#include <cstring>
#include <unistd.h>

namespace forest {
namespace {

char who[64] = "";

// Only what may be called within a signal.
void on_bus_error(int) {
  constexpr char sentence[] =
      ": a file became shorter while it was read, or its disk failed; begin again once it is whole\n";
  [[maybe_unused]] ssize_t told = write(STDERR_FILENO, who, std::strlen(who));
  told = write(STDERR_FILENO, sentence, sizeof(sentence) - 1);
  _exit(1);
}

}  // namespace

void say_signals(const char* program) {
  std::strncpy(who, program, sizeof(who) - 1);
  std::signal(SIGBUS, on_bus_error);
  std::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace forest
