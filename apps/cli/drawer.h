// SPDX-License-Identifier: Apache-2.0
// Who draws pictures without a window.
#pragma once

#include <memory>

#include "forest/render/renderer.h"

#include "apps/drawer.h"

namespace forest::cli {

/// Throws Error, with what to install, when it is OpenGL that is asked for and cannot be had.
std::unique_ptr<render::Renderer> make_renderer(Drawer drawer);

}  // namespace forest::cli
