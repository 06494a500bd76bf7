// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/samples.h"

#include <algorithm>
#include <regex>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/core/pattern.h"
#include "forest/io/format.h"
#include "forest/io/workbook.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/filed_neurons.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

/// "cell7" of "cells/cell7.CNG.swc".
std::string cell_name(const fs::path& file) {
  fs::path name = file.filename();
  if (name.has_extension() && name.stem().has_extension() && name.stem().extension() == ".CNG")
    name = name.stem();
  return name.stem().string();
}

std::string folder_name(const fs::path& path) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

Sample of_files(const std::vector<std::string>& words, Console& console) {
  const FiledNeurons files(neuron_files(words, console));
  struct Read {
    Morphology neuron;
    std::string error;
    bool skipped = false;
  };
  std::vector<Read> read(files.size());
  console.progress().begin("reading", files.size());
  parallel_for(files.size(), 4, [&](std::size_t i) {
    try {
      read[i].neuron = files.read(i);
    } catch (const Error& error) {
      read[i].error = error.what();
      read[i].skipped = may_skip(error, files.file(i), words);
    }
    console.progress().advance();
  });
  console.progress().end();
  if (const std::string guesses = files.guesses(); !guesses.empty()) console.warn(guesses);
  Sample sample;
  sample.name = words.size() == 1 ? folder_name(words[0]) : counted(files.size(), "file");
  const std::vector<std::string> folders = folder_names(files.each());
  std::size_t failed = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!read[i].error.empty()) {
      console.warn(read[i].skipped ? read[i].error + "; skipped" : read[i].error);
      failed += !read[i].skipped;
      continue;
    }
    const std::string cell = files.cell(i);
    sample.cells.push_back(cell.empty() ? cell_name(files.file(i)) : cell);
    sample.types.push_back(folders[i]);
    sample.neurons.push_back(std::move(read[i].neuron));
  }
  if (failed)  // a comparison of some of the cells would look like one of all
    throw Error(fmt::format("{} of {} could not be read; mend {} or leave {} out", failed,
                            counted(files.size(), "neuron"), failed == 1 ? "it" : "them",
                            failed == 1 ? "it" : "them"));
  return sample;
}

Sample of_repository(const std::string& population, const std::string& place, Console& console) {
  using namespace repository;
  const auto rows = pick_neurons(Repository::open(place, Access::read), {}, population);
  Sample sample;
  sample.name = population.empty() ? place : population;
  for (const NeuronRow& row : rows) {
    sample.cells.push_back(population.empty() ? row.population + '/' + row.name : row.name);
    sample.types.push_back(row.type.empty() ? row.population : row.type);
  }
  sample.neurons.resize(rows.size());
  each_neuron(place, rows, "reading", console.progress(),
              [&](std::size_t i, const auto& neuron) { sample.neurons[i] = neuron(); });
  return sample;
}

}  // namespace

namespace {

void must_be_near(const Sample& sample) {
  constexpr float farthest = 1e7f;  // µm: no neurite of any animal is longer
  for (std::size_t i = 0; i < sample.neurons.size(); ++i)
    for (const Point& p : sample.neurons[i].points())
      if (!(p.position().cwiseAbs().maxCoeff() <= farthest))
        throw Error(fmt::format(
            "{} has a point at {:g} {:g} {:g} µm, farther away than any neuron reaches; mend it, or "
            "leave this neuron out",
            repository::escaped(sample.cells[i]), p.x, p.y, p.z));
}

}  // namespace

Sample read_sample(const std::vector<std::string>& words, const std::string& repo, Console& console) {
  Sample sample;
  if (repo.empty()) {
    sample = of_files(words, console);
  } else {
    std::vector<std::string> populations = words.empty() ? std::vector<std::string>{""} : words;
    std::set<std::string> met;
    if (std::erase_if(populations, [&](const std::string& word) { return !met.insert(word).second; }))
      console.warn("a population is named more than once and taken once");
    for (const std::string& word : populations) {
      Sample part = of_repository(word, repo, console);
      sample.name += (sample.name.empty() ? "" : " + ") + part.name;
      std::ranges::move(part.cells, std::back_inserter(sample.cells));
      std::ranges::move(part.types, std::back_inserter(sample.types));
      std::ranges::move(part.neurons, std::back_inserter(sample.neurons));
    }
  }
  if (sample.neurons.empty()) throw Error(fmt::format("{} holds no neuron; name another", sample.name));
  must_be_near(sample);
  return sample;
}

