// SPDX-License-Identifier: Apache-2.0
// brainforest typical: how typical neurons are of a population, and what makes them abnormal.
#include "forest/statistics/typical.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/estimates.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
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
  std::vector<std::string> cells, population;
  std::string repo, kind = "all";
  std::filesystem::path report;
  bool force = false;
};

/// Files are files; other words are neurons of the repository.
Sample cells_of(const Options& options, Console& console) {
  Sample sample;
  std::vector<std::string> files, names;
  std::error_code none;
  for (const std::string& word : options.cells)
    (options.repo.empty() || std::filesystem::exists(word, none) ? files : names).push_back(word);
  if (!files.empty()) sample = read_sample(files, {}, console);
  if (!names.empty()) {
    using namespace repository;
    Repository open = Repository::open(options.repo, Access::read);
    for (const std::string& name : names) {  // of the population, or of another
      const std::string of = options.population.size() == 1 ? options.population[0] : "";
      const NeuronRow row = pick_neurons(open, {name}, open.find(name, of).empty() ? "" : of).front();
      sample.cells.push_back(row.name);
      sample.neurons.push_back(open.morphology(row.id));
    }
    if (sample.name.empty()) sample.name = names.front();
  }
  return sample;
}

/// As a cell's values read: "total_length 4210 µm (5110–9800)".
std::string words_of(const Oddity& o) {
  constexpr std::string_view whether = " is defined";
  if (const std::string_view name = o.feature.name; name.ends_with(whether))
    return fmt::format("{}, which has {} value here and {} of the population",
                       name.substr(0, name.size() - whether.size()), o.value > 0. ? "a" : "no",
                       o.median > .5 ? "one in most" : "none in most");
  return fmt::format("{} {}{}{} ({} in the population)", o.feature.name, readable(o.value),
                     o.feature.unit.empty() ? "" : " ", o.feature.unit, readable_range(o.low, o.high));
}

/// In how many metrics it is beyond all cells, and in how many a cell of the population is.
std::string outside_of(const Typicality& t) {
  const std::string out = fmt::format("Of {} it lies outside the range of all {} cells in {}",
                                      counted(t.metrics, "metric"), t.cells, t.outside);
  return out +
         (t.outside > t.outside_most
              ? fmt::format(
                    ", more than any of these cells does when it is left out (the median is {:g}, the "
                    "most {}).",
                    t.outside_usual, t.outside_most)
              : fmt::format("; these cells, each left out in turn, do so in {:g} (median), and {} of them in "
                            "as many or more.",
                            t.outside_usual, t.as_much_outside));
}

std::string sentence(const std::string& cell, const Typicality& t, const std::string& population) {
  const auto abnormal = std::ranges::count_if(t.oddities, &Oddity::abnormal);
  const bool few = t.least_p() > .05, least = t.p <= 1.001 * t.least_p();
  std::string out =
      few && least
          ? fmt::format(
                "{} is as strange beside {} as so few cells can show: p = {:.3g} is the least that {} cells "
                "give, where 59 could tell: ",
                cell, population, t.p, t.cells)
      : few ? fmt::format(
                  "{}: the {} cells of {} are too few to say whether it is typical (p = {:.3g}; 59 could "
                  "tell): ",
                  cell, t.cells, population, t.p)
            : fmt::format("{} is {} of {} (p = {:.3g}, {} cells): ", cell,
                          t.p <= .05                                ? "not typical"
                          : t.p <= .2 || t.outside > t.outside_most ? "at the edge of what is typical"
                                                                    : "typical",
                          population, t.p, t.cells);
  if (t.oddities.empty()) return out + "nothing can be said of it.";
  if (abnormal == 0)
    out += fmt::format("no {}; the most unusual is ",
                       few ? "single metric can be called abnormal" : "metric is abnormal");
  else
    out += fmt::format("{} abnormal, led by ",
                       abnormal == 1 ? "one metric is" : fmt::format("{} metrics are", abnormal));
  out += words_of(t.oddities.front()) + ".";
  return t.metrics == 0 ? out : out + " " + outside_of(t);
}

const std::vector<std::string> header{"metric", "unit", "value", "median", "5–95 %", "p", ""};

std::vector<std::string> row_of(const Oddity& o) {
  return {o.feature.name,
          o.feature.unit,
          readable(o.value),
          readable(o.median),
          readable_range(o.low, o.high),
          fmt::format("{:.3f}", o.p),
          o.abnormal  ? "abnormal"
          : o.outside ? "outside"
                      : ""};
}

Json json_of(const std::string& cell, const Typicality& t, const std::string& population) {
  Json metrics = Json::array();
  for (const Oddity& o : t.oddities)
    metrics.push_back({{"name", o.feature.name},
                       {"unit", o.feature.unit},
                       {"value", o.value},
                       {"median", o.median},
                       {"low", o.low},
                       {"high", o.high},
                       {"strangeness", o.strangeness},
                       {"p", o.p},
                       {"abnormal", o.abnormal},
                       {"outside", o.outside}});
  return {{"cell", cell},
          {"population", population},
          {"cells", t.cells},
          {"p", t.p},
          {"p_least", t.least_p()},
          {"p_whole", t.p_whole},
          {"p_metric", t.p_feature},
          {"p_missing", t.p_missing},
          {"outside", t.outside},
          {"outside_of", t.metrics},
          {"outside_usual", t.outside_usual},
          {"outside_most", t.outside_most},
          {"outside_as_many", t.as_much_outside},
          {"sentence", sentence(cell, t, population)},
          {"metrics", metrics}};
}

