// SPDX-License-Identifier: Apache-2.0
// A verb of the command line is one file and one row in verbs.cpp.
#pragma once

#include <functional>
#include <span>

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

/// Adds the options of a verb to its subcommand and returns what runs when the verb is called.
/// The returned function reports failure by throwing forest::Error.
using Setup = std::function<void()> (*)(CLI::App& command, Console& console);

struct Verb {
  const char* name;
  const char* summary;  // one line, in the imperative
  const char* example;  // one or more command lines, shown by --help
  Setup setup;
};

std::span<const Verb> verbs();

}  // namespace forest::cli
