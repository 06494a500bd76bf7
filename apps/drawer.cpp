// SPDX-License-Identifier: Apache-2.0
#include "apps/drawer.h"

#include <map>
#include <string>

#include <CLI/App.hpp>

#include "apps/choice.h"

namespace forest {

void add_renderer(CLI::App& command, Drawer& drawer) {
  static const std::map<std::string, Drawer> names{
      {"auto", Drawer::automatic}, {"opengl", Drawer::opengl}, {"cpu", Drawer::processor}};
  command
      .add_option(
          "--renderer", drawer,
          "Who draws: opengl (a graphics card or Mesa's llvmpipe), cpu, or auto: the card where there is one")
      ->transform(one_of(names))
      ->option_text("auto|opengl|cpu");
}

}  // namespace forest
