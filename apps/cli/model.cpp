// SPDX-License-Identifier: Apache-2.0
// brainforest model: the knowledge base of a repository. A model is the text of a grammar with its named distributions,
// kept in versions of which none is ever changed.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <unistd.h>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/line_diff.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/neurons.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using namespace repository;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> names;
  std::string repo, name, population;
  fs::path out;
  bool all = false, force = false;
};

std::string full_name(const ModelRow& model) { return fmt::format("{}@{}", model.name, model.version); }

Json json_of(const ModelRow& model) {
  Json distributions = Json::array();
  for (const auto& [name, version] : model.distributions)
    distributions.push_back({{"name", name}, {"version", version}});
  return {{"name", model.name},
          {"version", model.version},
          {"population", model.population},
          {"origin", model.origin},
          {"hash", model.hash},
          {"program", model.program},
          {"neurons", model.neurons},
          {"distributions", distributions}};
}

/// A text for a terminal, which must not take any of it for a command.
std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text)
    (c >= 0 && c < ' ' && c != '\n' && c != '\t') || c == 0x7f ? out += fmt::format("\\x{:02X}", int(c))
                                                               : out += c;
  return out;
}

void say_text(const std::string& text, Console& console) {
  console.say(printable(text.ends_with('\n') ? text.substr(0, text.size() - 1) : text));
}

// ── Keeping one ──

NewModel model_of(const lsystem::Grammar& grammar, std::string name, std::string population,
                  std::string origin) {
  return {std::move(name), grammar.text, std::move(population), std::move(origin), distributions_of(grammar)};
}

struct Kept {
  std::string name;
  int version = 0;
  bool already_there = false;
};

void tell(const std::vector<Kept>& kept, const std::string& repo, Console& console) {
  Json list = Json::array();
  std::vector<std::vector<std::string>> lines;
  for (const Kept& k : kept) {
    list.push_back({{"name", k.name}, {"version", k.version}, {"already_there", k.already_there}});
    lines.push_back({k.name, std::to_string(k.version), k.already_there ? "the same as before" : "stored"});
  }
  console.table({"model", "version", ""}, lines);
  console.print({{"repository", repo}, {"models", list}});
}

// ── What can be done ──

void list(const Options& options, Console& console) {
  Json out = Json::array();
  std::vector<std::vector<std::string>> lines;
  const Repository repository = Repository::open(options.repo, Access::read);
  const auto models = repository.models();
  for (std::size_t i = 0; i < models.size(); ++i) {
    const ModelRow& m = models[i];
    const bool newest = i + 1 == models.size() || models[i + 1].name != m.name;
    if (!newest && !options.all) continue;
    if (!options.population.empty() && m.population != options.population) continue;
    out.push_back(json_of(m));
    lines.push_back({m.name, std::to_string(m.version), m.population, std::to_string(m.distributions.size()),
                     std::to_string(m.neurons), escaped(m.origin)});
  }
  if (lines.empty())
    console.say(fmt::format("{} holds no {}model", options.repo, options.population.empty() ? "" : "such "));
  else
    console.table({"model", "version", "population", "distributions", "neurons", "origin"}, lines);
  // Those that 'distributions --keep' stored belong to no model.
  std::set<std::string> of_models, alone;
  for (const ModelRow& m : models)
    for (const auto& [name, version] : m.distributions) of_models.insert(name);
  for (const auto& d : repository.distributions())
    if (!of_models.contains(d.name) && (options.population.empty() || d.population == options.population))
      alone.insert(d.name);
  if (!alone.empty())
    console.say(fmt::format("{} of no model: {}; 'model show NAME' shows one",
                            counted(alone.size(), "distribution"), fmt::join(alone, ", ")));
  console.print(out);
}

/// A distribution by "MODEL.NAME" or "MODEL.NAME@version", when there is one.
bool show_distribution(const Repository& repository, const std::string& text, Console& console, Json& out) {
  const auto [name, version] = reference_of(text);
  std::map<std::string, DistributionRow> chosen;  // of each population
  for (DistributionRow& row : repository.distributions())
    if (row.name == name && (!version || row.version == version)) {
      const std::string population = row.population;
      chosen[population] = std::move(row);  // the newest comes last
    }
  for (const auto& [population, row] : chosen) {
    say_text(row.text, console);
    out.push_back(
        {{"name", row.name}, {"version", row.version}, {"population", population}, {"text", row.text}});
  }
  return !chosen.empty();
}

