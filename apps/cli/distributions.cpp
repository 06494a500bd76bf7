// SPDX-License-Identifier: Apache-2.0
// brainforest distributions: what the branches of a population are drawn from, in the three families of N++.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <utility>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/repository/repository.h"
#include "forest/statistics/segment_families.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/parametric_model.h"
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
  std::string repo, population;
  std::string kind = "dendrite", by = "nothing", criterion = "bic";
  std::uint32_t least = 85, replicates = 99;
  std::uint64_t seed = 0;
  bool keep = false, force = false;
  std::filesystem::path grammar, report;  // to write
  std::string form = "burke";
};

std::string shown(const ParameterEstimate& e) {
  return std::isnan(e.lower)
             ? readable(e.value)
             : fmt::format("{} [{}, {}]", readable(e.value), readable(e.lower), readable(e.upper));
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const ParameterEstimate& e) {
  return {
      {"name", e.name}, {"value", number(e.value)}, {"lower", number(e.lower)}, {"upper", number(e.upper)}};
}

Json json_of(const DistributionFit& f) {
  Json estimates = Json::array(), candidates = Json::array();
  for (const ParameterEstimate& e : f.estimates) estimates.push_back(json_of(e));
  for (const Candidate& c : f.candidates)
    candidates.push_back({{"family", c.name},
                          {"log_likelihood", number(c.log_likelihood)},
                          {"parameters", c.parameters},
                          {"aicc", number(c.aicc)},
                          {"bic", number(c.bic)}});
  return {{"count", f.count},
          {"left_out", f.left_out},
          {"in_atoms", f.in_atoms},
          {"family", f.name},
          {"expression", f.count ? f.distribution.expression() : ""},
          {"step", f.distribution.step},
          {"origin", f.distribution.origin},
          {"downwards", f.distribution.downwards},
          {"estimates", estimates},
          {"kolmogorov", number(f.kolmogorov)},
          {"anderson_darling", number(f.anderson_darling)},
          {"p", number(f.p)},
          {"candidates", candidates}};
}

std::string estimates_of(const DistributionFit& f) {
  std::string text;
  for (const ParameterEstimate& e : f.estimates)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", e.name, shown(e));
  if (f.distribution.step > 0.) text += fmt::format(", in steps of {}", readable(f.distribution.step));
  return text;
}

void print(const SegmentFamilies& f, Given by, Console& console) {
  console.say(fmt::format("{}, {}\n\nsegment nontermination: the chance that a segment forks is {}",
                          counted(f.cells, "cell"), counted(f.sections, "segment"), shown(f.nontermination)));
  for (const auto& table : f.tables) {
    if (by == Given::nothing ? table.given != Given::order : table.given != by) continue;
    std::vector<std::vector<std::string>> lines;
    for (const ChanceBin& b : table.bins)
      lines.push_back({readable(b.upper), std::to_string(b.count), shown(b.chance)});
    const std::string unit(unit_of(table.given));
    console.table({fmt::format("{} up to{}", name_of(table.given), unit.empty() ? "" : " (" + unit + ")"),
                   "segments", "chance to fork"},
                  lines);
  }
  for (const auto family : {Quantity::trajectory, Quantity::rotations, Quantity::calibre}) {
    std::vector<std::vector<std::string>> lines;
    for (const FittedQuantity& q : f.quantities) {
      if (q.family != family || q.fit.count == 0) continue;
      const auto line = [&](std::string name, const DistributionFit& d) {
        lines.push_back({std::move(name), std::string(q.unit), std::to_string(d.count), d.name,
                         readable(d.kolmogorov), readable(d.p), estimates_of(d)});
      };
      line(std::string(q.name), q.fit);
      for (const auto& bin : q.bins)
        line(fmt::format("  {} up to {}", name_of(by), readable(bin.upper)), bin.fit);
    }
    if (lines.empty()) continue;
    console.say(fmt::format("\n{}", name_of(family)));
    console.table({"", "unit", "values", "family", "distance", "p", "parameters"}, lines);
  }
}

Json json_of(const SegmentFamilies& f) {
  Json tables = Json::object(), quantities = Json::array();
  for (const auto& table : f.tables) {
    Json& bins = tables[std::string(name_of(table.given))] = Json::array();
    for (const ChanceBin& b : table.bins)
      bins.push_back({{"up_to", number(b.upper)},
                      {"count", b.count},
                      {"chance", number(b.chance.value)},
                      {"lower", number(b.chance.lower)},
                      {"upper", number(b.chance.upper)}});
  }
  for (const FittedQuantity& q : f.quantities) {
    Json entry{{"name", q.name},
               {"unit", q.unit},
               {"family_of_n_plus_plus", name_of(q.family)},
               {"meaning", q.meaning}};
    entry.update(json_of(q.fit));
    entry["text"] = q.distribution;
    Json& bins = entry["bins"] = Json::array();
    for (const auto& b : q.bins) {
      bins.push_back({{"up_to", number(b.upper)}});
      bins.back().update(json_of(b.fit));
    }
    quantities.push_back(std::move(entry));
  }
  return {{"cells", f.cells},
          {"segments", f.sections},
          {"nontermination", json_of(f.nontermination)},
          {"nontermination_by", tables},
          {"quantities", quantities}};
}

