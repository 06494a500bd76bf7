// SPDX-License-Identifier: Apache-2.0
// brainforest classify: types of neurons, found by what they measure.
#include <algorithm>
#include <array>
#include <memory>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/io/workbook.h"
#include "forest/statistics/clusters.h"

#include "apps/cli/console.h"
#include "apps/cli/estimates.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/plots.h"
#include "apps/cli/readable.h"
#include "apps/cli/report.h"
#include "apps/cli/samples.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace statistics;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> files;
  std::string repo, population, kind = "all";
  std::filesystem::path csv, report;
  std::uint32_t types = 0;
  std::uint64_t seed = 0;
  bool force = false;
};

/// Types as they were given, in numbers; none where all cells have the same.
struct Given {
  std::vector<std::string> names;
  std::vector<std::uint32_t> type;
};

Given given_types(const Sample& sample) {
  const std::set<std::string> all(sample.types.begin(), sample.types.end());
  Given given{{all.begin(), all.end()}, {}};
  if (all.size() < 2 || sample.types.size() != sample.cells.size()) return {};
  for (const std::string& t : sample.types)
    given.type.push_back(std::uint32_t(std::distance(all.begin(), all.find(t))));
  return given;
}

std::size_t count_of(const Division& d, std::size_t type) {
  return std::size_t(std::ranges::count(d.type, std::uint32_t(type)));
}

std::string by_what(const std::vector<Trait>& traits, std::size_t most) {
  std::string out;
  for (std::size_t i = 0; i < std::min(most, traits.size()); ++i)
    out += fmt::format("{}{} {} ({} against {}{}{})", i ? ", " : "",
                       traits[i].delta.value > 0. ? "larger" : "smaller", traits[i].feature.name,
                       readable(traits[i].mean_inside), readable(traits[i].mean_outside),
                       traits[i].feature.unit.empty() ? "" : " ", traits[i].feature.unit);
  return out.empty() ? "no single metric" : out;
}

std::string sentence(const Types& t, const Given& given, const Options& options) {
  const Division& d = t.division();
  const std::size_t best = std::ranges::max_element(t.divisions, {}, &Division::silhouette)->types;
  std::string out;
  if (d.types == 1 && options.types)
    out = fmt::format("These {} cells were taken for one type.", d.type.size());
  else if (d.types == 1)
    out = fmt::format(
        "These {} cells are of one type: divided into {}, their silhouette is no higher than that of one "
        "cloud of cells (p = "
        "{:.2g}).",
        d.type.size(), best, t.p);
  else
    out = fmt::format(
        "These {} cells {} {} types, which are {} (silhouette {:.2f}) and found again in four fifths of the "
        "cells with an adjusted Rand index of {:.2f}.",
        d.type.size(), options.types ? "were divided into" : "are of", d.types,
        d.silhouette >= .5    ? "clearly apart"
        : d.silhouette >= .25 ? "apart, with cells between them"
                              : "hardly apart",
        d.silhouette, d.stability);
  if (d.types > 1 && !options.types && d.types == t.divisions.size()) out += " More were not tried.";
  if (!given.type.empty())
    out += fmt::format(" They agree with the {} given types to an adjusted Rand index of {:.2f}.",
                       given.names.size(), adjusted_rand(d.type, given.type));
  return out;
}

Json json_of(const Types& t, const Sample& sample, const Given& given, const Options& options) {
  const Division& d = t.division();
  Json types = Json::array(), cells = Json::array(), divisions = Json::array();
  for (std::size_t k = 0; k < d.types; ++k) {
    Json traits = Json::array();
    for (const Trait& trait : t.traits.empty() ? std::vector<Trait>{} : t.traits[k])
      traits.push_back(
          {{"name", trait.feature.name},
           {"unit", trait.feature.unit},
           {"cliffs_delta",
            {{"value", trait.delta.value}, {"lower", trait.delta.lower}, {"upper", trait.delta.upper}}},
           {"mean", trait.mean_inside},
           {"mean_of_others", trait.mean_outside}});
    types.push_back({{"type", k + 1},
                     {"cells", count_of(d, k)},
                     {"medoid", sample.cells[d.medoids[k]]},
                     {"metrics", traits}});
  }
  for (std::size_t i = 0; i < sample.cells.size(); ++i) {
    cells.push_back({{"cell", sample.cells[i]}, {"type", d.type[i] + 1}});
    if (!given.type.empty()) cells.back()["given"] = sample.types[i];
  }
  for (const Division& other : t.divisions)
    divisions.push_back({{"types", other.types},
                         {"silhouette", other.silhouette},
                         {"by_chance", other.by_chance},
                         {"stability", other.stability}});
  return {{"types", types},
          {"sentence", sentence(t, given, options)},
          {"p", t.p},
          {"adjusted_rand", given.type.empty() ? Json() : Json(adjusted_rand(d.type, given.type))},
          {"divisions", divisions},
          {"seed", options.seed},
          {"cells", cells}};
}

