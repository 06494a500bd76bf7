// SPDX-License-Identifier: Apache-2.0
// brainforest compare: can two populations be told apart, by what, how surely?
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/repository/names.h"
#include "forest/statistics/comparison.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/persistence_image.h"
#include "forest/statistics/projection.h"

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
  std::vector<std::string> samples;
  std::string repo, population, with, slices, kind = "all";
  std::filesystem::path csv, report;
  std::uint32_t repeats = 50, permutations = 199;
  std::uint64_t seed = 0;
  bool force = false;
};

Json json_of(const Discrimination& d) {
  Json out = interval_of(d.auc);
  if (!d.null.empty()) out["p"] = d.p;
  return out;
}

Json json_of(const Comparison& c, const std::array<std::string, 2>& names, const Options& options) {
  Json metrics = Json::array();
  for (const Difference& d : c.differences) {
    const auto told = [&](const Json& value) { return d.compared() ? value : Json(); };
    metrics.push_back({{"name", d.feature.name},
                       {"unit", d.feature.unit},
                       {"diameters", d.feature.diameters},
                       {"tracing", d.feature.tracing},
                       {"a", {{"mean", d.mean_a}, {"sd", d.sd_a}}},
                       {"b", {{"mean", d.mean_b}, {"sd", d.sd_b}}},
                       {"cliffs_delta", told(interval_of(d.delta))},
                       {"cohens_d", told(d.cohens_d)},
                       {"ks", told(d.ks.statistic)},
                       {"p", told(d.ks.p)},
                       {"p_holm", told(d.p_holm)},
                       {"mvs", told(d.mvs)},
                       {"importance", d.importance}});
  }
  return {{"a", {{"name", names[0]}, {"cells", c.cells_a}}},
          {"b", {{"name", names[1]}, {"cells", c.cells_b}}},
          {"kind", options.kind},
          {"told_apart", c.told_apart()},
          {"p", c.p},
          {"sentence", sentence(c, names[0], names[1])},
          {"random_forest", json_of(c.forest)},
          {"random_forest_structure", json_of(c.structure)},
          {"random_forest_branching", json_of(c.branching)},
          {"logistic", json_of(c.logistic)},
          {"energy", {{"distance", c.energy.distance}, {"p", c.energy.p}}},
          {"mmd", {{"distance", c.mmd.distance}, {"p", c.mmd.p}}},
          {"barcode", {{"distance", c.barcodes.distance}, {"p", c.barcodes.p}}},
          {"sholl_inside", c.sholl_inside},
          {"power", {{"auc", c.detectable_auc}, {"cohens_d", c.detectable_effect}}},
          {"seed", options.seed},
          {"metrics", metrics}};
}

std::string shown_p(double p) { return p < 1e-4 ? fmt::format("{:.0e}", p) : fmt::format("{:.4f}", p); }

std::string named(const Feature& f) { return f.unit.empty() ? f.name : f.name + " (" + f.unit + ")"; }

std::vector<std::string> row_of(const Difference& d) {
  return {named(d.feature),
          fmt::format("{} ± {}", readable(d.mean_a), readable(d.sd_a)),
          fmt::format("{} ± {}", readable(d.mean_b), readable(d.sd_b)),
          d.compared() ? fmt::format("{:.2f}", d.delta.value) : "-",
          d.compared() ? shown_p(d.p_holm) : "-",
          d.compared() ? fmt::format("{:.2f}", d.mvs) : "-"};
}

std::vector<std::string> header_of(const std::array<std::string, 2>& names) {
  return {"feature", names[0], names[1], "delta", "p (Holm)", "MVS"};
}

/// The most telling features, none nearly the same as one before it.
std::vector<const Difference*> telling(const Comparison& c, const FeatureTable& whole, std::size_t count) {
  std::vector<std::size_t> order;
  for (const Difference& d : c.differences)
    order.push_back(std::size_t(std::ranges::find(whole.features, d.feature) - whole.features.begin()));
  std::vector<const Difference*> chosen;
  for (const std::size_t column : unlike(whole, order, count))
    chosen.push_back(&*std::ranges::find(c.differences, whole.features[column], &Difference::feature));
  return chosen;
}

std::vector<std::vector<std::string>> rows_of_tests(const Comparison& c) {
  return {{"random forest, all features", with_interval(c.forest.auc), shown_p(c.forest.p)},
          {"random forest, structure", with_interval(c.structure.auc), "-"},
          {"random forest, branching alone", with_interval(c.branching.auc), "-"},
          {"logistic regression, all features", with_interval(c.logistic.auc), shown_p(c.logistic.p)},
          {"energy distance", readable(c.energy.distance), shown_p(c.energy.p)},
          {"maximum mean discrepancy", readable(c.mmd.distance), shown_p(c.mmd.p)},
          {"persistence images", readable(c.barcodes.distance), shown_p(c.barcodes.p)},
          {"Sholl inside the band", fmt::format("{:.0f} % of radii", 100. * c.sholl_inside), "-"}};
}