void must_not_be_cells(const std::vector<std::filesystem::path>& written,
                       const std::vector<std::string>& words) {
  std::error_code none;
  const auto is_neuron = [](const std::string& extension) {
    return std::ranges::any_of(io::formats(), [&](const io::Format& f) {
      return std::ranges::find(f.extensions, extension) != f.extensions.end();
    });
  };
  for (const fs::path& file : written)
    for (const std::string& word : words) {
      if (file.empty() || !fs::exists(file, none)) continue;
      const fs::path way = fs::relative(file, word, none);
      const bool within = fs::is_directory(word, none) && !way.empty() && *way.begin() != "..";
      if (fs::equivalent(file, word, none) || (within && is_neuron(extension_of(file))))
        throw Error(fmt::format("{} is a neuron that is read here, so it is not replaced; give another name",
                                repository::escaped(file.string())));
    }
}

void must_have_sections(const Sample& sample, const std::string& kind) {
  const statistics::KindSet kinds = statistics::kind_set(kind);
  const auto has = [&](const Morphology& m) {
    return std::ranges::any_of(m.sections(), [&](const Section& s) { return kinds.contains(s.kind); });
  };
  if (std::ranges::all_of(sample.neurons, [](const Morphology& m) { return m.sections().empty(); }))
    throw Error(fmt::format("none of the {} of {} has a neurite; give neurons with more than a soma",
                            counted(sample.neurons.size(), "neuron"), repository::escaped(sample.name)));
  if (std::ranges::none_of(sample.neurons, has))
    throw Error(fmt::format("none of the {} of {} has a section of kind {}; say another --kind",
                            counted(sample.neurons.size(), "neuron"), repository::escaped(sample.name),
                            kind));
}

namespace {
std::uint64_t sum_of(const Morphology& m) { return hash64(std::as_bytes(m.points())); }
}  // namespace

void warn_of_copies(const Sample& sample, Console& console) {
  std::map<std::uint64_t, std::size_t> first;
  std::size_t copies = 0;
  std::string which;
  for (std::size_t i = 0; i < sample.neurons.size(); ++i)
    if (const auto [at, is_new] = first.emplace(sum_of(sample.neurons[i]), i); !is_new && !copies++)
      which = fmt::format("{} is {}", repository::escaped(sample.cells[i]),
                          repository::escaped(sample.cells[at->second]));
  if (copies)
    console.warn(fmt::format("{} of {} {} there twice, first {}; leave copies out, or they count twice",
                             counted(copies, "cell"), repository::escaped(sample.name),
                             copies == 1 ? "is" : "are", which));
}

void warn_of_shared(const Sample& one, const Sample& other, Console& console) {
  std::set<std::uint64_t> sums;
  for (const Morphology& m : one.neurons) sums.insert(sum_of(m));
  std::size_t shared = 0, first = 0;
  for (std::size_t i = other.neurons.size(); i-- > 0;)
    if (sums.contains(sum_of(other.neurons[i]))) ++shared, first = i;
  if (shared)
    console.warn(fmt::format(
        "{} of {} {} in {}, too, {} first; leave what is in both out of one, or they look too much alike",
        counted(shared, "cell"), repository::escaped(one.name), shared == 1 ? "is" : "are",
        repository::escaped(other.name), repository::escaped(other.cells[first])));
}

