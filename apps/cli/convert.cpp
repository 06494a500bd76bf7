// SPDX-License-Identifier: Apache-2.0
// brainforest convert: neurons from one file format to another. What the other format has no words for is told.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/format.h"
#include "forest/io/model.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/filed_neurons.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using repository::escaped;

struct Options {
  std::vector<std::string> files;
  std::string format;
  fs::path out;
  bool verbose = false, force = false;
  std::string geometry = "cylinder";
  io::ModelOptions model;
};

/// What the files become: a row of one of the two tables.
struct Target {
  const io::Format* neuron = nullptr;
  const io::ModelFormat* model = nullptr;

  std::string_view name() const { return neuron ? neuron->name : model->name; }
  std::string_view title() const { return neuron ? neuron->title : model->title; }
  std::string_view extension() const { return neuron ? neuron->extensions[0] : model->extensions[0]; }
};

Target target_of(const fs::path& path) {
  if (const io::ModelFormat* model = io::model_format_of(path)) return {.model = model};
  std::vector<std::string_view> models;
  for (const io::ModelFormat& format : io::model_formats())
    models.insert(models.end(), format.extensions.begin(), format.extensions.end());
  return {.neuron = &io::format_of(path, models)};
}

Target find_target(std::string_view name) {
  return {.neuron = io::find_format(name), .model = io::find_model_format(name)};
}

/// A neuron on its way from one file to another.
struct Conversion {
  fs::path from, to;
  std::string cell;                   // its name in a container
  std::vector<io::Warning> warnings;  // oddities of the file that was read
  std::vector<io::Warning> losses;    // what the other one cannot hold
  std::string error;                  // why it could not be read; empty when it could
  bool skipped = false;               // it holds no neuron, and lay in a folder
};

fs::path numbered(const fs::path& path, int number) {
  return path.parent_path() / fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string());
}

using Put = std::function<void(const fs::path& to, const std::function<std::string()>& bytes)>;

/// Where the cells of a file go, each by its own name when there are several; to none of the `others`.
std::vector<fs::path> places_of(const io::CellReader& cells, const fs::path& to,
                                const std::set<fs::path>& others) {
  if (cells.count == 1) return {to};
  std::vector<std::string> names(cells.count);
  parallel_for(cells.count, 16, [&](std::size_t i) {
    try {
      names[i] = cells.name(i);
    } catch (const InputError&) {  // told when its turn comes
    }
  });
  std::vector<fs::path> places;
  std::set<fs::path> taken;
  std::map<fs::path, int> last;  // number that a name was given
  for (std::size_t i = 0; i < cells.count; ++i) {
    const std::string cell = names[i].empty() ? std::to_string(i + 1) : repository::file_name(names[i]);
    const fs::path wanted = to.parent_path() / (to.stem().string() + "-" + cell + to.extension().string());
    fs::path place = wanted;
    int& number = last.try_emplace(wanted, 1).first->second;
    while (others.contains(place) || !taken.insert(place).second) place = numbered(wanted, ++number);
    places.push_back(std::move(place));
  }
  return places;
}

/// What is done with cell i of a file, by any thread.
using Take = std::function<void(std::size_t i, Conversion&, io::Cell)>;

/// The conversions of one file: one, or one for each of its cells.
/// @param begin  is told the file before its first cell is taken
std::vector<Conversion> convert_file(const fs::path& from, const Options& options,
                                     const std::function<Take(const OpenFile&)>& begin) {
  std::vector<Conversion> done;
  try {
    const OpenFile opened(from);
    const Take take = begin(opened);
    done.resize(opened.cells.count);
    parallel_for(done.size(), 4, [&](std::size_t i) {
      Conversion& conversion = done[i];
      conversion.from = from;
      try {
        io::Cell cell = opened.cells.read(i);
        conversion.warnings = std::move(cell.read.warnings);
        take(i, conversion, std::move(cell));
      } catch (const LimitError& error) {
        conversion.error = fmt::format("{}: {}", escaped(from.string()), error.what());
      } catch (const InputError& error) {  // the other cells may be sound
        conversion.error = error.what();
      }
    });
  } catch (const InputError& error) {
    done.emplace_back(Conversion{from, {}, {}, {}, {}, error.what(), may_skip(error, from, options.files)});
  }
  return done;
}

