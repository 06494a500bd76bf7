// SPDX-License-Identifier: Apache-2.0
// An OpenGL 4.5 core context without a window (EGL, surfaceless), on a graphics card or on Mesa's llvmpipe.
#pragma once

#include <memory>

namespace forest::render {

/// Current on the thread that made it, until another is. Throws Error, with what to install, when there is none.
class OffscreenContext {
 public:
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// Again, on the same thread.
  void make_current();

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace forest::render