/// The strangest metrics, none nearly the same as one before it.
/// @param cells  the population, and the cell: what is the same in all others may be what sets it apart
std::vector<const Oddity*> telling(const Typicality& t, const FeatureTable& cells, std::size_t count) {
  const FeatureTable full = completed(cells);
  std::vector<std::size_t> order;
  for (const Oddity& o : t.oddities)
    if (const auto at = std::ranges::find(full.features, o.feature); at != full.features.end())
      order.push_back(std::size_t(at - full.features.begin()));
  std::vector<const Oddity*> chosen;
  for (const std::size_t column : unlike(full, order, count))
    chosen.push_back(&*std::ranges::find(t.oddities, full.features[column], &Oddity::feature));
  return chosen;
}

void run(const Options& options, Console& console) {
  must_take_files({options.report}, true);
  must_not_be_cells({options.report}, options.cells);
  if (options.repo.empty()) must_not_be_cells({options.report}, options.population);
  const Sample cells = cells_of(options, console),
               population = read_sample(options.population, options.repo, console);
  for (const Sample* sample : {&cells, &population}) must_have_sections(*sample, options.kind);
  warn_of_copies(population, console);
  const std::vector<Group> groups = groups_of(options.kind);
  const FeatureTable known = measured(population, groups, console), asked = measured(cells, groups, console);
  std::vector<Typicality> answers;
  for (std::size_t i = 0; i < asked.size(); ++i)
    answers.push_back(typicality(known, rows_of(asked, std::array<std::size_t, 1>{i})));

  Json out = Json::array();
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Typicality& t = answers[i];
    out.push_back(json_of(cells.cells[i], t, population.name));
    console.say(sentence(cells.cells[i], t, population.name));
    if (answers.size() > 1) continue;
    console.say("");
    std::vector<std::vector<std::string>> lines;
    for (const Oddity* o : telling(t, stacked(std::array{known, asked}), 12)) lines.push_back(row_of(*o));
    console.table(header, lines);
  }
  console.print(out.size() == 1 ? out[0] : out);

  if (options.report.empty()) return;
  std::string answer;
  for (std::size_t i = 0; i < answers.size(); ++i)
    answer += (i ? " " : "") + sentence(cells.cells[i], answers[i], population.name);
  Report report(fmt::format("How typical of {}?", population.name), answer);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Typicality& t = answers[i];
    report.heading(cells.cells[i]);
    report.figures({{"p", fmt::format("{:.3f}", t.p)},
                    {"p of the whole", fmt::format("{:.3f}", t.p_whole)},
                    {"p of the strangest metric", fmt::format("{:.3f}", t.p_feature)},
                    {"metrics that are abnormal",
                     fmt::format("{}", std::ranges::count_if(t.oddities, &Oddity::abnormal))},
                    {"metrics outside all cells", fmt::format("{} of {}", t.outside, t.metrics)},
                    {"usual for cells of the population",
                     fmt::format("{:g}, at most {}", t.outside_usual, t.outside_most)},
                    {"cells it stands beside", fmt::format("{}", t.cells)}});
    std::vector<StripPanel> panels;
    std::vector<std::vector<std::string>> lines;
    const FeatureTable both = stacked(std::array{known, rows_of(asked, std::array<std::size_t, 1>{i})});
    for (const Oddity* o : telling(t, both, 40)) {
      if (panels.size() < 12 && std::ranges::count(known.features, o->feature)) {
        panels.push_back(panel_of(o->feature, std::array{&known}));
        panels.back().marked = o->value;
      }
      lines.push_back(row_of(*o));
    }
    report.plot(
        strip_plots(panels, std::array<std::string, 1>{population.name}, {.marked = cells.cells[i]}),
        fmt::format("The strangest of {}, none nearly the same as another: among so many every cell stands "
                    "aside in some. Every dot is a cell of the population, the arrow is {}.",
                    counted(t.metrics, "metric"), cells.cells[i]));
    report.table(header, lines);
  }
  write_unless_there(options.report, report.html(), options.force);
  console.say(fmt::format("The report is {}", options.report.string()));
}

}  // namespace

std::function<void()> typical(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("cells", options->cells, "Files of neurons, or with --repo their names")
      ->required()
      ->type_name("CELLS");
  command
      .add_option("--population", options->population,
                  "Files or folders of neurons, or a population of --repo")
      ->required()
      ->type_name("FILES");
  command.add_option("--repo", options->repo, "The repository that holds the population")->type_name("REPO");
  add_kind(command, options->kind);
  add_report(command, options->report);
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