std::string csv_of(const Types& t, const Sample& sample, const Given& given) {
  io::TableSheet sheet{.name = "types", .columns = {{"cell", ""}, {"type", ""}}, .rows = {}};
  if (!given.type.empty()) sheet.columns.push_back({"given", ""});
  for (std::size_t i = 0; i < sample.cells.size(); ++i) {
    auto& row = sheet.rows.emplace_back();
    row.emplace_back(sample.cells[i]);
    row.emplace_back(std::int64_t(t.division().type[i]) + 1);
    if (!given.type.empty()) row.emplace_back(sample.types[i]);
  }
  return io::csv_of(sheet);
}

std::vector<std::vector<std::string>> given_rows(const Types& t, const Given& given) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t g = 0; g < given.names.size(); ++g) {
    auto& row = rows.emplace_back(std::vector{given.names[g]});
    for (std::uint32_t k = 0; k < t.division().types; ++k) {
      std::size_t count = 0;
      for (std::size_t i = 0; i < given.type.size(); ++i)
        count += given.type[i] == g && t.division().type[i] == k;
      row.push_back(std::to_string(count));
    }
  }
  return rows;
}

std::string report_of(const Types& t, const Sample& sample, const FeatureTable& table, const Given& given,
                      const Options& options) {
  const Division& d = t.division();
  std::vector<std::string> names;
  for (std::size_t k = 0; k < d.types; ++k)
    names.push_back(fmt::format("type {} ({} cells)", k + 1, count_of(d, k)));
  Report report("Types of " + sample.name, sentence(t, given, options));
  std::vector<Dot> dots;
  for (std::size_t i = 0; i < sample.cells.size() && t.components.cols() > 1; ++i)
    dots.push_back(
        {.x = t.components(Eigen::Index(i), 0),
         .y = t.components(Eigen::Index(i), 1),
         .colour = d.type[i],
         .name = given.type.empty() ? sample.cells[i] : sample.cells[i] + ", given: " + sample.types[i],
         .ring = std::ranges::count(d.medoids, std::uint32_t(i)) > 0});
  if (!dots.empty())
    report.plot(
        scatter_plot(dots, names,
                     fmt::format("first principal component ({:.0f} % of variance)", 100. * t.shares[0]),
                     fmt::format("second ({:.0f} %)", 100. * t.shares[1])),
        "Every dot is a cell, rings are the most central cell of each type; the pointer shows names.");
  if (!t.traits.empty()) {
    report.heading("What defines them");
    std::vector<IntervalRow> rows;
    std::vector<StripPanel> panels;
    for (std::size_t k = 0; k < t.traits.size(); ++k)
      for (std::size_t i = 0; i < std::min<std::size_t>(t.traits[k].size(), 6); ++i) {
        const Trait& trait = t.traits[k][i];
        rows.push_back(interval_row(trait.feature.name, trait.delta, k, fmt::format("type {}", k + 1)));
        const auto column = std::ranges::find(table.features, trait.feature) - table.features.begin();
        if (i > 2 || panels.size() == 9 || std::size_t(column) == table.features.size() ||
            std::ranges::count(panels, trait.feature.name, &StripPanel::title))
          continue;
        StripPanel panel{.title = trait.feature.name, .unit = trait.feature.unit, .samples = {}};
        panel.samples.resize(d.types);
        for (std::size_t c = 0; c < d.type.size(); ++c)
          panel.samples[d.type[c]].push_back(table.values(Eigen::Index(c), column));
        panels.push_back(std::move(panel));
      }
    report.plot(interval_plot(rows, {.low = -1.,
                                     .high = 1.,
                                     .marks = {0.},
                                     .title = "Cliff's delta: cells of the type against all others",
                                     .left = "smaller in the type",
                                     .right = "larger in the type"}),
                "The metrics that tell each type from the others, none nearly the same as one before it.");
    report.plot(strip_plots(panels, names), "Every dot is a cell.");
  }
  report.heading("How many types?");
  std::vector<std::vector<std::string>> lines;
  for (const Division& other : t.divisions)
    lines.push_back({&other == &d ? "✓" : "", std::to_string(other.types),
                     other.types > 1 ? fmt::format("{:.3f}", other.silhouette) : "-",
                     other.types > 1 ? fmt::format("{:.3f}", other.by_chance) : "-",
                     other.types > 1 ? fmt::format("{:.2f}", other.stability) : "-"});
  report.table({"", "types", "silhouette", "of one cloud, at most", "found again (adjusted Rand)"}, lines);
  report.text(
      options.types
          ? "The number of types was asked for."
          : fmt::format("Chosen: the number with the highest silhouette, if one cloud of cells of the same "
                        "extent hardly ever has as high a one (p = {:.2g}); else one.",
                        t.p));
  if (!given.type.empty()) {
    report.heading("Types that were given");
    names.insert(names.begin(), "given");
    report.table(names, given_rows(t, given));
  }
  return report.html();
}

