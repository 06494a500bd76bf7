// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/drawer.h"

#include <map>

#include <CLI/CLI.hpp>

#include "forest/core/error.h"
#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"

namespace forest::cli {
namespace {

class OffscreenRenderer final : public render::Renderer {
 public:
  void load(const frame::Geometry& geometry) override { renderer_.load(geometry); }
  frame::Timing draw(const frame::Frame& frame) override { return renderer_.draw(frame); }
  frame::Image read() override { return renderer_.read(); }
  const frame::DepthMap& seen() const override { return renderer_.seen(); }
  std::string name() const override { return renderer_.name(); }
  bool on_processor() const { return renderer_.on_processor(); }

 private:
  render::OffscreenContext context_;
  render::OpenGLRenderer renderer_;
};

const std::map<std::string, Drawer> names{
    {"auto", Drawer::automatic}, {"opengl", Drawer::opengl}, {"cpu", Drawer::processor}};

}  // namespace

std::unique_ptr<render::Renderer> make_renderer(Drawer drawer) {
  if (drawer == Drawer::opengl) return std::make_unique<OffscreenRenderer>();
  if (drawer == Drawer::automatic) try {
      auto card = std::make_unique<OffscreenRenderer>();
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