/// Says what was found in the conversions, one after another: the cells of one damaged block share one sentence, and of many
/// losses of one kind the first few stand for all unless --verbose asks for each.
class Teller {
 public:
  Teller(const Options& options, Console& console) : options_(options), console_(console) {}

  void tell(const Conversion& conversion) {
    if (!conversion.error.empty()) {
      if (conversion.error != error_)
        console_.warn(conversion.skipped ? conversion.error + "; skipped" : conversion.error);
      error_ = conversion.error;
      return;
    }
    for (const io::Warning& w : conversion.warnings)
      if (options_.verbose || w.lost)
        tell(w, escaped(conversion.from.string()) + (w.line ? fmt::format(":{}", w.line) : ""));
    for (const io::Warning& w : conversion.losses) tell(w, escaped(conversion.to.string()));
  }
  void end() const {
    for (const auto& [code, count] : told_)
      if (count > few && !options_.verbose)
        console_.warn(fmt::format("{} more of {}; see all with --verbose", count - few, code));
  }

 private:
  static constexpr std::size_t few = 10;  // of a kind
  const Options& options_;
  Console& console_;
  std::string error_;  // the last one
  std::map<std::string_view, std::size_t> told_;

  void tell(const io::Warning& w, const std::string& where) {
    if (++told_[w.code] <= few || options_.verbose)
      console_.warn(fmt::format("{}: {}: {}", where, w.code, w.sentence));
  }
};

nlohmann::ordered_json json_of(const std::vector<io::Warning>& warnings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const io::Warning& w : warnings)
    list.push_back({{"line", w.line}, {"code", w.code}, {"sentence", escaped(w.sentence)}});
  return list;
}

/// Where each file goes: beside its name with another extension, folders as they lie below the one that was named; twins
/// are numbered.
std::vector<fs::path> targets(const Options& options, const std::vector<fs::path>& files,
                              std::string_view extension, Console& console) {
  std::vector<fs::path> targets;
  std::map<fs::path, fs::path> taken;
  std::map<fs::path, int> last;  // number that a name was given
  for (const fs::path& file : files) {
    fs::path below = file.filename();
    for (const std::string& named : options.files)
      if (fs::is_directory(named))
        if (const fs::path relative = file.lexically_relative(named);
            !relative.empty() && *relative.begin() != "..")
          below = relative;
    const fs::path wanted = options.out / below.replace_extension(std::string(extension));
    fs::path to = wanted;
    int& number = last.try_emplace(wanted, 1).first->second;
    while (!taken.try_emplace(to, file).second) to = numbered(wanted, ++number);
    if (to != wanted)
      console.warn(fmt::format("{}: becomes {}, for {} becomes {}", escaped(file.string()),
                               escaped(to.string()), escaped(taken[wanted].string()),
                               escaped(wanted.string())));
    targets.push_back(std::move(to));
  }
  return targets;
}

void report(const std::vector<std::vector<Conversion>>& done, const Target& target, const Options& options,
            Console& console) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::size_t written = 0, failed = 0, skipped = 0, oddities = 0, lost = 0;
  std::string several;  // files that one has become
  Teller teller(options, console);
  for (const auto& conversions : done) {
    if (several.empty() && conversions.size() > 1 && conversions[0].to != conversions[1].to)
      several = fmt::format(" ({}, {}{})", escaped(conversions[0].to.string()),
                            escaped(conversions[1].to.string()), conversions.size() > 2 ? ", …" : "");
    for (const Conversion& c : conversions) {
      teller.tell(c);
      (c.error.empty() ? written : c.skipped ? skipped : failed) += 1;
      const auto not_kept = std::size_t(std::ranges::count_if(c.warnings, &io::Warning::lost));
      oddities += c.warnings.size() - not_kept, lost += c.losses.size() + not_kept;
      nlohmann::ordered_json entry{{"from", escaped(c.from.string())}};
      if (c.error.empty()) {
        entry["to"] = escaped(c.to.string());
        if (!c.cell.empty()) entry["cell"] = escaped(c.cell);
        entry.update({{"warnings", json_of(c.warnings)}, {"losses", json_of(c.losses)}});
      } else {
        entry[c.skipped ? "skipped" : "error"] = c.error;
      }
      list.push_back(std::move(entry));
    }
  }
  teller.end();
  console.print({{"format", target.name()},
                 {"written", written},
                 {"failed", failed},
                 {"skipped", skipped},
                 {"files", list}});
  console.say(fmt::format("{} written as {}{}, {} not read, {} skipped, {} told above{}", written,
                          target.title(), several, failed, skipped, counted(lost, "loss", "losses"),
                          oddities && !options.verbose ? fmt::format("; {} of the files, shown by --verbose",
                                                                     counted(oddities, "oddity", "oddities"))
                                                       : ""));
  if (failed)
    throw Error(fmt::format("{} of {} could not be converted; the sentences above say why", failed,
                            counted(written + failed, "neuron")));
}

