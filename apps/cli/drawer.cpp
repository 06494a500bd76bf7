// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/drawer.h"

#include <map>

#include <CLI/App.hpp>

#include "forest/core/error.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/opengl/offscreen.h"

namespace forest::cli {
namespace {

const std::map<std::string, Drawer> names{
    {"auto", Drawer::automatic}, {"opengl", Drawer::opengl}, {"cpu", Drawer::processor}};

}  // namespace

std::unique_ptr<render::Renderer> make_renderer(Drawer drawer) {
  if (drawer == Drawer::opengl) return std::make_unique<render::OffscreenRenderer>();
  if (drawer == Drawer::automatic) try {
      auto card = std::make_unique<render::OffscreenRenderer>();
      if (!card->on_processor()) return card;
    } catch (const Error&) {  // no OpenGL here
    }
  return std::make_unique<render::CpuRenderer>();
}

void add_renderer(CLI::App& command, Drawer& drawer) {
  command
      .add_option(
          "--renderer", drawer,
          "Who draws: opengl (a graphics card or Mesa's llvmpipe), cpu, or auto: the card where there is one")
      ->transform(CLI::CheckedTransformer(names))
      ->option_text("auto|opengl|cpu");
}

}  // namespace forest::cli
