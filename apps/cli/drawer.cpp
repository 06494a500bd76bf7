// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/drawer.h"

#include "forest/core/error.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/opengl/offscreen.h"

namespace forest::cli {

std::unique_ptr<render::Renderer> make_renderer(Drawer drawer) {
  if (drawer == Drawer::opengl) return std::make_unique<render::OffscreenRenderer>();
  if (drawer == Drawer::automatic) try {
      auto card = std::make_unique<render::OffscreenRenderer>();
      if (!card->on_processor()) return card;
    } catch (const Error&) {  // no OpenGL here
    }
  return std::make_unique<render::CpuRenderer>();
}

}  // namespace forest::cli
