// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

#include "apps/cli/console.h"
#include "apps/cli/verb.h"

int main(int argc, char** argv) {
  using namespace forest;
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is a full disk: an error with a sentence
  cli::Console console;
  CLI::App app{"Brain Forest: from traced neurons to a forest one can walk through.", "brainforest"};
  app.set_version_flag("--version", FOREST_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  std::function<void()> run;
  for (const cli::Verb& verb : cli::verbs()) {
    CLI::App* command = app.add_subcommand(verb.name, verb.summary);
    command->footer(fmt::format("Example:\n  {}", verb.example));
    command->add_flag("--json", console.json, "Print results as JSON");
    command->add_option("--threads", console.threads, "Number of threads; 0 for all cores")
        ->check(CLI::NonNegativeNumber);
    command->callback([&run, job = verb.setup(*command, console)] { run = job; });
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = app.exit(error);
    return status == 0 ? 0 : 2;
  }
  try {
    const ThreadLimit limit(console.threads);
    run();
    return 0;
  } catch (const std::bad_alloc&) {
    console.warn("brainforest: there is not enough memory for this; use fewer or smaller neurons");
  } catch (const std::exception& error) {
    console.warn(fmt::format("brainforest: {}", error.what()));
  }
  return 1;
}
