// SPDX-License-Identifier: Apache-2.0
// brainforest activity: a simulation's report becomes an activity file.
#include "forest/reports/activity.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/io/sonata.h"
#include "forest/io/sonata_report.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::filesystem::path report, circuit, spikes, out;
  std::string population;
  std::vector<float> range;
};

void run(const Options& options, Console& console) {
  const auto begin = Clock::now();
  must_not_be_read("--out", options.out, {options.report, options.spikes});
  must_take(options.out, activity_file);
  const bool spikes_alone = options.report.empty();
  if (spikes_alone && options.spikes.empty())
    throw Error("there is nothing to pack; name a report, or spikes with --spikes");
  std::vector<reports::Spikes> spikes;
  if (!options.spikes.empty()) spikes = io::read_sonata_spikes(options.spikes, options.population);
  const io::SonataCircuit circuit = io::read_sonata(options.circuit, console.progress());
  const reports::Report report = spikes_alone ? reports::without_values(spikes, circuit.nodes)
                                              : io::read_sonata_report(options.report, options.population);
  reports::PackOptions pack;
  if (!options.range.empty())
    pack.range = {options.range[0], options.range[1]};
  else if (report.units != "mV")
    throw InputError(
        options.report.string(), 0,
        fmt::format("holds values in {}; say from where to where they reach, with --range", report.units));
  reports::pack(report, circuit.circuit, circuit.morphologies, circuit.nodes, spikes, options.out, pack,
                console.progress());

  const auto packed = reports::Activity::open(options.out);
  const reports::Facts& facts = packed.facts();
  const std::uint64_t values = packed.width(reports::Level::compartment);
  if (spikes_alone)
    console.warn("there are spikes alone: they flash on branches that have no values");
  else if (facts.not_numbers)
    console.warn(
        fmt::format("{} of {} values are no numbers; they are kept as such, and drawn without a value",
                    facts.not_numbers, values * facts.steps));
  if (facts.clamped)
    console.warn(
        fmt::format("{} of {} values lie beyond {} to {} {} and became its ends; a wider --range keeps them",
                    facts.clamped, values * facts.steps, facts.range.low, facts.range.high, facts.units));
  if (facts.spikes_left_out)
    console.warn(fmt::format("{} spikes of neurons without a shape were left out", facts.spikes_left_out));
  std::size_t beside = 0;
  const double end = facts.start + facts.step * double(facts.steps);
  for (const reports::Spikes& of : spikes)
    beside += std::size_t(
        std::ranges::count_if(of.times, [&](double time) { return time < facts.start || time > end; }));
  if (beside)
    console.warn(fmt::format(
        "{} of the spikes lie before or behind the values, which run from {:g} to {:g} ms, and never "
        "flash",
        beside, facts.start, end));
  console.print({{"file", options.out.string()},
                 {"neurons", packed.rows().size()},
                 {"neurons_of_circuit", facts.instances},
                 {"compartments", values},
                 {"start", facts.start},
                 {"step", facts.step},
                 {"steps", facts.steps},
                 {"units", facts.units},
                 {"range", {facts.range.low, facts.range.high}},
                 {"error", facts.range.error()},
                 {"clamped", facts.clamped},
                 {"not_numbers", facts.not_numbers},
                 {"spikes", packed.spikes().size()},
                 {"spikes_left_out", facts.spikes_left_out},
                 {"spikes_beside", beside},
                 {"bytes", packed.bytes()},
                 {"seconds", seconds_since(begin)}});
  console.table({"file", "neurons", "compartments", "steps", "of ms", "spikes", "bytes"},
                {{options.out.string(), std::to_string(packed.rows().size()), std::to_string(values),
                  std::to_string(facts.steps), fmt::format("{:g}", facts.step),
                  std::to_string(packed.spikes().size()), std::to_string(packed.bytes())}});
  if (!spikes_alone)
    console.say(fmt::format("\nValues of {:g} to {:g} {} are kept to {:.3g} {}", facts.range.low,
                            facts.range.high, facts.units, facts.range.error(), facts.units));
}

}  // namespace

std::function<void()> activity(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option(
      "report", options->report,
      "A compartment or soma report of SONATA (HDF5); it may be left out where there are spikes");
  command
      .add_option("--circuit", options->circuit,
                  "The circuit that was simulated: its folder, or its configuration file")
      ->required();
  command.add_option("--spikes", options->spikes, "Spikes of the same simulation (SONATA, HDF5)");
  command.add_option("--population", options->population, "Take this population only");
  command
      .add_option("--range", options->range,
                  "From where to where values reach; by default -100 to 50 mV. The wider, the coarser: 1/508 "
                  "of it is lost")
      ->expected(2)
      ->type_name("LOW HIGH");
  command.add_option("-o,--out", options->out, "The activity file")->required();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