void make_folder_of(const fs::path& file) {
  std::error_code error;
  if (!file.parent_path().empty() && (fs::create_directories(file.parent_path(), error), error))
    throw Error(fmt::format("{}: the folder cannot be made ({}); name one that can be written",
                            file.parent_path().string(), error.message()));
}

/// All neurons into one file. They are called as their files are, several of a file with their own names behind; those of
/// a container alone keep theirs.
void run_together(const Options& options, const std::vector<fs::path>& files, const Target& target,
                  const fs::path& out, Console& console) {
  std::vector<std::vector<Conversion>> done(files.size());
  std::vector<std::vector<io::NamedMorphology>> read(files.size());
  console.progress().begin("converting", files.size());
  parallel_for(files.size(), 1, [&](std::size_t f) {
    done[f] = convert_file(files[f], options, [&](const OpenFile& opened) -> Take {
      const std::size_t count = opened.cells.count;
      read[f].resize(count);
      std::string stem = files.size() > 1 || count == 1 ? escaped(files[f].stem().string()) : "";
      const bool as_it_is = stem.empty() && &opened.format == target.neuron;
      return [&, f, count, stem, as_it_is](std::size_t i, Conversion& conversion, io::Cell cell) {
        std::string name = stem;
        if (count > 1) {
          if (!name.empty()) name += '-';
          name += cell.name.empty() ? std::to_string(i + 1)
                  : as_it_is        ? cell.name
                                    : repository::file_name(cell.name);
        }
        conversion.to = out;
        conversion.losses = io::losses(cell.read.morphology, target.neuron->keeps);
        read[f][i] = {std::move(name), std::move(cell.read.morphology)};
      };
    });
    console.progress().advance();
  });
  console.progress().end();

  std::vector<io::NamedMorphology> cells;
  std::set<std::string> taken;
  for (std::size_t f = 0; f < files.size(); ++f)
    for (std::size_t i = 0; i < done[f].size(); ++i) {
      Conversion& conversion = done[f][i];
      if (!conversion.error.empty()) continue;
      conversion.cell = read[f][i].name;
      for (int number = 2; !taken.insert(conversion.cell).second; ++number)
        conversion.cell = fmt::format("{}-{}", read[f][i].name, number);
      if (conversion.cell != read[f][i].name)
        console.warn(fmt::format("{}: another neuron is called '{}', so this one is written as '{}'",
                                 escaped(files[f].string()), escaped(read[f][i].name),
                                 escaped(conversion.cell)));
      cells.push_back({conversion.cell, std::move(read[f][i].morphology)});
    }
  if (!cells.empty()) {
    const std::string bytes = target.neuron->write_all(cells);
    make_folder_of(out);
    write_unless_there(out, bytes, options.force);
  }
  report(done, target, options, console);
}

/// A file, or several, for each file.
void run_apart(const Options& options, const std::vector<fs::path>& files, const std::vector<fs::path>& to,
               const Target& target, const fs::path& folder, Console& console) {
  std::vector<std::vector<Conversion>> done(files.size());
  const std::set<fs::path> others(to.begin(), to.end());
  const auto each = [&](const char* stage, const Put& put) {
    console.progress().begin(stage, files.size());
    parallel_for(files.size(), 1, [&](std::size_t f) {
      done[f] = convert_file(files[f], options, [&](const OpenFile& opened) -> Take {
        return [&, places = places_of(opened.cells, to[f], others)](std::size_t i, Conversion& conversion,
                                                                    io::Cell cell) {
          conversion.to = places[i];
          const Morphology& m = cell.read.morphology;
          put(conversion.to, [&] {
            if (target.neuron) {
              conversion.losses = io::losses(m, target.neuron->keeps);
              return target.neuron->write(m);
            }
            const io::Model model =
                io::make_model(m, conversion.to.stem().string(), options.model, conversion.losses);
            return target.model->write(model);
          });
        };
      });
      console.progress().advance();
    });
    console.progress().end();
  };
  if (!options.force && holds_files(folder)) {
    Overwrites overwrites;
    each("comparing", [&](const fs::path& path, const std::function<std::string()>& bytes) {
      if (std::error_code none; fs::exists(path, none)) overwrites.look(path, bytes());
    });
    overwrites.refuse();
  }
  for (const fs::path& path : to) make_folder_of(path);
  each("converting",
       [](const fs::path& path, const std::function<std::string()>& bytes) { write_file(path, bytes()); });
  report(done, target, options, console);
}

