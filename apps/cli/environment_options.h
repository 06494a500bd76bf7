// SPDX-License-Identifier: Apache-2.0
// Where neurons grow, as the command line says it (docs/lsystem/environment.md).
#pragma once

#include <optional>
#include <string>

#include "forest/cortex/environment.h"

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

struct EnvironmentOptions {
  std::string file, at;
  std::optional<double> depth;
};

/// --environment, --at and --depth.
void add_environment(CLI::App& command, EnvironmentOptions& options);

/// An environment and the place in it; as it does not move, site() stays good.
class Surroundings {
 public:
  /// Reads the file of an environment, a recipe or a circuit; of a recipe that ships its name will do. Without --environment
  /// there is nothing around. Throws InputError, and Error when a depth is asked for and there is no pia.
  Surroundings(const EnvironmentOptions& options, Console& console);
  Surroundings(const Surroundings&) = delete;

  const cortex::Site& site() const { return site_; }

 private:
  cortex::Environment environment_;
  cortex::Site site_;
};

}  // namespace forest::cli
