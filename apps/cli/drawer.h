// SPDX-License-Identifier: Apache-2.0
// Who draws pictures without a window.
#pragma once

#include <memory>
#include <string>

#include "forest/render/renderer.h"

namespace CLI {
class App;
}

namespace forest::cli {

enum class Drawer {
  automatic,  // the graphics card, or the processor where there is none
  opengl,     // OpenGL, also where its driver is a program (Mesa's llvmpipe)
  processor
};

/// Throws Error, with what to install, when it is OpenGL that is asked for and cannot be had.
std::unique_ptr<render::Renderer> make_renderer(Drawer drawer);

/// --renderer
void add_renderer(CLI::App& command, Drawer& drawer);

}  // namespace forest::cli