void run(const Options& options, Console& console) {
  must_take_files({options.csv, options.report}, true);
  must_not_be_cells({options.csv, options.report}, options.files);
  const Sample sample = options.repo.empty() ? read_sample(options.files, {}, console)
                                             : read_sample({options.population}, options.repo, console);
  must_have_sections(sample, options.kind);
  const FeatureTable table = measured(sample, groups_of(options.kind), console);
  const Types t =
      find_types(table,
                 {.types = options.types ? std::optional<std::size_t>(options.types) : std::nullopt,
                  .seed = options.seed},
                 console.progress());
  warn_of_copies(sample, console);
  const Given given = given_types(sample);
  console.print(json_of(t, sample, given, options));
  console.say(sentence(t, given, options));
  for (std::size_t k = 0; k < t.traits.size(); ++k)
    console.say(fmt::format("Type {}: {}, the most central {}; it has {}.", k + 1,
                            counted(count_of(t.division(), k), "cell"), sample.cells[t.division().medoids[k]],
                            by_what(t.traits[k], 3)));
  if (!given.type.empty() && t.division().types > 1) {
    console.say("");
    std::vector<std::string> header{"given"};
    for (std::size_t k = 1; k <= t.division().types; ++k) header.push_back(fmt::format("type {}", k));
    console.table(header, given_rows(t, given));
  }
  write_unless_there(
      {{options.csv, options.csv.empty() ? "" : csv_of(t, sample, given)},
       {options.report, options.report.empty() ? "" : report_of(t, sample, table, given, options)}},
      options.force);
  if (!options.report.empty()) console.say(fmt::format("The report is {}", options.report.string()));
}

}  // namespace

std::function<void()> classify(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option* files =
      command
          .add_option("files", options->files, "Files of neurons, or folders; folders count as given types")
          ->type_name("FILES");
  CLI::Option* repo = command.add_option("--repo", options->repo, "Neurons of this repository instead")
                          ->excludes(files)
                          ->type_name("REPO");
  command.add_option("--population", options->population, "Only those of this population")->needs(repo);
  add_kind(command, options->kind);
  must_be_whole(*command.add_option("--types", options->types, "How many types; found when not said"), 1, 40);
  command.add_option("--csv", options->csv, "Write the type of each neuron to this file")->type_name("FILE");
  add_report(command, options->report);
  add_seed(command, options->seed, "The same seed gives the same types");
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    if (options->files.empty() && options->repo.empty()) throw CLI::RequiredError("files or --repo");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
