// SPDX-License-Identifier: Apache-2.0
// Actions of brainforest cortex that have a file of their own, as verbs do (verb.h).
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

std::function<void()> cortex_compare(CLI::App& command, Console& console);
std::function<void()> cortex_contours(CLI::App& command, Console& console);
std::function<void()> cortex_distance(CLI::App& command, Console& console);
std::function<void()> cortex_faces(CLI::App& command, Console& console);
std::function<void()> cortex_grid(CLI::App& command, Console& console);
std::function<void()> cortex_surfaces(CLI::App& command, Console& console);

}  // namespace forest::cli
