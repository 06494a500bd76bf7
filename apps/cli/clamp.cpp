// SPDX-License-Identifier: Apache-2.0
// brainforest clamp: what compartments did over the whole of a simulation.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/reports/trace.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

constexpr const char* soma = "soma";

struct Options {
  std::filesystem::path file, csv;
  std::vector<std::uint64_t> neurons;
  std::vector<std::string> sections{soma};
  std::vector<float> positions{.5f};
  std::string population;
  bool force = false;
};

/// What is told of a trace.
struct Told {
  float low = NAN, high = NAN;
  double mean = NAN;
  std::size_t highest = 0, numbers = 0;
};

std::uint32_t row_of(const reports::Activity& activity, const Options& options, std::uint64_t node) {
  const auto& names = activity.facts().populations;
  const reports::Row* found = nullptr;
  for (const reports::Row& row : activity.rows()) {
    if (row.node_id != node || (!options.population.empty() && names[row.population] != options.population))
      continue;
    if (found)
      throw Error(fmt::format("node {} is in populations {} and {}; choose with --population", node,
                              names[found->population], names[row.population]));
    found = &row;
  }
  if (!found)
    throw Error(fmt::format("{}: node {}{} was not reported; there are {} neurons, the first of them node {}",
                            options.file.string(), node,
                            options.population.empty() ? "" : " of population " + options.population,
                            activity.rows().size(), activity.rows().front().node_id));
  return std::uint32_t(found - activity.rows().data());
}

reports::Trace find(const reports::Activity& activity, const Options& options, std::uint64_t node,
                    const std::string& name, float position) {
  std::uint32_t section = reports::soma_run;
  if (name != soma) {
    const auto number = number_of<std::uint32_t>(name);
    if (!number)
      throw Error(fmt::format(
          "'{}' is no section; give its number, from 0, as a selection shows it, or 'soma'", name));
    section = *number;
  }
  const std::uint32_t row = row_of(activity, options, node);
  const reports::LayoutView layout = activity.layout(activity.rows()[row].layout);
  const auto compartment = layout.at(section, position);
  if (!compartment) {
    std::uint32_t most = 0;
    std::size_t count = 0;
    for (const reports::SectionRun& run : layout.sections)
      if (run.section != reports::soma_run) most = std::max(most, run.section), ++count;
    throw Error(
        section == reports::soma_run
            ? fmt::format("{}: the soma of node {} was not reported; {} of its sections were",
                          options.file.string(), node, count)
            : fmt::format("{}: section {} of node {} was not reported; {}", options.file.string(), section,
                          node,
                          count ? fmt::format("{} of its sections were, the last of them {}", count, most)
                                : "its soma alone was"));
  }
  return reports::trace(activity, row, *compartment);
}

Told told(const reports::Trace& trace) {
  Told t;
  double sum = 0.;
  for (std::size_t i = 0; i < trace.values.size(); ++i) {
    const float v = trace.values[i];
    if (std::isnan(v)) continue;
    if (!(v >= t.low)) t.low = v;
    if (!(v <= t.high)) t.high = v, t.highest = i;
    sum += double(v), ++t.numbers;
  }
  if (t.numbers) t.mean = sum / double(t.numbers);
  return t;
}

void run(const Options& options, Console& console) {
  const auto activity = reports::Activity::open(options.file);
  const reports::Facts& facts = activity.facts();
  const std::size_t count =
      std::max({options.neurons.size(), options.sections.size(), options.positions.size()});
  const auto nth = [count](const auto& list, std::size_t i, const char* name) {
    if (list.size() != 1 && list.size() != count)
      throw Error(
          fmt::format("{} has {} values and {} traces are asked for; give one for all, or one for each", name,
                      list.size(), count));
    return list[list.size() == 1 ? 0 : i];
  };
  std::vector<reports::Trace> traces;
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < count; ++i)
    traces.push_back(find(activity, options, nth(options.neurons, i, "--neuron"),
                          nth(options.sections, i, "--section"), nth(options.positions, i, "--position")));
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  if (!options.csv.empty()) write_unless_there(options.csv, reports::csv_of(facts, traces), options.force);

  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  for (const reports::Trace& trace : traces) {
    const Told t = told(trace);
    const bool any = t.numbers > 0;
    const double when = any ? facts.time(t.highest) : NAN;
    const auto figure = [&](double value) {  // its last digit says nothing
      return any ? fmt::format("{:.{}f}", value, std::max(1, facts.range.decimals() - 2))
                 : std::string("none");
    };
    list.push_back({{"neuron", trace.node},
                    {"section", trace.section == reports::soma_run ? nlohmann::ordered_json(soma)
                                                                   : nlohmann::ordered_json(trace.section)},
                    {"position", trace.position},
                    {"lowest", t.low},
                    {"highest", t.high},
                    {"highest_at", when},
                    {"mean", t.mean},
                    {"not_numbers", facts.steps - t.numbers}});
    lines.push_back({std::to_string(trace.node), trace.section_name(), fmt::format("{:.3g}", trace.position),
                     figure(double(t.low)), figure(double(t.high)),
                     any ? fmt::format("{:.4g}", when) : std::string("none"), figure(t.mean)});
  }
  // Values beyond the range that the report was packed with are kept as its ends.
  const auto at_end = [&](const reports::Trace& trace) {
    const Told t = told(trace);
    const float step = 2.f * float(facts.range.error());
    return t.numbers > 0 &&
           (t.low <= float(facts.range.low) + step || t.high >= float(facts.range.high) - step);
  };
  if (facts.clamped && std::ranges::any_of(traces, at_end))
    console.warn(fmt::format(
        "{} reach the ends of the range that is kept, {} to {} {}, and may lie beyond; pack the report "
        "with a wider --range",
        traces.size() == 1 ? "these values" : "some of these values", facts.range.low, facts.range.high,
        facts.units));
  console.print({{"file", options.file.string()},
                 {"csv", options.csv.string()},
                 {"units", facts.units},
                 {"error", facts.range.error()},
                 {"steps", facts.steps},
                 {"milliseconds", ms},
                 {"traces", list}});
  const auto in_units = [&](const char* name) { return fmt::format("{} ({})", name, facts.units); };
  console.table(
      {"neuron", "section", "position", in_units("lowest"), in_units("highest"), "at (ms)", in_units("mean")},
      lines);
}

}  // namespace

std::function<void()> clamp(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("activity", options->file, "Activity file")->required();
  must_be_whole(
      *command.add_option("--neuron", options->neurons, "Nodes, as the report numbers them")->required(), 0,
      std::numeric_limits<std::uint64_t>::max());
  command
      .add_option("--section", options->sections,
                  "Their sections, numbered from 0 as the studio's selection shows them; or 'soma'")
      ->type_name("SECTION")
      ->capture_default_str();
  must_be_within(*command
                      .add_option("--position", options->positions,
                                  "Where along the sections, 0 to 1; the nearest compartment is shown")
                      ->capture_default_str(),
                 0., 1.);
  command.add_option("--population", options->population, "Where several have such a node");
  command.add_option("--csv", options->csv, "Write every step into this table");
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
