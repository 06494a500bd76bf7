// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/options.h"

#include <limits>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/repository/names.h"

#include "apps/cli/artist.h"
#include "apps/cli/console.h"

namespace forest::cli {

void must_be_whole(CLI::Option& option, std::uint64_t low, std::uint64_t high) {
  option.check([low, high](const std::string& text) {
    const auto value = number_of<std::uint64_t>(text);
    return value && *value >= low && *value <= high
               ? std::string()
               : fmt::format("{} is no whole number from {} to {}", repository::shown(text), low, high);
  });
}

void add_whole(CLI::App& command, const char* name, std::uint32_t& value, const char* help, std::uint64_t low,
               std::uint64_t high) {
  must_be_whole(*command.add_option(name, value, help)->capture_default_str(), low, high);
}

void must_be_within(CLI::Option& option, double low, double high) {
  option.check([low, high](const std::string& text) {
    const auto value = number_of<double>(text);
    return value && *value >= low && *value <= high  // no NaN is
               ? std::string()
               : fmt::format("{} is no number from {:g} to {:g}", repository::shown(text), low, high);
  });
}

void add_common(CLI::App& command, Console& console) {
  command.add_flag("--json", console.json, "Print results as JSON");
  must_be_whole(*command.add_option("--threads", console.threads, "Number of threads; 0 for all cores"), 0,
                4096);
}

void add_seed(CLI::App& command, std::uint64_t& seed, const char* help) {
  must_be_whole(*command.add_option("--seed", seed, help)->capture_default_str(), 0,
                std::numeric_limits<std::uint64_t>::max());
}

void add_size(CLI::App& command, std::string& size, bool even) {
  command
      .add_option("--size", size, even ? "Width x height in pixels, both even" : "Width x height in pixels")
      ->capture_default_str()
      ->check([even](const std::string& text) -> std::string {
        try {
          const auto [width, height] = parse_size(text);
          return even && (width % 2 || height % 2) ? "width and height of a film must be even" : "";
        } catch (const Error& error) {
          return error.what();
        }
      });
}

void add_budget(CLI::App& command, double& milliseconds) {
  must_be_within(*command
                      .add_option("--budget", milliseconds,
                                  "Milliseconds a picture may take before less detail is chosen")
                      ->capture_default_str(),
                 1., 10000.);
}

void add_force(CLI::App& command, bool& force) {
  command.add_flag("--force", force, "Replace files that are there and hold something else");
}

}  // namespace forest::cli