std::string report_of(const Comparison& c, const std::array<FeatureTable, 2>& tables,
                      const std::array<std::string, 2>& names, const Options& options) {
  const FeatureTable all = stacked(tables), whole = completed(all);
  Report report(fmt::format("{} and {}", names[0], names[1]), sentence(c, names[0], names[1]));
  const auto differ =
      std::ranges::count_if(c.differences, [](const Difference& d) { return d.p_holm <= .05; });
  report.figures({{"cells of " + names[0], fmt::format("{}", c.cells_a)},
                  {"cells of " + names[1], fmt::format("{}", c.cells_b)},
                  {"AUC, random forest", fmt::format("{:.3f}", c.forest.auc.value)},
                  {"AUC, structure alone", fmt::format("{:.3f}", c.structure.auc.value)},
                  {"energy distance, p", shown_p(c.energy.p)},
                  {"features that differ", fmt::format("{} of {}", differ, c.compared())}});

  report.heading("Can they be told apart?");
  report.plot(
      chance_plot(c.forest.null, c.forest.auc.value, c.forest.auc.lower, c.forest.auc.upper,
                  "area under the curve of a random forest, cross-validated"),
      fmt::format(
          "What was found, with its 95 % interval, beside what the same classifier reaches where the cells "
          "are dealt to the two populations at random. Of these numbers of cells an area of {:.2f} would "
          "be seen in four of five cases.",
          c.detectable_auc));
  report.table({"test", "result", "p"}, rows_of_tests(c));

  report.heading("By what?");
  std::vector<IntervalRow> rows;
  for (const Difference* d : telling(c, whole, 24)) {
    rows.push_back(
        interval_row(d->feature.name, d->delta, d->delta.value > 0. ? 1 : 0, "p " + shown_p(d->p_holm)));
    rows.back().faint = d->p_holm > .05;
  }
  report.plot(interval_plot(rows, {.low = -1.,
                                   .high = 1.,
                                   .marks = {0.},
                                   .title = "Cliff's delta: chance of larger minus chance of smaller",
                                   .left = "larger in " + names[0],
                                   .right = "larger in " + names[1]}),
              "The features that differ most, none of which follows closely from another, with 95 % "
              "intervals. Faint: no "
              "difference after Holm's correction over all features.");
  std::vector<StripPanel> panels;
  for (const Difference* d : telling(c, whole, 24)) {
    if (panels.size() < 9 && std::ranges::count(all.features, d->feature))  // "… is defined" is no measure
      panels.push_back(panel_of(d->feature, std::array{&tables[0], &tables[1]}));
  }
  report.plot(strip_plots(panels, names),
              "Every dot is a cell; density above, median and quartiles on the line.");

  report.heading("Sholl");
  report.plot(
      curve_plot(std::array<CurveLine, 2>{CurveLine{names[0], c.sholl.mean, c.sholl.lower, c.sholl.upper, 0},
                                          CurveLine{names[1], c.sholl_b, {}, {}, 1}},
                 sholl_step, "distance from the soma (µm)", "crossings a cell"),
      fmt::format(
          "Mean crossings of spheres. The band holds, in 95 % of the cases, the mean of {} cells of the same "
          "population at 95 % of radii.",
          c.cells_b));

  report.heading("Barcodes");
  const PersistenceImages images = persistence_images(all.bars);
  const Eigen::VectorXd first = images.images.topRows(Eigen::Index(tables[0].size())).colwise().mean(),
                        second = images.images.bottomRows(Eigen::Index(tables[1].size())).colwise().mean();
  const auto heat = [](std::string title, const Eigen::VectorXd& values, std::size_t colour,
                       bool difference) {
    return HeatPanel{std::move(title), {values.begin(), values.end()}, colour, difference};
  };
  if (images.reach > 0.)
    report.plot(
        heat_plots(std::array<HeatPanel, 3>{heat(names[0], first, 0, false), heat(names[1], second, 1, false),
                                            heat("more in either", second - first, 0, true)},
                   std::size_t(images.side), images.reach, "distance of the tip (µm)",
                   "where its branch begins (µm)"),
        fmt::format(
            "Mean persistence images: every branch by how far from the soma its tip is and where it leaves a "
            "longer one, in percent of its population's branches a pixel (the square root decides the shade; "
            "both have "
            "one scale). What lies beyond the axes counts at their ends. They share {:.0f} % (p = {}).",
            100. * (1. - c.barcodes.distance), shown_p(c.barcodes.p)));

  report.heading("The cells");
  const Projection plane = principal_components(standardised(whole), 1., 2);
  std::vector<Dot> dots;
  for (Eigen::Index i = 0; plane.scores.cols() == 2 && i < plane.scores.rows(); ++i)
    dots.push_back({.x = plane.scores(i, 0),
                    .y = plane.scores(i, 1),
                    .colour = std::size_t(i) >= tables[0].size(),
                    .name = whole.cells[std::size_t(i)]});
  if (!dots.empty())
    report.plot(
        scatter_plot(dots, names,
                     fmt::format("first principal component ({:.0f} % of variance)", 100. * plane.shares[0]),
                     fmt::format("second ({:.0f} %)", 100. * plane.shares[1])),
        "All features in two dimensions; the pointer shows names.");

  report.heading("All features");
  std::vector<std::vector<std::string>> lines;
  for (const Difference& d : c.differences) lines.push_back(row_of(d));
  report.table(header_of(names), lines);
  report.text(fmt::format(
      "Sections measured: {}. Seed {}. delta: Cliff's; p: Kolmogorov–Smirnov after Holm's correction; "
      "MVS: median visible spread.",
      options.kind, options.seed));
  return report.html();
}

