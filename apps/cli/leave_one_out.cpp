// SPDX-License-Identifier: Apache-2.0
// brainforest judge without held-out cells: each traced cell beside cells of a model that never saw it.
#include "forest/statistics/leave_one_out.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/fitting/resampling.h"
#include "forest/lsystem/grammar.h"

#include "apps/cli/console.h"
#include "apps/cli/estimates.h"
#include "apps/cli/files.h"
#include "apps/cli/judging.h"
#include "apps/cli/plots.h"
#include "apps/cli/readable.h"
#include "apps/cli/report.h"

namespace forest::cli {

using namespace statistics;
using Json = nlohmann::ordered_json;

namespace {

/// The others that are no sisters of this one.
std::vector<Morphology> without(const Sample& traced, std::span<const std::string> slices,
                                std::size_t left_out) {
  std::vector<Morphology> others;
  for (std::size_t i = 0; i < traced.neurons.size(); ++i)
    if (i != left_out && (slices.empty() || slices[i] != slices[left_out]))
      others.push_back(traced.neurons[i]);
  return others;
}

Json json_of(const LeaveOneOut& r, const LeftOutTrial& trial, std::optional<std::size_t> longest_run) {
  Json cells = Json::array(), features = Json::array();
  for (const LeftOut& c : r.cells) {
    Json abnormal = Json::array();
    for (const Oddity& o : c.typicality.oddities)
      if (o.abnormal) abnormal.push_back(o.feature.name);
    cells.push_back({{"cell", c.cell},
                     {"p", c.typicality.p},
                     {"p_whole", c.typicality.p_whole},
                     {"p_metric", c.typicality.p_feature},
                     {"p_missing", c.typicality.p_missing},
                     {"auc", {{"structure", c.structure}, {"diameters", c.whole}}},
                     {"abnormal", abnormal}});
  }
  for (const PairedFeature& f : r.features)
    features.push_back(
        {{"name", f.feature.name}, {"auc", f.auc}, {"p", f.p}, {"p_holm", f.p_holm}, {"cells", f.cells}});
  return {
      {"pass", nullptr},  // so few cells cannot
      {"leave_one_out", true},
      {"told_apart", r.told_apart()},
      {"sentence", sentence(r)},
      {"refitted", !trial.model && !trial.grown},
      {"fitted_to", trial.fitted_to},
      {"cells", {{"traced", r.traced}, {"grown_for_each", r.grown}}},
      {"detectable_auc", r.detectable_auc},
      {"strange", {{"cells", r.strange}, {"p", r.strange_p}}},
      {"auc", {{"structure", interval_of(r.structure)}, {"diameters", interval_of(r.whole)}}},
      {"rejections", r.rejections},
      {"copying",
       {{"neighbour_ratio", r.neighbour_ratio}, {"longest_run", longest_run ? Json(*longest_run) : Json()}}},
      {"left_out", cells},
      {"features", features},
      {"seeds", Json::array({trial.seed})}};
}

std::vector<std::vector<std::string>> rows_of_cells(const LeaveOneOut& r) {
  std::vector<std::vector<std::string>> rows;
  for (const LeftOut& c : r.cells) {
    const auto& odd = c.typicality.oddities;
    rows.push_back({c.cell, fmt::format("{:.3f}{}", c.typicality.p, c.typicality.p <= .05 ? " strange" : ""),
                    fmt::format("{:.2f}", c.structure), fmt::format("{:.2f}", c.whole),
                    odd.empty()
                        ? ""
                        : fmt::format("{} {} ({})", odd.front().feature.name, readable(odd.front().value),
                                      readable_range(odd.front().low, odd.front().high))});
  }
  return rows;
}
const std::vector<std::string> head_of_cells{"cell", "p", "AUC, structure", "AUC, with diameters",
                                             "most unusual (grown: 5–95 %)"};

std::vector<std::vector<std::string>> rows_of_features(const LeaveOneOut& r, std::size_t most) {
  std::vector<std::vector<std::string>> rows;
  for (const PairedFeature& f : r.features)
    if (rows.size() < most)
      rows.push_back({f.feature.name, fmt::format("{:.2f}", f.auc), fmt::format("{:.2g}", f.p),
                      fmt::format("{:.2g}", f.p_holm)});
  return rows;
}
const std::vector<std::string> head_of_features{"feature", "grown is larger in", "p", "p after Holm"};

std::string html_of(const LeaveOneOut& r, const FeatureTable& traced, std::span<const FeatureTable> grown) {
  Report report("Few cells, each left out in turn", sentence(r));
  report.figures({{"AUC, structure", fmt::format("{:.2f}", r.structure.value)},
                  {"AUC, with diameters", fmt::format("{:.2f}", r.whole.value)},
                  {"strange cells", fmt::format("{} of {}", r.strange, r.traced)},
                  {"features to one side", fmt::format("{} of {}", r.rejections, r.features.size())},
                  {"nearest cell it saw", fmt::format("{:.2f} ×", r.neighbour_ratio)},
                  {"smallest AUC to be found", fmt::format("{:.2f}", r.detectable_auc)}});
  report.heading("Left-out cells among those grown without them");
  report.table(head_of_cells, rows_of_cells(r));
  report.heading("Features in all pairs");
  const FeatureTable others = stacked(grown);
  std::vector<StripPanel> panels;
  for (const PairedFeature& f : r.features) {
    if (panels.size() == 9) break;
    panels.push_back(panel_of(f.feature, std::array{&traced, &others}));
  }
  report.plot(strip_plots(panels, std::array<std::string, 2>{"traced", "grown"}),
              "The features whose ranks lie most surely to one side; every dot is a cell.");
  report.table(head_of_features, rows_of_features(r, 40));
  return report.html();
}

}  // namespace

void judge_leaving_out(const LeftOutTrial& trial, Console& console) {
  const std::vector<Group> groups = groups_of(trial.kind);
  const Sample& traced = trial.traced;
  statistics::must_be_enough(traced.neurons.size());
  if (trial.grown) warn_of_shared(*trial.grown, traced, console);
  FeatureTable known = measured(traced, groups, console);
  if (!trial.slices.empty()) set_slices(std::array{&known}, trial.slices, console);
  std::vector<FeatureTable> grown;
  std::optional<std::size_t> longest_run;
  for (std::size_t i = 0; i < traced.neurons.size(); ++i) {
    if (i && (trial.grown || trial.model)) {  // the same cells for all
      grown.push_back(grown.front());
      continue;
    }
    if (trial.grown) {
      grown.push_back(measured(*trial.grown, groups, console));
      continue;
    }
    const auto grow = [&](const lsystem::Grammar& grammar) {
      constexpr std::size_t looked_at = 20;  // how long runs are is a matter of the rules, not of the neuron
      longest_run =
          std::max(longest_run, longest_run_of(grammar, std::min(trial.count, looked_at), trial.seed));
      grown.push_back(
          measured(grown_from(grammar, "without " + traced.cells[i], trial.count, trial.seed, console),
                   groups, console));
    };
    if (trial.model)
      grow(*trial.model);
    else
      grow(lsystem::parse(fitting::resampling_grammar(without(traced, known.slices, i), "others",
                                                      {.kinds = kind_set(trial.kind)}),
                          "without " + traced.cells[i]));
  }
  const LeaveOneOut result =
      leave_one_out(known, grown, {.repeats = trial.repeats, .seed = trial.seed}, console.progress());
  console.print(json_of(result, trial, longest_run));
  console.say(sentence(result));
  console.say("");
  console.table(head_of_cells, rows_of_cells(result));
  console.say("");
  console.table(head_of_features, rows_of_features(result, 12));
  std::string features;
  if (!trial.features.empty()) {
    std::vector<FeatureTable> tables{known};
    std::vector<std::string> names{"traced"};
    for (std::size_t i = 0; i < (trial.model || trial.grown ? 1 : grown.size()); ++i) {
      tables.push_back(grown[i]);
      names.push_back("grown without " + (trial.model || trial.grown ? "any" : traced.cells[i]));
    }
    features = features_csv(tables, names);
  }
  write_unless_there(
      {{trial.features, features}, {trial.report, trial.report.empty() ? "" : html_of(result, known, grown)}},
      trial.force);
}

}  // namespace forest::cli