std::string percent(const ParameterEstimate& e) {
  return fmt::format("{:.1f} % ({:.1f}–{:.1f})", 100. * e.value, 100. * e.lower, 100. * e.upper);
}

std::string note_of(const DistributionFit& f) {
  return fmt::format("{}, {}; distance {}{}", f.name, counted(f.count, "value"), readable(f.kolmogorov),
                     std::isnan(f.p) ? "" : fmt::format(", p {}", readable(f.p)));
}

std::string report_of(const SegmentFamilies& f, const SegmentValues& seen, const Sample& sample,
                      const Options& options) {
  const Given by = *given_of(options.by);
  Report report("Distributions of " + sample.name,
                fmt::format("The {} of {} (kind {}) fork with a chance of {}; the others end.",
                            counted(f.sections, "segment"), counted(f.cells, "cell"), options.kind,
                            percent(f.nontermination)));
  report.heading("Segment nontermination");
  report.text("The chance that a segment forks, by what is known at its end, with intervals of 95 %.");
  for (const auto& table : f.tables) {
    std::vector<IntervalRow> rows;
    const std::string unit(unit_of(table.given));
    for (const ChanceBin& b : table.bins)
      rows.push_back({.label = fmt::format("{} up to {}{}{}", name_of(table.given), readable(b.upper),
                                           unit.empty() ? "" : " ", unit),
                      .value = b.chance.value,
                      .lower = b.chance.lower,
                      .upper = b.chance.upper,
                      .note = counted(b.count, "segment")});
    if (!rows.empty())
      report.plot(interval_plot(rows, {.low = 0., .high = 1., .marks = {}, .title = "chance to fork"}),
                  fmt::format("By {}.", name_of(table.given)));
  }
  for (const auto family : {Quantity::trajectory, Quantity::rotations, Quantity::calibre}) {
    std::vector<DensityPanel> panels;
    std::vector<std::vector<std::string>> parameters, candidates, binned;
    for (std::size_t i = 0; i < f.quantities.size(); ++i) {
      const FittedQuantity& q = f.quantities[i];
      if (q.family != family || q.fit.count == 0) continue;
      DensityPanel panel{.title = std::string(q.name),
                         .unit = std::string(q.unit),
                         .note = note_of(q.fit),
                         .values = seen.quantities[i].values,
                         .density = [&d = q.fit.distribution](double x) { return d.density(x); },
                         .step = q.fit.distribution.step,
                         .origin = q.fit.distribution.origin};
      for (const Atom& atom : q.fit.distribution.atoms) panel.atoms.emplace_back(atom.value, atom.weight);
      panels.push_back(std::move(panel));
      bool first = true;
      for (const ParameterEstimate& e : q.fit.estimates)
        parameters.push_back({first ? std::string(q.name) : "", std::exchange(first, false) ? q.fit.name : "",
                              e.name, readable(e.value), readable(e.lower), readable(e.upper)});
      for (const auto& bin : q.bins)
        binned.push_back({&bin == &q.bins.front() ? std::string(q.name) : "", readable(bin.upper),
                          std::to_string(bin.fit.count), bin.fit.name, readable(bin.fit.kolmogorov),
                          readable(bin.fit.p), estimates_of(bin.fit)});
      for (const auto& c : q.fit.candidates)
        candidates.push_back({&c == &q.fit.candidates.front() ? std::string(q.name) : "", c.name,
                              std::to_string(c.parameters), readable(c.log_likelihood), readable(c.aicc),
                              readable(c.bic), &c == &q.fit.candidates.front() ? "✓" : ""});
    }
    if (panels.empty()) continue;
    std::string title(name_of(family));
    title[0] = char(std::toupper(static_cast<unsigned char>(title[0])));
    report.heading(title);
    report.plot(density_plots(panels),
                "Bars: what was measured. Curve: the density of the chosen family. Upright lines: values "
                "that come back "
                "exactly, with their share. The outermost 1 % may lie outside.");
    report.table({"quantity", "family", "parameter", "value", "from", "to"}, parameters);
    if (!binned.empty()) {
      report.text(fmt::format("By {}:", name_of(by)));
      report.table({"quantity", "up to", "values", "family", "distance", "p", "parameters"}, binned);
    }
    report.text("All families that could be fitted, the chosen one first:");
    report.table({"quantity", "family", "parameters", "log likelihood", "AICc", "BIC", "chosen"}, candidates);
  }
  report.text(
      "Intervals are of 95 %. The distance is the largest difference between the distribution functions of "
      "the values "
      "and of what was fitted; p says how often values that really were drawn from it lie as far from it. Of "
      "many "
      "traced values every family is rejected: then look at the distance.");
  return report.html();
}

