// SPDX-License-Identifier: Apache-2.0
// brainforest judge: the acceptance test of grown neurons.
#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/parallel.h"
#include "forest/fitting/burke.h"
#include "forest/fitting/copying.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"
#include "forest/repository/names.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/protocol.h"

#include "apps/cli/console.h"
#include "apps/cli/estimates.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/judging.h"
#include "apps/cli/options.h"
#include "apps/cli/plots.h"
#include "apps/cli/report.h"
#include "apps/cli/samples.h"
#include "apps/cli/verb.h"

namespace forest::cli {

using namespace statistics;
using Json = nlohmann::ordered_json;

namespace {

const char* word_of(Criterion::Asked asked) {
  return asked == Criterion::Asked::at_most    ? "at most"
         : asked == Criterion::Asked::at_least ? "at least"
                                               : "more than";
}

std::string verdict(const Judgement& j) {
  const auto failed = std::ranges::count(j.criteria, false, &Criterion::pass);
  const std::string cells =
      fmt::format("{}{} grown, {} held-out and {}",
                  j.populations > 1 ? fmt::format("{} populations of ", j.populations) : "", j.compared,
                  j.held_out, counted(j.train, "training cell"));
  if (j.pass)
    return fmt::format(
        "PASS: by {} the grown cells cannot be told from traced ones; a random forest tells them with AUC "
        "{:.3f}, real training cells with {:.3f}.",
        cells, j.auc.structure.value, j.auc.real_control.value);
  return fmt::format(
      "FAIL: {} of {} criteria are not met by {}; a random forest tells grown from held-out cells with AUC "
      "{:.3f}, real training cells with {:.3f}.",
      failed, j.criteria.size(), cells, j.auc.structure.value, j.auc.real_control.value);
}

std::string power_of(const Judgement& j) {
  return fmt::format("{}of {} and {} cells an AUC of {:.2f} would be seen in four of five cases",
                     j.detectable_auc > .7 ? "underpowered: " : "", j.compared, j.held_out, j.detectable_auc);
}

/// Real training cells, changed so that the protocol must see it.
Control changed(std::string name, const Sample& real, std::span<const Group> groups, Console& console,
                const std::function<Morphology(std::size_t)>& change) {
  Sample sample{.name = name, .cells = real.cells, .types = {}, .neurons = {}};
  sample.neurons.resize(real.neurons.size());
  parallel_for(real.neurons.size(), 2, [&](std::size_t i) { sample.neurons[i] = change(i); });
  return {std::move(name), measured(sample, groups, console)};
}

}  // namespace

Judged judge_samples(const Sample& train, const Sample& held_out, std::span<const Sample> grown,
                     const Sample& parametric, const std::string& kind, const ProtocolOptions& options,
                     Console& console, const std::string& slices) {
  const std::vector<Group> groups = groups_of(kind);
  Judged judged{.train = measured(train, groups, console),
                .held_out = measured(held_out, groups, console),
                .grown = {},
                .judgement = {}};
  for (const Sample& population : grown) judged.grown.push_back(measured(population, groups, console));
  std::vector<Control> controls;
  controls.push_back({"burke", measured(parametric, groups, console)});
  controls.push_back(changed("stretched", train, groups, console, [&](std::size_t i) {
    return stretched(train.neurons[i], {1.f, 1.f, 1.2f});
  }));
  controls.push_back(changed("jittered", train, groups, console, [&](std::size_t i) {
    return jittered(train.neurons[i], 10.f, options.seed, i);
  }));
  if (!slices.empty()) {
    set_slices(std::array{&judged.train, &judged.held_out}, slices, console);
    const auto each_its_own = [](FeatureTable& table, const std::string& name) {
      for (std::size_t i = 0; i < table.size(); ++i) table.slices.push_back(fmt::format("{} {}", name, i));
    };
    for (std::size_t k = 0; k < judged.grown.size(); ++k)
      each_its_own(judged.grown[k], fmt::format("grown {}", k));
    for (Control& control : controls)
      if (control.name == "burke")
        each_its_own(control.cells, control.name);
      else
        control.cells.slices = judged.train.slices;
  }
  judged.judgement =
      judge(judged.train, judged.held_out, judged.grown, controls, options, console.progress());
  return judged;
}

Json json_of(const Judgement& j, std::span<const std::uint64_t> seeds) {
  Json controls = Json::object();
  for (const ControlResult& c : j.controls) {
    controls[c.name] = interval_of(c.auc);
    controls[c.name]["rejected"] = c.rejected;
    Json missed = Json::array();
    for (const Criterion& criterion : c.missed) missed.push_back(criterion.name);
    controls[c.name]["by"] = std::move(missed);
  }
  Json criteria = Json::array();
  for (const Criterion& c : j.criteria)
    criteria.push_back({{"name", c.name},
                        {"pass", c.pass},
                        {"value", c.value},
                        {"asked", word_of(c.asked)},
                        {"limit", c.limit},
                        {"reason", c.reason}});
  Json auc{{"structure", interval_of(j.auc.structure)},
           {"diameters", interval_of(j.auc.diameters)},
           {"slopes", interval_of(j.auc.slopes)},
           {"real_control", interval_of(j.auc.real_control)},
           {"real_control_diameters", interval_of(j.auc.real_control_diameters)},
           {"real_control_slopes", interval_of(j.auc.real_control_slopes)},
           {"logistic", interval_of(j.auc.logistic)}};
  for (const Judgement::Alone& a : j.alone)
    auc[a.name] = interval_of(a.grown), auc["real_control_" + a.name] = interval_of(a.real);
  return {
      {"pass", j.pass},
      {"auc", auc},
      {"energy_p", j.energy_p},
      {"mmd_p", j.mmd_p},
      {"ks_rejections", j.ks_rejections.size()},
      {"mvs_max", j.mvs_max},
      {"sholl_inside", j.sholl_inside},
      {"copying",
       {{"neighbour_ratio", j.neighbour_ratio},
        {"longest_run", j.longest_run ? Json(*j.longest_run) : Json()}}},
      {"controls", controls},
      {"seeds", seeds},
      {"mvs",
       {{"median", j.mvs_median}, {"worst", j.mvs_feature}, {"ratio", j.mvs_ratio}, {"limit", j.mvs_limit}}},
      {"ks_features", j.ks_rejections},
      {"cells", {{"train", j.train}, {"held_out", j.held_out}, {"grown", j.grown}, {"compared", j.compared}}},
      {"populations", j.populations},
      {"features", j.features},
      {"detectable_auc", j.detectable_auc},
      {"criteria", criteria}};
}

/// Of which populations the values are; nothing where there is one.
std::string averaged(const Judgement& j) {
  return j.populations > 1
             ? fmt::format("AUCs are means over {} populations, all else their medians. ", j.populations)
             : "";
}

void tell_judgement(const Judgement& j, Console& console) {
  console.say(verdict(j));
  console.say("");
  std::vector<std::vector<std::string>> lines;
  for (const Criterion& c : j.criteria) lines.push_back({c.pass ? "pass" : "FAIL", c.name, c.reason});
  console.table({"", "criterion", "why"}, lines);
  console.say("");
  console.say(averaged(j) + fmt::format("Power: {}. Logistic regression, for comparison: AUC {}.",
                                        power_of(j), with_interval(j.auc.logistic)));
}

std::string report_of(const Judged& judged, const Riddle& riddle, const std::string& title) {
  // The colour of each group of cells, the same in every plot.
  constexpr std::size_t training = 0, grown = 1, held_out = 2, control = 3;
  const Judgement& j = judged.judgement;
  Report report(title, verdict(j));
  report.figures({{"AUC, structure", fmt::format("{:.3f}", j.auc.structure.value)},
                  {"AUC, with diameters", fmt::format("{:.3f}", j.auc.diameters.value)},
                  {"AUC, real control", fmt::format("{:.3f}", j.auc.real_control.value)},
                  {"energy distance, p", fmt::format("{:.3f}", j.energy_p)},
                  {"features rejected", fmt::format("{} of {}", j.ks_rejections.size(), j.features)},
                  {"nearest training cell", fmt::format("{:.2f} ×", j.neighbour_ratio)}});

  report.heading("Told from held-out cells by a random forest");
  std::vector<IntervalRow> rows;
  const auto add = [&](std::string label, const Estimate& e, std::size_t colour, std::string note = {}) {
    rows.push_back(interval_row(std::move(label), e, colour, std::move(note)));
  };
  const auto limit = [&](const std::string& name) {
    return std::ranges::find(j.criteria, name, &Criterion::name)->limit;
  };
  add("grown, structure", j.auc.structure, grown, fmt::format("≤ {:.3f}", limit("auc.structure")));
  add("grown, with diameters", j.auc.diameters, grown, fmt::format("≤ {:.3f}", limit("auc.diameters")));
  add("grown, slopes in the slice", j.auc.slopes, grown, "not asked");
  add("real training cells, structure", j.auc.real_control, training);
  add("real training cells, with diameters", j.auc.real_control_diameters, training);
  add("real training cells, slopes", j.auc.real_control_slopes, training);
  for (const Judgement::Alone& a : j.alone) {
    add("grown, " + a.name + " alone", a.grown, grown,
        fmt::format("within {:.3f} of training cells", limit("auc." + a.name)));
    add("real training cells, " + a.name + " alone", a.real, training);
  }
  for (const ControlResult& c : j.controls)
    add("control: " + c.name, c.auc, control,
        c.rejected ? "rejected by " + counted(c.missed.size(), "criterion", "criteria") : "missed");
  report.plot(interval_plot(rows, {.low = .4,
                                   .high = 1.,
                                   .marks = {.5, .6},
                                   .title = "area under the curve (0.5: guessing; 1: surely told apart)"}),
              "Mean over repeated cross-validations with 95 % intervals of the cells; " + power_of(j) +
                  ". One number alone can also be less than in held-out cells, down to an area of 0. " +
                  averaged(j));

  report.heading("Criteria");
  std::vector<std::vector<std::string>> lines;
  for (const Criterion& c : j.criteria) lines.push_back({c.pass ? "✓" : "✗", c.name, c.reason});
  report.table({"", "criterion", "why"}, lines);

  report.heading("Which is which?");
  report.plot(riddle.drawing, "Held-out and grown neurons, as many of each, in an order of chance.");
  report.folded("The answer", riddle.answer);

  report.heading("Sholl");
  report.plot(curve_plot(std::array<CurveLine, 2>{CurveLine{"held out", j.sholl.mean, j.sholl.lower,
                                                            j.sholl.upper, held_out},
                                                  CurveLine{"grown", j.sholl_grown, {}, {}, grown}},
                         sholl_step, "distance from the soma (µm)", "crossings a cell"),
              "The band holds, in 95 % of the cases, as many other real cells at 95 % of radii.");

  report.heading("Where they differ most");
  const std::array<FeatureTable, 2> two{judged.held_out, judged.grown.front()};
  const FeatureTable all = stacked(two), whole = completed(all);
  std::vector<std::size_t> order;
  std::vector<double> surely;  // how far the interval of Cliff's delta stays from none
  for (std::size_t f = 0; f < whole.features.size(); ++f) {
    const std::span values(whole.values.col(Eigen::Index(f)).data(), whole.size());
    const Estimate delta = cliffs_delta(values.first(two[0].size()), values.subspan(two[0].size()));
    surely.push_back(std::max({0., delta.lower, -delta.upper}));
    if (std::ranges::count(all.features, whole.features[f]))
      order.push_back(f);  // "… is defined" is no measure
  }
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t f) { return surely[f]; });
  std::vector<StripPanel> panels;
  for (const std::size_t f : unlike(whole, order, 9)) {
    const std::array<const FeatureTable*, 3> three{&judged.train, &judged.held_out, &judged.grown.front()};
    panels.push_back(panel_of(whole.features[f], three));
  }
  report.plot(strip_plots(panels, std::array<std::string, 3>{"training", "held out", "grown"},
                          {.colours = {training, held_out, grown}}),
              "The features by which grown and held-out cells are most surely apart (Cliff's delta), none "
              "nearly the same as another; every dot "
              "is a cell" +
                  std::string(judged.grown.size() > 1 ? ", grown ones of the first population." : "."));
  return report.html();
}