void run(const Options& options, Console& console) {
  must_take_files({options.csv, options.report}, true);
  if (options.repo.empty()) must_not_be_cells({options.csv, options.report}, options.samples);
  const bool stored = !options.repo.empty();
  const std::array<Sample, 2> samples{
      read_sample({stored ? options.population : options.samples[0]}, options.repo, console),
      read_sample({stored ? options.with : options.samples[1]}, options.repo, console)};
  constexpr std::size_t fewest = 4;  // as cross-validation needs (statistics/discriminator.h)
  for (const Sample& sample : samples) {
    must_have_sections(sample, options.kind);
    if (sample.neurons.size() < fewest)
      throw Error(
          fmt::format("{} has {}, and a population of fewer than four cannot be told from another; add cells",
                      repository::escaped(sample.name), counted(sample.neurons.size(), "cell")));
  }
  const std::vector<Group> groups = groups_of(options.kind);
  std::array<FeatureTable, 2> tables{measured(samples[0], groups, console),
                                     measured(samples[1], groups, console)};
  if (!options.slices.empty()) set_slices(std::array{&tables[0], &tables[1]}, options.slices, console);
  std::array<std::string, 2> names{samples[0].name, samples[1].name};
  if (names[0] == names[1] && !stored) names = {options.samples[0], options.samples[1]};
  if (names[0] == names[1]) names[1] += " (again)";  // tables and plots tell them apart by their names

  const Comparison c =
      compare(tables[0], tables[1],
              {.repeats = options.repeats, .permutations = options.permutations, .seed = options.seed},
              console.progress());
  for (const Sample& sample : samples) warn_of_copies(sample, console);
  warn_of_shared(samples[0], samples[1], console);
  console.print(json_of(c, names, options));
  console.say(sentence(c, names[0], names[1]));
  console.say("");
  console.table({"test", "result", "p"}, rows_of_tests(c));
  console.say("");
  std::vector<std::vector<std::string>> lines;
  for (const Difference* d : telling(c, completed(stacked(tables)), 12)) lines.push_back(row_of(*d));
  console.table(header_of(names), lines);
  write_unless_there({{options.csv, options.csv.empty() ? "" : features_csv(tables, names)},
                      {options.report, options.report.empty() ? "" : report_of(c, tables, names, options)}},
                     options.force);
  if (!options.report.empty()) console.say(fmt::format("The report is {}", options.report.string()));
}

}  // namespace

std::function<void()> compare(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option* samples = command.add_option("samples", options->samples, "Two folders of neurons")
                             ->expected(2)
                             ->type_name("A B");
  CLI::Option* repo =
      command.add_option("--repo", options->repo, "Compare populations of this repository instead")
          ->excludes(samples)
          ->type_name("REPO");
  command.add_option("--population", options->population, "One of them")->needs(repo);
  command.add_option("--with", options->with, "The other")->needs(repo)->type_name("POPULATION");
  add_kind(command, options->kind);
  add_slices(command, options->slices);
  add_whole(command, "--repeats", options->repeats, "Cross-validations that an AUC is the mean of", 1, 10000);
  add_whole(command, "--permutations", options->permutations, "Dealings by which chance is known", 19,
            100000);
  add_seed(command, options->seed, "The same seed gives the same result");
  command.add_option("--csv", options->csv, "Write the features of all cells to this file")
      ->type_name("FILE");
  add_report(command, options->report);
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    if (options->repo.empty() && options->samples.size() != 2)
      throw CLI::RequiredError("two folders A and B, or --repo");
    if (!options->repo.empty() && (options->population.empty() || options->with.empty()))
      throw CLI::RequiredError("--population and --with");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
