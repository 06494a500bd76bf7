// SPDX-License-Identifier: Apache-2.0
// brainforest check: what is odd in neuron files, how it is read, what can be done; and mended copies, with a log from
// which the original can be made again byte for byte.
#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/io/difference.h"
#include "forest/io/format.h"
#include "forest/morphology/validate.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using repository::escaped;
using Json = nlohmann::ordered_json;

constexpr std::string_view by_repair = "--repair writes it so";

struct Options {
  std::vector<std::string> files;
  std::string repo;
  fs::path repair;
  bool force = false;
};

/// A row of the table.
struct Found {
  std::size_t line = 0;
  std::string cell, code, what, mend;
  bool note = false;  // to be looked at; many sound neurons have it
};

/// Notes of validate() that are told. The others (bifurcations, changes of kind) are what neurons are like.
constexpr std::array<std::string_view, 6> told_notes{"no-soma",           "zero-length", "far-stem",
                                                     "single-point-stem", "fat-end",     "narrow-start"};

struct Checked {
  fs::path path;
  std::string format, error;
  bool skipped = false;  // it holds no neuron, and lay in a folder
  std::vector<Found> found;
  fs::path mended;
  std::size_t together = 0;  // of so many cells, which are not mended together
  bool can_be_mended() const {
    return std::ranges::any_of(found, [](const Found& f) { return f.mend == by_repair; });
  }
};

/// Of findings of one code the first few are told and the rest counted; what the reader has told with its line is not told
/// again.
void look_at(const io::Cell& cell, Checked& checked) {
  constexpr std::size_t told = 3;
  for (const io::Warning& w : cell.read.warnings)
    checked.found.push_back({w.line, cell.name, std::string(w.code), w.sentence,
                             std::string(w.mending.empty() ? by_repair : w.mending)});
  struct Rest {
    std::size_t count = 0;
    std::string mend;
    bool note = false;
  };
  std::map<std::string_view, Rest> codes;
  for (const Finding& f : validate(cell.read.morphology)) {
    const bool note = f.severity == Severity::note;
    if ((note && !std::ranges::count(told_notes, f.code)) ||
        std::ranges::count(cell.read.warnings, f.code, &io::Warning::code))
      continue;
    const std::size_t half = std::min(f.sentence.find("; "), f.sentence.size());
    Rest& rest = codes[f.code];
    rest.note = note;
    rest.mend = half < f.sentence.size() ? f.sentence.substr(half + 2) : "";
    if (++rest.count > told) continue;
    const std::string place = f.section.valid() ? fmt::format("section {}: ", f.section.value()) : "";
    checked.found.push_back(
        {0, cell.name, std::string(f.code), place + f.sentence.substr(0, half), rest.mend, note});
  }
  for (const auto& [code, rest] : codes)
    if (rest.count > told)
      checked.found.push_back({0, cell.name, std::string(code),
                               fmt::format("the same at {}", counted(rest.count - told, "more place")),
                               rest.mend, rest.note});
}

Json json_of(const Found& f) {
  Json json{{"line", f.line}, {"code", f.code}, {"what", escaped(f.what)}, {"mend", f.mend}};
  if (!f.cell.empty()) json["cell"] = escaped(f.cell);
  if (f.note) json["note"] = true;
  return json;
}

using Put = std::function<void(const fs::path& to, std::string_view bytes)>;

/// The mended copy and its log: `passages` that, one after the other, are the original. A passage is a run of lines of the
/// copy, [first, count] from line 1, or text as the repository's names are escaped (\xHH for bytes that are no UTF-8).
void repair(const io::Format& format, const io::Cell& cell, std::string_view original, const fs::path& to,
            const Put& put, Checked& checked) {
  const io::Format& writer = format.write ? format : *io::find_format("swc");
  fs::path mended = to;
  if (!format.write) mended += writer.extensions[0];  // cell.xml.swc, as there may be a cell.swc
  const std::string copy = writer.write(cell.read.morphology);
  Json passages = Json::array(), findings = Json::array();
  for (const io::Passage& p : io::difference(copy, original))
    passages.push_back(p.count ? Json{p.first + 1, p.count} : Json(escaped(p.text)));
  for (const Found& f : checked.found) findings.push_back(json_of(f));
  const Json log{{"original", escaped(checked.path.string())},
                 {"hash", hash_hex(std::as_bytes(std::span(original)))},
                 {"mended", escaped(mended.filename().string())},
                 {"findings", findings},
                 {"passages", passages}};
  put(mended, copy);
  put(mended.string() + ".log.json", log.dump(1) + "\n");
  checked.mended = mended;
}

void check_file(Checked& checked, const Options& options, const fs::path& to, const Put& put) {
  try {
    const MappedFile file(checked.path);
    const io::Format& format = io::format_of(checked.path, file.text());
    checked.format = format.name;
    const io::CellReader cells = io::read_each(format, file.text(), escaped(checked.path.string()));
    for (std::size_t i = 0; i < cells.count; ++i) look_at(cells.read(i), checked);
    if (to.empty() || !checked.can_be_mended()) return;
    if (cells.count > 1)
      checked.together = cells.count;
    else
      repair(format, cells.read(0), file.text(), to, put, checked);
  } catch (const InputError& error) {
    checked.error = error.what();
    checked.skipped = may_skip(error, checked.path, options.files);
  }
}

