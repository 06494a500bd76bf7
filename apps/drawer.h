// SPDX-License-Identifier: Apache-2.0
// Who draws, and how a person says so on the command lines of both programs.
#pragma once

#include <cstdint>

namespace CLI {
class App;
}

namespace forest {

enum class Drawer : std::uint8_t {
  automatic,  // the graphics card, or the processor where there is none
  opengl,     // OpenGL, also where its driver is a program (Mesa's llvmpipe)
  processor
};

/// --renderer
void add_renderer(CLI::App& command, Drawer& drawer);

}  // namespace forest