namespace {

struct Options {
  std::vector<std::string> train, held_out, grown, parametric;
  std::string model, repo, slices, kind = "dendrite";
  std::filesystem::path features, report;
  std::uint32_t repeats = 50, count = 0, populations = 25;
  std::uint64_t seed = 0;
  bool leave_one_out = false, force = false;
};

/// Of the populations: other ones for every other seed of the judgement.
std::vector<std::uint64_t> seeds_of(const Options& options) {
  std::vector<std::uint64_t> seeds(options.populations);
  std::iota(seeds.begin(), seeds.end(), options.seed * options.populations);
  return seeds;
}

/// A grammar's file or built-in name, or a model of the repository.
lsystem::Grammar model_of(const Options& options) {
  return options.repo.empty() ? find_grammar(options.model) : grammar_of_model(options.repo, options.model);
}

// Of the cells by which a model is judged those that it was fitted to, as it says in its first lines.
std::vector<std::string> known_to(const lsystem::Grammar& grammar, const Sample& judged_by) {
  const std::set<std::string> known = cells_fitted_to(grammar.text);
  std::vector<std::string> cells;
  for (const std::string& cell : judged_by.cells)
    if (known.contains(listed(cell))) cells.push_back(repository::escaped(cell));
  return cells;
}
void warn_of_known(const std::vector<std::string>& known, const Sample& judged_by, Console& console) {
  if (known.empty()) return;
  console.warn(
      fmt::format("the model says that it was fitted to {} of the {} that it is judged by, {} first; fit one "
                  "without them",
                  known.size(), counted(judged_by.cells.size(), "cell"), known.front()));
}

}  // namespace