void report(const std::vector<Checked>& files, Console& console) {
  Json list = Json::array();
  std::vector<std::vector<std::string>> rows;
  std::size_t sound = 0, noted = 0, odd = 0, failed = 0, skipped = 0, mended = 0, together = 0;
  for (const Checked& file : files) {
    const std::string path = escaped(file.path.string());
    (file.skipped                                    ? skipped
     : !file.error.empty()                           ? failed
     : file.found.empty()                            ? sound
     : std::ranges::all_of(file.found, &Found::note) ? noted
                                                     : odd) += 1;
    mended += !file.mended.empty(), together += file.together > 0;
    Json entry{{"file", path}, {"format", file.format}, {"findings", Json::array()}};
    for (const Found& f : file.found) {
      entry["findings"].push_back(json_of(f));
      rows.push_back({path, f.line ? std::to_string(f.line) : "", f.note ? f.code + " (note)" : f.code,
                      escaped(f.what), f.mend});
    }
    if (!file.error.empty()) {
      entry[file.skipped ? "skipped" : "error"] = file.error;
      rows.push_back({path, "", file.skipped ? "skipped" : "not-read", file.error, ""});
    }
    if (!file.mended.empty()) entry["mended"] = escaped(file.mended.string());
    if (file.together) {
      const std::string why = fmt::format("holds {} cells, which are not mended together", file.together);
      entry["not_mended"] = why;
      rows.push_back({path, "", "not-mended", why, "convert it first, which gives each cell a file"});
    }
    list.push_back(std::move(entry));
  }
  if (!rows.empty())
    console.table({"file", "line", "code", "what, and how it was read", "how to mend it"}, rows);
  console.say(fmt::format("{} without a finding, {} with some{}, {} not read{}{}", counted(sound, "file"),
                          odd, noted ? fmt::format(", {} with notes only", noted) : "", failed,
                          skipped ? fmt::format(", {} skipped", skipped) : "",
                          mended ? fmt::format("; {} mended, each with a log beside it", mended) : "") +
              (together ? fmt::format("; {} of several cells not mended", together) : ""));
  console.print({{"sound", sound},
                 {"noted", noted},
                 {"odd", odd},
                 {"failed", failed},
                 {"skipped", skipped},
                 {"mended", mended},
                 {"not_mended", together},
                 {"files", list}});
  if (failed)
    throw Error(
        fmt::format("{} of {} could not be read; the table says why", failed, counted(files.size(), "file")));
  if (together)
    throw Error(
        fmt::format("{} of {}, of several cells, {} not mended; convert such a file first, which gives "
                    "each cell one of its own",
                    together, counted(files.size(), "file"), together == 1 ? "was" : "were"));
}

void check_repository(const std::string& repo, Console& console) {
  const auto findings =
      repository::Repository::open(repo, repository::Access::read).check(console.progress());
  for (const std::string& finding : findings) console.warn(finding);
  console.print({{"repository", repo}, {"findings", findings}});
  if (!findings.empty())
    throw Error(fmt::format("{}: {}; {} what to do", repo, counted(findings.size(), "finding"),
                            findings.size() == 1 ? "the sentence above says" : "the sentences above say"));
  console.say(fmt::format("{}: all is well", repo));
}

void run(const Options& options, Console& console) {
  if (!options.repo.empty()) check_repository(options.repo, console);
  if (options.files.empty()) return;
  std::vector<Checked> files;
  std::vector<fs::path> to;
  std::map<fs::path, fs::path> taken;
  for (const fs::path& path : neuron_files(options.files, console)) {
    files.emplace_back().path = path;
    to.push_back(options.repair.empty() ? fs::path() : options.repair / path.filename());
    for (int number = 2; !options.repair.empty() && !taken.try_emplace(to.back(), path).second; ++number)
      to.back() =
          options.repair / fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string());
  }
  const auto each = [&](const char* stage, const Put& put) {
    std::vector<Checked> checked = files;
    console.progress().begin(stage, files.size());
    parallel_for(files.size(), 1, [&](std::size_t i) {
      check_file(checked[i], options, to[i], put);
      console.progress().advance();
    });
    console.progress().end();
    return checked;
  };
  if (!options.force && holds_files(options.repair)) {
    Overwrites overwrites;
    each("comparing", [&](const fs::path& path, std::string_view bytes) { overwrites.look(path, bytes); });
    overwrites.refuse();
  }
  report(each("checking",
              [](const fs::path& path, std::string_view bytes) {
                fs::create_directories(path.parent_path());
                write_file(path, bytes);
              }),
         console);
}

}  // namespace

std::function<void()> check(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("files", options->files, "Neuron files, or folders with such files below them")
      ->type_name("FILES");
  command
      .add_option(
          "--repo", options->repo,
          "A repository to look through: its tables, the checksum of every neuron and what follows from it")
      ->type_name("REPO");
  command
      .add_option("--repair", options->repair,
                  "Write a mended copy of every file that deviates from its format into this folder, and "
                  "beside each a "
                  "log from which the original can be made again")
      ->type_name("DIR");
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    if (options->files.empty() && options->repo.empty()) throw CLI::RequiredError("files or --repo");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