statistics::FeatureTable measured(const Sample& sample, std::span<const statistics::Group> groups,
                                  Console& console) {
  std::vector<statistics::Measured> rows(sample.neurons.size());
  console.progress().begin("measuring", rows.size());
  parallel_for(rows.size(), 2, [&](std::size_t i) {
    rows[i] = statistics::measure(sample.neurons[i], groups);
    console.progress().advance();
  });
  console.progress().end();
  return statistics::table_of(sample.cells, groups, rows);
}

std::string features_csv(std::span<const statistics::FeatureTable> tables,
                         std::span<const std::string> groups) {
  io::TableSheet sheet{.name = "features", .columns = {{"cell", ""}, {"group", ""}}, .rows = {}};
  for (const statistics::Feature& f : tables[0].features)
    sheet.columns.push_back({f.name + (f.diameters ? " [diameters]" : ""), f.unit});
  for (std::size_t t = 0; t < tables.size(); ++t)
    for (std::size_t i = 0; i < tables[t].size(); ++i) {
      auto& row = sheet.rows.emplace_back();
      row.emplace_back(tables[t].cells[i]);
      row.emplace_back(groups[t]);
      for (const double x : tables[t].values.row(Eigen::Index(i)))
        row.emplace_back(x);  // NaN becomes an empty cell
    }
  return io::csv_of(sheet);
}

void set_slices(std::span<statistics::FeatureTable* const> tables, const std::string& expression,
                Console& console) {
  const std::regex pattern = linear_pattern(expression);
  std::size_t matched = 0, cells = 0;
  std::string without;
  for (statistics::FeatureTable* table : tables) {
    table->slices.clear();
    for (const std::string& cell : table->cells) {
      std::smatch found;
      const bool any = std::regex_search(cell, found, pattern) && found.length() > 0;
      table->slices.push_back(any ? found.str() : "only " + cell);
      matched += any, ++cells;
      if (!any && without.empty()) without = cell;
    }
  }
  for (const statistics::FeatureTable* table : tables)
    if (matched && table->cells.size() > 1 &&
        std::ranges::count(table->slices, table->slices.front()) == std::ssize(table->slices))
      throw Error(fmt::format(
          "--slices '{}' finds '{}' in the names of all {} cells, such as {}, and what is of one slice "
          "cannot be dealt; give an expression that finds what differs",
          expression, repository::escaped(table->slices.front()), table->cells.size(),
          repository::escaped(table->cells.front())));
  if (!matched && !tables.front()->cells.empty())
    throw Error(fmt::format("--slices '{}' finds nothing in any name, such as {}; give another expression",
                            expression, repository::escaped(tables.front()->cells.front())));
  if (matched && matched < cells)
    console.warn(fmt::format(
        "--slices '{}' finds nothing in {} of {}, such as {}: each of these is a slice of its own",
        expression, cells - matched, counted(cells, "name"), repository::escaped(without)));
}

CLI::Option* add_slices(CLI::App& command, std::string& expression) {
  return command
      .add_option("--slices", expression,
                  "Cells in whose names this regular expression finds the same are sisters, of one slice or "
                  "animal, and "
                  "dealt together")
      ->type_name("REGEX")
      ->check([](const std::string& text) -> std::string {
        try {
          linear_pattern(text);
          return {};
        } catch (const std::regex_error&) {
          return text.size() > longest_pattern
                     ? fmt::format("an expression has at most {} characters", longest_pattern)
                     : fmt::format("{} is no regular expression; an example is '^[A-Z]+[0-9]+'",
                                   repository::shown(text));
        }
      });
}

void must_be_kind(CLI::Option& option) {
  option.check([](const std::string& word) -> std::string {
    try {
      statistics::kind_set(word);
      return {};
    } catch (const Error& error) {
      return error.what();
    }
  });
}

void add_kind(CLI::App& command, std::string& kind) {
  must_be_kind(
      *command.add_option("--kind", kind, "Sections to measure: all, dendrite, axon, basal, apical, …")
           ->type_name("KIND")
           ->capture_default_str());
}

void add_report(CLI::App& command, fs::path& report) {
  command.add_option("--report", report, "Write a report with plots to this HTML file")->type_name("FILE");
}

}  // namespace forest::cli