Sample grown_from(const lsystem::Grammar& grammar, const std::string& name, std::size_t count,
                  std::uint64_t seed, Console& console) {
  Sample sample{.name = name, .cells = {}, .types = {}, .neurons = {}};
  sample.neurons = lsystem::grow_population(grammar, count, seed, console.progress());
  for (std::size_t i = 0; i < count; ++i) sample.cells.push_back(fmt::format("{}-{}-{:05}", name, seed, i));
  return sample;
}

std::optional<std::size_t> longest_run_of(const lsystem::Grammar& grammar, std::size_t count,
                                          std::uint64_t seed) {
  std::optional<std::size_t> longest;
  lsystem::Deriver deriver(grammar);
  for (std::size_t i = 0; i < count; ++i)
    longest = std::max(longest, fitting::longest_run(deriver.derive(seed, i), grammar));
  return longest;
}

namespace {

void leave_out(const Options& options, Console& console) {
  LeftOutTrial trial{.traced = read_sample(options.train, options.repo, console),
                     .fitted_to = 0,
                     .kind = options.kind,
                     .slices = options.slices,
                     .count = options.count ? options.count : 99,
                     .repeats = options.repeats,
                     .seed = options.seed,
                     .features = options.features,
                     .report = options.report,
                     .force = options.force};
  must_have_sections(trial.traced, options.kind);
  warn_of_copies(trial.traced, console);
  std::optional<lsystem::Grammar> model;
  std::optional<Sample> grown;
  if (!options.model.empty()) trial.model = &model.emplace(model_of(options));
  if (!options.grown.empty()) trial.grown = &grown.emplace(read_sample(options.grown, options.repo, console));
  const auto known = model ? known_to(*model, trial.traced) : std::vector<std::string>();
  trial.fitted_to = known.size();
  judge_leaving_out(trial, console);
  warn_of_known(known, trial.traced, console);
}

void run(const Options& options, Console& console) {
  must_take_files({options.features, options.report}, options.force);
  if (options.repo.empty())
    for (const auto* words : {&options.train, &options.held_out, &options.grown})
      must_not_be_cells({options.features, options.report}, *words);
  if (options.held_out.empty()) return leave_out(options, console);
  const Sample train = read_sample(options.train, options.repo, console),
               held_out = read_sample(options.held_out, options.repo, console);
  for (const Sample* sample : {&train, &held_out}) must_have_sections(*sample, options.kind);
  std::vector<Sample> grown;
  std::vector<std::uint64_t> seeds{options.seed};
  Sample parametric;
  std::optional<std::size_t> longest_run;
  std::optional<lsystem::Grammar> model;
  if (options.model.empty()) {
    grown.push_back(read_sample(options.grown, options.repo, console));
  } else {
    const lsystem::Grammar& grammar = model.emplace(model_of(options));
    const std::size_t count = options.count ? options.count : held_out.neurons.size();
    seeds = seeds_of(options);
    for (const std::uint64_t seed : seeds) {
      grown.push_back(grown_from(grammar, grammar.name, count, seed, console));
      longest_run = std::max(longest_run, longest_run_of(grammar, count, seed));
    }
  }
  if (!options.parametric.empty()) {
    parametric = read_sample(options.parametric, options.repo, console);
  } else {  // the control that the protocol must reject, fitted to the same neurons
    const std::string text = fitting::burke_grammar(
        train.neurons, "burke", {.kinds = statistics::kind_set(options.kind), .seed = options.seed});
    parametric =
        grown_from(lsystem::parse(text, "burke"), "burke", held_out.neurons.size(), options.seed, console);
  }
  for (const Sample& population : grown) must_have_sections(population, options.kind);
  const Judged judged =
      judge_samples(train, held_out, grown, parametric, options.kind,
                    {.repeats = options.repeats, .seed = options.seed, .longest_run = longest_run}, console,
                    options.slices);
  for (const Sample* sample : {&train, &held_out}) warn_of_copies(*sample, console);
  warn_of_shared(train, held_out, console);
  const auto known = model ? known_to(*model, held_out) : std::vector<std::string>();
  warn_of_known(known, held_out, console);
  if (options.model.empty())
    for (const Sample* other : {&train, &held_out}) warn_of_shared(grown.front(), *other, console);
  if (options.count > train.neurons.size())
    console.warn(fmt::format("there are {}, and no more neurons are judged of a population",
                             counted(train.neurons.size(), "training cell")));
  auto json = json_of(judged.judgement, seeds);
  json["fitted_to"] = known.size();  // of the cells that it is judged by
  console.print(json);
  tell_judgement(judged.judgement, console);
  std::string features, report;
  if (!options.features.empty()) {
    std::vector<FeatureTable> tables{judged.train, judged.held_out};
    std::vector<std::string> names{"train", "held_out"};
    for (const FeatureTable& population : judged.grown) {
      tables.push_back(population);
      names.push_back(names.size() == 2 ? "grown" : fmt::format("grown {}", names.size() - 1));
    }
    features = features_csv(tables, names);
  }
  if (!options.report.empty())
    report = report_of(judged,
                       which_is_which(held_out.neurons, grown.front().neurons, 6,
                                      statistics::kind_set(options.kind), options.seed),
                       "Grown neurons on trial: " + grown.front().name);
  write_unless_there({{options.features, features}, {options.report, report}}, options.force);
}

}  // namespace

