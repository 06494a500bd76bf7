// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/heap.h"
#include "forest/core/parallel.h"
#include "forest/core/signals.h"
#include "forest/core/standard_error.h"
#include "forest/repository/names.h"

#include "apps/choice.h"
#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace {

/// What is wrong when the words so far lead to no verb (or no benchmark); empty when they do.
std::string missing_verb(const CLI::App& app) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
  std::string names;
  for (const CLI::App* sub : at->get_subcommands([](const CLI::App*) { return true; }))
    names += (names.empty() ? "" : ", ") + sub->get_name();
  if (names.empty()) return {};
  const char* kind = at == &app ? "verb" : at->get_name() == "bench" ? "benchmark" : "action";
  for (const std::string& word : at->remaining())
    if (!word.starts_with('-'))
      return fmt::format("there is no {} {}; there are: {}", kind, forest::repository::shown(word), names);
  return at->remaining().empty() ? fmt::format("say which {}, one of: {}", kind, names) : "";
}

}  // namespace

int main(int argc, char** argv) {
  using namespace forest;
  keep_standard_streams();
  keep_freed_memory();
  say_signals("brainforest");
  cli::Console console;
  CLI::App app{"Brain Forest: from traced neurons to a forest one can walk through.", "brainforest"};
  app.set_version_flag("--version", FOREST_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* at, const CLI::Error& error) {
    return fmt::format("brainforest: {}\nRun with {} for more information.\n", sentence_of(error),
                       at->get_help_ptr() ? at->get_help_ptr()->get_name(false, false) : "--help");
  });
  std::function<void()> run;
  for (const cli::Verb& verb : cli::verbs()) {
    CLI::App* command = app.add_subcommand(verb.name, verb.summary);
    command->footer(fmt::format("Example:\n  {}", verb.example));
    cli::add_common(*command, console);
    command->callback([&run, job = verb.setup(*command, console)] { run = job; });
    refuse_empty(*command);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0)
      if (const std::string sentence = missing_verb(app); !sentence.empty()) {
        console.warn("brainforest: " + sentence);
        return 2;
      }
    const int status = app.exit(error);
    return status == 0 ? 0 : 2;
  }
  try {
    const ThreadLimit limit(console.threads);
    run();
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
      throw forest::Error("what was to be said cannot be written; check that the disk has room");
    return 0;
  } catch (const std::bad_alloc&) {
    console.fail(
        "there is not enough memory for this; make less at once: a smaller picture (--size), fewer or "
        "smaller "
        "neurons");
  } catch (const std::filesystem::filesystem_error& error) {
    console.fail(fmt::format("{}: {}; check the path, and who may read and write there",
                             repository::escaped(error.path1().string()), error.code().message()));
  } catch (const std::exception& error) {
    console.fail(error.what());
  }
  return 1;
}
