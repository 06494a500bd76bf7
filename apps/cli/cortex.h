// SPDX-License-Identifier: Apache-2.0
// Actions of brainforest cortex that have a file of their own, as verbs do (verb.h).
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>

#include "forest/geometry/mesh.h"

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

/// An option, what it says something of, and whether there is such a thing.
struct OptionUse {
  const char *option, *of;
  bool used;
};
/// Throws Error for one that was given and says nothing: it was meant for other input.
void must_be_used(const CLI::App& command, std::initializer_list<OptionUse> options);

/// A surface from a file; throws InputError for what cannot be read.
Mesh read_mesh(const std::filesystem::path& path);

std::function<void()> cortex_compare(CLI::App& command, Console& console);
std::function<void()> cortex_contours(CLI::App& command, Console& console);
std::function<void()> cortex_curves(CLI::App& command, Console& console);
std::function<void()> cortex_distance(CLI::App& command, Console& console);
std::function<void()> cortex_faces(CLI::App& command, Console& console);
std::function<void()> cortex_grid(CLI::App& command, Console& console);
std::function<void()> cortex_lines(CLI::App& command, Console& console);
std::function<void()> cortex_surfaces(CLI::App& command, Console& console);

}  // namespace forest::cli