std::function<void()> judge(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  const auto sample = [&](const char* name, std::vector<std::string>& words, const char* help) {
    return command.add_option(name, words, help)->type_name("FILES");
  };
  sample("--train", options->train,
         "Neurons that the model was fitted to: files, folders, populations of --repo")
      ->required();
  CLI::Option* held_out =
      sample("--held-out", options->held_out, "Neurons of the same population that it never saw");
  command
      .add_flag("--leave-one-out", options->leave_one_out,
                "For few cells, and what is done without --held-out: each is left out in turn, set beside "
                "cells of a model "
                "fitted to the others, or beside those of --model or --grown, which saw none of them")
      ->excludes(held_out);
  CLI::Option_group* judged = command.add_option_group("judged", "what is judged");
  judged->add_option("--model", options->model, "A model: a grammar's file, or with --repo its name there");
  judged->add_option("--grown", options->grown, "Neurons that it grew")->type_name("FILES");
  judged->require_option(0, 1);
  add_whole(command, "--count", options->count,
            "Neurons of a population to grow; 0: as many as are held out, or 99 for each that is left out", 0,
            1'000'000);
  add_whole(command, "--populations", options->populations,
            "How many populations the model grows; their median is judged, and mean AUCs", 1, 1000);
  sample("--burke", options->parametric,
         "Neurons of a parametric model, which the protocol must reject; without, one is fitted and grown");
  command.add_option("--repo", options->repo, "Take populations of this repository")->type_name("REPO");
  add_kind(command, options->kind);
  add_slices(command, options->slices);
  add_whole(command, "--repeats", options->repeats, "Cross-validations that an AUC is the mean of", 1, 10000);
  add_seed(command, options->seed, "The same seed gives the same judgement");
  command
      .add_option("--features", options->features,
                  "Write the features of all cells to this file, for other programs")
      ->type_name("FILE");
  add_report(command, options->report);
  add_force(command, options->force);
  command.parse_complete_callback([options, &command] {
    if (!options->held_out.empty() && options->model.empty() && options->grown.empty())
      throw CLI::RequiredError("--model or --grown, beside --held-out");
    if (command.count("--populations") && (options->model.empty() || options->held_out.empty()))
      throw CLI::ValidationError(
          "--populations is how many a --model grows beside --held-out cells; leave it out without these");
    if (command.count("--burke") && options->held_out.empty())
      throw CLI::ValidationError("--burke is judged beside --held-out cells; leave it out without these");
    if (options->count && !options->grown.empty())
      throw CLI::ValidationError("--count is how many neurons a model grows; leave it out with --grown");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