/// Throws Error when this is "MODEL.NAME" of a model that has no distribution of that name.
void must_have_distribution(const Repository& repository, const std::string& text) {
  const std::size_t dot = text.rfind('.');
  if (dot == text.npos || repository.model(reference_of(text).name)) return;
  const auto model = repository.model(text.substr(0, dot));
  if (!model) return;
  std::vector<std::string> names;
  for (const auto& [name, version] : model->distributions) names.push_back(name);
  throw Error(fmt::format("model {} has no distribution '{}'; {}", repository::shown(model->name),
                          escaped(text.substr(dot + 1)),
                          names.empty() ? "it has none" : fmt::format("it has {}", fmt::join(names, ", "))));
}

void show(const Options& options, Console& console) {
  const Repository repository = Repository::open(options.repo, Access::read);
  Json out = Json::array();
  for (const std::string& name : options.names) {
    if (!repository.model(reference_of(name).name) && show_distribution(repository, name, console, out))
      continue;
    must_have_distribution(repository, name);
    const ModelRow model = find_model(repository, name);
    Json json = json_of(model);
    json["text"] = model.text;
    out.push_back(std::move(json));
    say_text(model.text, console);
  }
  console.print(out);
}

void import_models(const Options& options, Console& console) {
  const auto built_in = built_in_grammars();
  std::vector<NewModel> models;  // all are read before one is stored
  for (const std::string& name : options.names) {
    const lsystem::Grammar grammar = find_grammar(name);
    tell_doubts(grammar, console);
    const std::string own = escaped(grammar.name);  // a file may have any
    models.push_back(
        model_of(grammar, options.name.empty() ? own : options.name, options.population,
                 (std::ranges::count(built_in, name) ? "the built-in grammar " : "from ") + name));
  }
  Repository repository = Repository::open(options.repo, Access::write);
  std::vector<Kept> kept;
  auto transaction = repository.begin();
  for (const NewModel& model : models) {
    const auto [version, already_there] = repository.add_model(model);
    kept.push_back({model.name, version, already_there});
  }
  transaction.commit();
  tell(kept, options.repo, console);
}

void export_models(const Options& options, Console& console) {
  if (extension_of(options.out) == ".lsys" && !fs::is_directory(options.out))
    throw Error(fmt::format("{} is to be a folder, for a file NAME.lsys of each model; give a folder",
                            options.out.string()));
  const Repository repository = Repository::open(options.repo, Access::read);
  std::vector<ModelRow> models;
  std::map<std::string, int> count;
  if (options.names.empty())
    for (ModelRow& model : repository.models()) {
      if (!models.empty() && models.back().name == model.name) models.pop_back();
      models.push_back(std::move(model));
    }
  for (const std::string& name : options.names) models.push_back(find_model(repository, name));
  if (models.empty())
    throw Error(fmt::format("{} holds no model to export; import some first", options.repo));
  for (const ModelRow& model : models) ++count[model.name];
  std::vector<fs::path> files;
  Overwrites overwrites;
  for (const ModelRow& model : models) {  // several versions of one need different names
    files.push_back(options.out /
                    (file_name(count[model.name] > 1 ? full_name(model) : model.name) + ".lsys"));
    overwrites.look(files.back(), model.text);
  }
  if (!options.force) overwrites.refuse();
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error)
    throw Error(fmt::format("{}: cannot be made ({}); name a folder that can be written",
                            options.out.string(), error.message()));
  Json list = Json::array();
  std::vector<std::vector<std::string>> lines;
  for (std::size_t i = 0; i < models.size(); ++i) {
    write_file(files[i], std::string_view(models[i].text));
    list.push_back({{"name", models[i].name}, {"version", models[i].version}, {"file", files[i].string()}});
    lines.push_back({models[i].name, std::to_string(models[i].version), files[i].string()});
  }
  console.table({"model", "version", "file"}, lines);
  console.print({{"models", list}});
}

