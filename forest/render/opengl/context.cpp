// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/context.h"

#include <array>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include "forest/core/error.h"

namespace forest::render {

struct OffscreenContext::Handles {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  // A graphics card's device platform first, then Mesa's surfaceless one, which llvmpipe serves everywhere.
  bool open(EGLDisplay candidate) {
    if (candidate == EGL_NO_DISPLAY || !eglInitialize(candidate, nullptr, nullptr)) return false;
    static constexpr EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                            4,
                                            EGL_CONTEXT_MINOR_VERSION,
                                            5,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                            EGL_NONE};
    if (eglBindAPI(EGL_OPENGL_API))
      if (EGLContext made = eglCreateContext(candidate, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes)) {
        if (eglMakeCurrent(candidate, EGL_NO_SURFACE, EGL_NO_SURFACE, made)) {
          display = candidate, context = made;
          return true;
        }
        eglDestroyContext(candidate, made);
      }
    eglTerminate(candidate);
    return false;
  }
};

OffscreenContext::OffscreenContext() : handles_(std::make_unique<Handles>()) {
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
  throw Error(
      "no OpenGL 4.5 could be had without a window; install libegl1 and libgl1-mesa-dri, or a graphics "
      "driver with EGL");
}

OffscreenContext::~OffscreenContext() {
  eglMakeCurrent(handles_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(handles_->display, handles_->context);
}

}  // namespace forest::render
