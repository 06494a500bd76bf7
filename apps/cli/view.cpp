// SPDX-License-Identifier: Apache-2.0
// brainforest view: opens the studio, the program beside this one.
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <unistd.h>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "apps/cli/artist.h"
#include "apps/cli/console.h"
#include "apps/cli/studio.h"
#include "apps/cli/target_options.h"
#include "apps/cli/verb.h"

namespace forest::cli {

bool has_display() { return std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY"); }

void open_studio(const std::filesystem::path& forest, const std::string& view,
                 const std::vector<std::filesystem::path>& node_sets, const std::filesystem::path& activity,
                 const std::vector<std::string>& more) {
  if (!has_display())
    throw Error(
        "there is no display to open the studio on; make a picture with 'brainforest render' instead");
  std::error_code ignored;
  const auto studio =
      std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "brainforest-studio";
  std::vector<std::string> words{studio.string(), forest.string()};
  if (!view.empty()) words.insert(words.end(), {"--view", view});
  for (const auto& file : node_sets) words.insert(words.end(), {"--node-sets", file.string()});
  if (!activity.empty()) words.insert(words.end(), {"--activity", activity.string()});
  words.insert(words.end(), more.begin(), more.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::fflush(nullptr);
  ::execv(arguments[0], arguments.data());
  throw Error(fmt::format("the studio cannot be started ({}: {}); build it with './dev build'",
                          studio.string(), std::strerror(errno)));
}

std::function<void()> view(CLI::App& command, Console&) {
  struct Options {
    std::filesystem::path forest, activity, synapses;
    std::string view, size;
    std::vector<std::filesystem::path> node_sets;
    std::vector<std::string> surfaces, overlays;
  };
  const auto options = std::make_shared<Options>();
  command.add_option("forest", options->forest, "Forest file, traced neurons, or the surface of a cortex")
      ->required();
  command.add_option("--view", options->view, "View as a JSON file or text (docs/scene/view.md)");
  add_node_sets(command, options->node_sets);
  command.add_option("--activity", options->activity, "An activity file to play");
  command.add_option(
      "--synapses", options->synapses,
      "Synapses, made by 'brainforest pack'; by default those of column.synapses beside column.forest");
  command.add_option("--size", options->size, "Size of the window in pixels, for example 1280x800");
  command.add_option("--surface", options->surfaces, "Surface of a cortex to show, too")
      ->allow_extra_args(false);
  command
      .add_option("--overlay", options->overlays, "Values or areas that colour the surfaces, in their order")
      ->allow_extra_args(false);
  return [options] {
    MappedFile exists(options->forest);  // says so here rather than in a window
    for (const auto& file : {options->activity, options->synapses})
      if (!file.empty()) MappedFile also(file);
    std::vector<std::string> more;
    if (!options->size.empty()) {
      parse_size(options->size);  // or says so here
      more.insert(more.end(), {"--size", options->size});
    }
    if (!options->synapses.empty()) more.insert(more.end(), {"--synapses", options->synapses.string()});
    for (const std::string& file : options->surfaces) more.insert(more.end(), {"--surface", file});
    for (const std::string& file : options->overlays) more.insert(more.end(), {"--overlay", file});
    open_studio(options->forest, options->view, options->node_sets, options->activity, more);
  };
}

}  // namespace forest::cli