/// A folder that goes when the object goes, unless it is kept.
class PassingFolder {
 public:
  PassingFolder() {
    std::string name = (fs::temp_directory_path() / "brainforest-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw Error(name + ": cannot be made; set TMPDIR to a folder that can be written");
    path = name;
  }
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;
  ~PassingFolder() {
    std::error_code none;
    if (!keep) fs::remove_all(path, none);
  }

  fs::path path;
  bool keep = false;
};

/// Opens the person's editor on a file and waits until it is closed.
void open_editor(const fs::path& file) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", R"(eval "exec ${EDITOR:-vi} \"\$0\"")", file.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Error("the editor ended with an error, so nothing is stored; name another in EDITOR");
}

void edit(const Options& options, Console& console) {
  const ModelRow model =
      find_model(open_to_write(options.repo), options.names[0]);  // closed while one thinks
  PassingFolder folder;
  const fs::path file = folder.path / (file_name(model.name) + ".lsys");
  write_file(file, std::string_view(model.text));
  open_editor(file);
  const std::string text(MappedFile(file).text());
  if (text == model.text && options.population.empty()) {
    console.say(fmt::format("{} is as it was; nothing is stored", full_name(model)));
    return console.print({{"repository", options.repo}, {"models", Json::array()}});
  }
  NewModel next;
  try {
    const lsystem::Grammar grammar = lsystem::parse(text, file.string());
    tell_doubts(grammar, console);
    next = model_of(grammar, model.name, options.population,
                    fmt::format("edited from version {}", model.version));
  } catch (const InputError& error) {
    folder.keep = true;
    throw Error(fmt::format(
        "{}; nothing is stored and the text is kept: mend it there, then brainforest model import",
        error.what()));
  }
  if (next.population.empty()) next.population = model.population;
  try {
    const auto [version, already_there] = open_to_write(options.repo).add_model(next);
    tell({{model.name, version, already_there}}, options.repo, console);
  } catch (const Error&) {
    folder.keep = true;
    console.warn(fmt::format("the edited text is kept in {}", file.string()));
    throw;
  }
}

void diff(const Options& options, Console& console) {
  const Repository repository = Repository::open(options.repo, Access::read);
  ModelRow to = find_model(repository, options.names.back());
  ModelRow from;
  if (options.names.size() == 2) {
    from = find_model(repository, options.names[0]);
  } else {
    for (ModelRow& row : repository.models())
      if (row.name == to.name && row.version < to.version) from = std::move(row);  // the last of them
    if (from.name.empty())
      throw Error(
          fmt::format("{} has no version before it; name the model to compare it with", full_name(to)));
  }
  const std::string text = unified_diff(from.text, to.text, full_name(from), full_name(to));
  if (text.empty())
    console.say(fmt::format("{} and {} are the same text", full_name(from), full_name(to)));
  else
    say_text(text, console);
  console.print({{"from", json_of(from)}, {"to", json_of(to)}, {"diff", text}});
}

void remove(const Options& options, Console& console) {
  Repository repository = open_to_write(options.repo);
  std::map<std::pair<std::string, int>, ModelRow> chosen;  // one may be named twice
  for (const std::string& name : options.names) {
    ModelRow model = find_model(repository, name);
    if (options.all && model.name != name)
      throw Error(fmt::format("{} is one version; name the model alone, or leave out --all", shown(name)));
    if (options.all) {
      for (ModelRow& row : repository.models())
        if (row.name == name) chosen[{row.name, row.version}] = std::move(row);
    } else {
      chosen[{model.name, model.version}] = std::move(model);
    }
  }
  Json list = Json::array();
  std::vector<std::vector<std::string>> lines;
  auto transaction = repository.begin();
  for (const auto& [key, model] : chosen) {
    if (!repository.remove_model(model.name, model.version))
      throw Error(fmt::format("{} was removed by somebody else; nothing is removed", full_name(model)));
    list.push_back(json_of(model));
    lines.push_back({model.name, std::to_string(model.version),
                     model.neurons ? fmt::format("{} grown from it, which keep its text",
                                                 counted(model.neurons, "neuron"))
                                   : ""});
  }
  transaction.commit();
  console.table({"model", "version", "neurons"}, lines);
  console.say(fmt::format("{} removed from {}", counted(lines.size(), "version"), options.repo));
  console.print({{"repository", options.repo}, {"removed", list}});
}