void run(const Options& options, Console& console) {
  must_take_files({options.grammar, options.report}, true);
  must_not_be_cells({options.grammar, options.report}, options.files);
  const KindSet kinds = kind_set(options.kind);
  const Given by = *given_of(options.by);
  const Sample sample = options.repo.empty() ? read_sample(options.files, "", console)
                                             : read_sample({options.population}, options.repo, console);
  warn_of_copies(sample, console);
  const std::vector<Morphology>& cells = sample.neurons;
  const SegmentFamilies families =
      segment_families(cells,
                       {.kinds = kinds,
                        .given = by,
                        .binning = {.least = options.least},
                        .fit = {.criterion = options.criterion == "bic" ? InformationCriterion::bic
                                                                        : InformationCriterion::aicc,
                                .replicates = options.replicates,
                                .seed = options.seed}},
                       console.progress());
  if (families.sections == 0)
    throw Error(fmt::format("none of the {} has a section of kind {}; say another --kind",
                            counted(cells.size(), "neuron"), options.kind));
  if (!options.grammar.empty()) {
    write_unless_there(options.grammar,
                       parametric_grammar(options.form, cells, sample.name, kinds, options.seed, console),
                       options.force);
  }
  if (!options.report.empty())
    write_unless_there(options.report, report_of(families, segment_values(cells, kinds), sample, options),
                       options.force);
  Json kept = Json::array();
  if (options.keep) {
    repository::Repository repository = repository::Repository::open(options.repo, repository::Access::write);
    auto transaction = repository.begin();
    for (const auto& [name, text] : families.texts()) {
      const std::string full = fmt::format("{}.{}", options.kind, name);
      kept.push_back(
          {{"name", full}, {"version", repository.add_distribution(full, options.population, text)}});
    }
    transaction.commit();
  }
  print(families, by, console);
  if (options.keep)
    console.say(fmt::format(
        "\n{} are kept in {}, of population '{}'; brainforest model show {}.NAME --repo {} prints one",
        counted(kept.size(), "distribution"), options.repo, options.population, options.kind, options.repo));
  if (!options.grammar.empty())
    console.say(fmt::format("\n{} grows such cells: brainforest grow --grammar {} --count 10 --out grown/",
                            options.grammar.string(), options.grammar.string()));
  if (!options.report.empty()) console.say(fmt::format("\nThe report is {}", options.report.string()));
  Json out = json_of(families);
  out["kind"] = options.kind, out["by"] = options.by, out["kept"] = std::move(kept);
  console.print(out);
}

}  // namespace

std::function<void()> distributions(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option* files =
      command.add_option("files", options->files, "Files of neurons, or folders with such files below them")
          ->type_name("FILES");
  CLI::Option* repo = command.add_option("--repo", options->repo, "The neurons of this repository instead")
                          ->excludes(files)
                          ->type_name("REPO");
  CLI::Option* population =
      command.add_option("--population", options->population, "Only those of this population")->needs(repo);
  must_be_kind(*command
                    .add_option("--kind", options->kind,
                                "Sections that are meant: dendrite, all, axon, basal, apical, …")
                    ->type_name("KIND")
                    ->capture_default_str());
  command.add_option("--by", options->by, "Fit in bins of order, path, radius or height")
      ->check(CLI::IsMember({"nothing", "order", "path", "radius", "height"}))
      ->type_name("BY")
      ->capture_default_str();
  add_whole(command, "--least", options->least, "Values a bin, at least", 1, 1'000'000);
  command
      .add_option("--criterion", options->criterion,
                  "What chooses among families: bic, or aicc, which likes more parameters")
      ->check(CLI::IsMember({"bic", "aicc"}))
      ->capture_default_str();
  add_whole(command, "--replicates", options->replicates, "Drawn samples behind each p; 0 for none", 0,
            100'000);
  add_seed(command, options->seed, "The same seed draws the same samples");
  command
      .add_flag("--keep", options->keep,
                "Keep the distributions in the repository, as the next versions of their names")
      ->needs(population);
  CLI::Option* const grammar =
      command
          .add_option("--grammar", options->grammar,
                      "Write a grammar to this file too, whose branches follow their diameters alone")
          ->type_name("FILE");
  command
      .add_option("--form", options->form, "Of that grammar: burke (chances by µm) or hillman (a threshold)")
      ->check(CLI::IsMember(parametric_forms))
      ->needs(grammar)
      ->capture_default_str();
  add_report(command, options->report);
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    if (options->files.empty() && options->repo.empty()) throw CLI::RequiredError("files or --repo");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
