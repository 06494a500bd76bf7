// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program that draws by OpenGL: at every SIGUSR1 its driver says once that the card was reset.
#include <atomic>
#include <csignal>

#include <epoxy/gl.h>

namespace {

std::atomic<int> resets = 0;

GLenum status() {
  int left = resets;
  return left > 0 && resets.compare_exchange_strong(left, left - 1) ? GL_UNKNOWN_CONTEXT_RESET : GL_NO_ERROR;
}

[[gnu::constructor]] void prepare() {
  epoxy_glGetGraphicsResetStatus = status;
  std::signal(SIGUSR1, [](int) { ++resets; });
}

}  // namespace