// ── One row each ──

struct Action {
  const char* name;
  const char* summary;
  const char* example;
  int least, most;                    // names
  const char* what;                   // they are
  void (*more)(CLI::App&, Options&);  // options
  void (*run)(const Options&, Console&);
};

void add_all(CLI::App& app, Options& o) {
  app.add_flag("--all", o.all, "Every version, not only the newest");
  must_be_name(*app.add_option("--population", o.population, "Only models of this population"));
}
void add_every(CLI::App& app, Options& o) {
  app.add_flag("--all", o.all, "Every version of each, not only the newest");
}
void add_import(CLI::App& app, Options& o) {
  must_be_name(*app.add_option("--name", o.name, "Another name than the file's; with one file"));
  must_be_name(*app.add_option("--population", o.population, "The population that it describes"));
  app.parse_complete_callback([&o] {
    if (!o.name.empty() && o.names.size() > 1) throw CLI::ValidationError("--name is for one file");
  });
}
void add_out(CLI::App& app, Options& o) {
  app.add_option("--out", o.out, "Folder for the files; made when there is none")
      ->required()
      ->type_name("FOLDER");
  add_force(app, o.force);
}
void add_population(CLI::App& app, Options& o) {
  must_be_name(*app.add_option("--population", o.population, "The population that it describes from now on"));
}

constexpr const char* which = "Models by name, of which the newest version is meant, or NAME@version";
constexpr Action actions[] = {
    {"list", "List the models of a repository", "brainforest model list --repo cells.db", 0, 0, "", add_all,
     list},
    {"show", "Print the text of a model, or of one of its distributions",
     "brainforest model show motoneuron@2 --repo cells.db\n  brainforest model show motoneuron.ratio --repo "
     "cells.db",
     1, 1000, which, nullptr, show},
    {"edit", "Change a model in the editor that EDITOR names; what is saved becomes its next version",
     "EDITOR=nano brainforest model edit motoneuron --repo cells.db", 1, 1, which, add_population, edit},
    {"import", "Store grammars as the next versions of models",
     "brainforest model import pyramidal my/*.lsys --repo cells.db --population L5", 1, 1000,
     "Files in the notation of grammars, or grammars that come with the program", add_import, import_models},
    {"export", "Write models as files that grow and import read",
     "brainforest model export --repo cells.db --out models/", 0, 1000, which, add_out, export_models},
    {"diff", "Say what differs between two versions, or two models, as diff -u does",
     "brainforest model diff motoneuron --repo cells.db\n"
     "  brainforest model diff motoneuron@1 motoneuron@3 --repo cells.db",
     1, 2, which, nullptr, diff},
    {"remove",
     "Take versions of models out, all that are named or none; neurons keep the texts they grew from",
     "brainforest model remove motoneuron@2 --repo cells.db\n"
     "  brainforest model remove bush --all --repo cells.db",
     1, 1000, which, add_every, remove},
};

}  // namespace

std::function<void()> model(CLI::App& command, Console& console) {
  command.require_subcommand(1);
  const auto chosen = std::make_shared<std::function<void()>>();
  for (const Action& action : actions) {
    CLI::App* sub = command.add_subcommand(action.name, action.summary);
    const auto options = std::make_shared<Options>();
    sub->footer(fmt::format("Example:\n  {}", action.example));
    add_common(*sub, console);
    if (action.most)
      sub->add_option("names", options->names, action.what)
          ->expected(action.least, action.most)
          ->required(action.least > 0)
          ->type_name("NAMES");
    sub->add_option("--repo", options->repo, "The repository")->required()->type_name("REPO");
    if (action.more) action.more(*sub, *options);
    sub->callback([chosen, options, run = action.run, &console] {
      *chosen = [options, run, &console] { run(*options, console); };
    });
  }
  return [chosen] { (*chosen)(); };
}

}  // namespace forest::cli
