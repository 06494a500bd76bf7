// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/context.h"

#include <array>
#include <dlfcn.h>
#include <initializer_list>
#include <string>

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::render {
namespace {

constexpr const char* otherwise = "or draw on the processor with --renderer cpu";

// libepoxy ends the program when it finds no library, so one is looked for before it does. It stays open: libepoxy wants it too.
void need_library(std::initializer_list<const char*> files, const char* package) {
  for (const char* file : files)
    if (dlopen(file, RTLD_LAZY | RTLD_LOCAL)) return;
  throw Error(
      fmt::format("the library {} cannot be opened, without which OpenGL draws nothing; install {}, {}",
                  *files.begin(), package, otherwise));
}

}  // namespace

struct OffscreenContext::Handles {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  std::string refused;  // the driver that could be had and is too old

  bool make(EGLDisplay candidate, const EGLint* attributes) {
    EGLContext made = eglCreateContext(candidate, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (made == EGL_NO_CONTEXT) return false;
    if (eglMakeCurrent(candidate, EGL_NO_SURFACE, EGL_NO_SURFACE, made)) {
      display = candidate, context = made;
      return true;
    }
    eglDestroyContext(candidate, made);
    return false;
  }
  void close() {
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
  }

  bool open(EGLDisplay candidate) {
    if (candidate == EGL_NO_DISPLAY || !eglInitialize(candidate, nullptr, nullptr)) return false;
    // First one that says when the card was reset, instead of ending the program; not every driver has it.
    static constexpr EGLint attributes[] = {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                            EGL_LOSE_CONTEXT_ON_RESET,
                                            EGL_CONTEXT_MAJOR_VERSION,
                                            4,
                                            EGL_CONTEXT_MINOR_VERSION,
                                            5,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                            EGL_NONE};
    if (eglBindAPI(EGL_OPENGL_API)) {
      if (make(candidate, attributes) || make(candidate, attributes + 2)) return true;
      static constexpr EGLint any[] = {EGL_NONE};
      if (make(candidate, any)) {
        refused =
            fmt::format("{} offers OpenGL {}.{}", reinterpret_cast<const char*>(glGetString(GL_RENDERER)),
                        epoxy_gl_version() / 10, epoxy_gl_version() % 10);
        close();
      }
    }
    eglTerminate(candidate);
    return false;
  }
};

OffscreenContext::OffscreenContext() : handles_(std::make_unique<Handles>()) {
  need_library({"libEGL.so.1"}, "libegl1");
  need_library({"libOpenGL.so.0", "libGL.so.1"}, "libopengl0");
  // A graphics card's device platform first, then Mesa's surfaceless one, which llvmpipe serves everywhere.
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    eglQueryDevicesEXT(EGLint(devices.size()), devices.data(), &count);
    for (EGLint i = 0; i < count; ++i) {
      const char* extensions = eglQueryDeviceStringEXT(devices[std::size_t(i)], EGL_EXTENSIONS);
      const bool software = extensions && epoxy_extension_in_string(extensions, "EGL_MESA_device_software");
      if (!software &&
          handles_->open(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[std::size_t(i)], nullptr)))
        return;
    }
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless") &&
      handles_->open(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)))
    return;
  if (!handles_->refused.empty())
    throw Error(
        fmt::format("{}, and 4.5 is needed for its compute shaders; install a newer driver "
                    "(libgl1-mesa-dri has one for every computer), {}",
                    handles_->refused, otherwise));
  throw Error(
      fmt::format("no OpenGL 4.5 could be had without a window; install libegl1 and libgl1-mesa-dri or a "
                  "graphics driver with EGL, {}",
                  otherwise));
}

OffscreenContext::~OffscreenContext() { handles_->close(); }

void OffscreenContext::make_current() {
  if (eglGetCurrentContext() == handles_->context) return;
  if (!eglMakeCurrent(handles_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, handles_->context))
    throw Error(
        fmt::format("the graphics driver does not go on with another picture; start again, {}", otherwise));
}

}  // namespace forest::render