bool holds_several(const fs::path& path) {
  try {
    return OpenFile(path).cells.count > 1;
  } catch (const InputError&) {  // told when its turn comes
    return false;
  }
}

void run(Options options, Console& console) {
  // `convert A B`: the second name is the target when no folder is named.
  fs::path single;
  if (options.out.empty()) {
    single = options.files[1];
    if (fs::is_directory(single))
      throw Error(fmt::format("{} is a folder; convert into it with --format NAME --out {}", single.string(),
                              single.string()));
    options.files.pop_back();
  }
  const io::Format* const container = container_of(options.out);
  const Target target = !single.empty() ? target_of(single)
                        : container     ? Target{.neuron = container}
                                        : find_target(options.format);
  if (!options.format.empty() && target.name() != options.format)
    throw Error(fmt::format("--format {} and {} say different formats; leave --format out", options.format,
                            (single.empty() ? options.out : single).string()));
  if (target.neuron && !target.neuron->write)
    throw Error(fmt::format("{} can be read but not written; choose another format", target.title()));
  options.model.geometry = *io::geometry(options.geometry);
  if (target.model) io::check(*target.model, options.model.geometry);
  const std::vector<fs::path> files = neuron_files(options.files, console);
  if (container) return run_together(options, files, target, options.out, console);
  if (single.empty())
    return run_apart(options, files, targets(options, files, target.extension(), console), target,
                     options.out, console);
  if (target.neuron && target.neuron->write_all && holds_several(files[0]))
    return run_together(options, files, target, single, console);
  run_apart(options, files, {single}, target, single.has_parent_path() ? single.parent_path() : ".", console);
}

}  // namespace

std::function<void()> convert(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  std::vector<std::string> formats;
  for (const io::Format& format : io::formats())
    if (format.write) formats.emplace_back(format.name);
  for (const io::ModelFormat& format : io::model_formats()) formats.emplace_back(format.name);
  command
      .add_option("files", options->files,
                  "A file and the one to make of it; or files and folders, with --out")
      ->required();
  command.add_option("--format", options->format, "Format of the files that are made")
      ->check(CLI::IsMember(formats));
  command
      .add_option(
          "--out", options->out,
          "Folder for the files that are made, made when there is none; or one file for all, when it ends "
          "in .h5 or .cells")
      ->type_name("PATH");
  const auto geometries = io::geometry_names();
  command
      .add_option("--geometry", options->geometry,
                  "Of a model: lines, a tube a section, or one closed surface")
      ->check(CLI::IsMember(std::vector<std::string>(geometries.begin(), geometries.end())))
      ->capture_default_str();
  command.add_option("--sides", options->model.sides, "Of a model's cylinders")
      ->check(CLI::Range(3, 64))
      ->capture_default_str();
  must_be_within(*command
                      .add_option("--detail", options->model.detail,
                                  "Grid of a model's surface in µm; 0 chooses by the thinnest branch")
                      ->capture_default_str(),
                 0., 1000.);
  command.add_flag("--verbose", options->verbose, "Show every oddity of the files that are read");
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    std::error_code none;
    if (options->out.empty() && (options->files.size() != 2 || fs::is_directory(options->files[0], none)))
      throw CLI::ValidationError(
          "say where the files go: convert A B for two files, or --format NAME --out DIR for many");
    const io::Format* const container = container_of(options->out);
    if (container && !options->format.empty() && options->format != container->name)
      throw CLI::ValidationError(
          fmt::format("--format {} and --out {} say different formats; leave --format out", options->format,
                      options->out.string()));
    if (!options->out.empty() && options->format.empty() && !container)
      throw CLI::ValidationError("say which format the files are to have, with --format NAME");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
