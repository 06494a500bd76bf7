// SPDX-License-Identifier: Apache-2.0
// brainforest bench activity: a made-up report of the size of a column, packed, then sought, clamped and played. What is
// decoded is compared with what was packed.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <unistd.h>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/mman.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/sonata_report.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"
#include "forest/reports/activity.h"
#include "forest/reports/synthetic.h"

#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using reports::Activity;
using reports::Code;
using reports::Level;
struct Options {
  std::uint32_t neurons = 10000, compartments = 1500, steps = 128, seeks = 20, shapes = 10;
  std::uint64_t seed = 1;
  fs::path folder = fs::temp_directory_path(), keep, report;
};

template <class Body>
double milliseconds(Body&& body) {
  const auto begin = Clock::now();
  body();
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

circuit::Circuit circuit_of(const Options& options) {
  circuit::Circuit c;
  c.name = "made-up";
  c.layers = {{"tissue", 0.f, 1000.f}};
  c.types = {{"made-up", "made-up", true}};
  for (std::uint32_t i = 0; i < options.shapes; ++i) c.morphologies.push_back(fmt::format("shape-{}", i));
  for (std::uint32_t i = 0; i < options.neurons; ++i)
    c.instances.push_back({.morphology = i % options.shapes});
  return c;
}

/// Takes the file out of the system's cache, as far as it lets go of it.
void forget(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fdatasync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

/// The share of the file that the system has in memory.
double cached(const fs::path& path) {
  const MappedFile file(path);
  const auto bytes = file.bytes();
  const auto page = std::size_t(::sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> pages((bytes.size() + page - 1) / page);
  if (::mincore(const_cast<std::byte*>(bytes.data()), bytes.size(), pages.data()) != 0) return 1.;
  return double(std::ranges::count_if(pages, [](unsigned char p) { return p & 1; })) / double(pages.size());
}

struct Times {
  std::vector<double> ms;

  double median() {
    std::ranges::sort(ms);
    return ms[ms.size() / 2];
  }
  double worst() const { return *std::ranges::max_element(ms); }
  nlohmann::ordered_json json() { return {{"median", median()}, {"worst", worst()}}; }
  std::vector<std::string> row(const std::string& what) {
    return {what, fmt::format("{:.2f}", median()), fmt::format("{:.2f}", worst()), std::to_string(ms.size())};
  }
};

/// Every value of some steps beside what was packed: the largest difference, in the unit of the report.
double worst_error(const Activity& activity, const reports::Report& report, std::uint64_t seed,
                   std::size_t checks) {
  const reports::Range range = activity.facts().range;
  Random random(seed, 1, 21);
  std::vector<float> row(report.columns());
  std::vector<Code> codes(report.columns());
  double worst = 0.;
  for (std::size_t i = 0; i < checks; ++i) {
    const std::size_t step = random.below(std::uint32_t(report.steps));
    report.read(step, 1, 0, report.columns(), row.data());
    activity.values(Level::compartment, step, 0, codes);
    for (const reports::Row& neuron : activity.rows()) {
      const auto layout = activity.layout(neuron.layout);
      const std::uint64_t first = neuron.first[0];
      // The report lists neurons in the same order, their compartments in its own.
      for (std::size_t c = 0; c < layout.compartments.size(); ++c) {
        const float wanted = std::clamp(row[first + layout.compartments[c].column], range.low, range.high);
        worst = std::max(worst, double(std::abs(range.value(codes[first + c]) - wanted)));
      }
    }
  }
  if (!(worst <= double(range.error()) + 1e-4))
    throw Error(fmt::format("values are off by {} and {} is promised: an error of the program", worst,
                            range.error()));
  return worst;
}

void run(const Options& options, Console& console) {
  if (!options.keep.empty()) must_take(options.keep, activity_file);
  if (!options.report.empty()) must_take(options.report, hdf5_file);
  std::string name =
      ((options.keep.empty() ? options.folder : options.keep.parent_path()) / "bench.activity.XXXXXX")
          .string();
  fs::path path = options.keep;
  if (path.empty()) {
    const int file = ::mkstemp(name.data());
    if (file < 0)
      throw Error(options.folder.string() + ": nothing can be written there; name another --folder");
    ::close(file);
    path = name;
  }
  const std::shared_ptr<void> cleaner(nullptr, [&](void*) {
    std::error_code none;
    if (options.keep.empty()) fs::remove(path, none);
  });

  const circuit::Circuit circuit = circuit_of(options);
  std::vector<Morphology> shapes;
  for (const Morphology& m :
       lsystem::grow_population(find_grammar("pyramidal"), options.shapes, options.seed))
    shapes.push_back(centred(m));
  const reports::Report report = reports::synthetic_report(
      circuit, shapes,
      {.compartments = options.compartments, .steps = options.steps, .step = .1, .seed = options.seed});
  const std::uint64_t width = report.columns();
  std::optional<reports::Report> written;  // the same from a file
  double writing = 0.;
  if (!options.report.empty()) {
    writing = milliseconds([&] { io::write_sonata_report(options.report, report, console.progress()); });
    written = io::read_sonata_report(options.report);
  }
  std::vector<float> piece(64 * 16384);
  const double making =
      milliseconds([&] { report.read(0, 64, 0, std::min<std::uint64_t>(width, 16384), piece.data()); });
  const double making_rate =
      64. * double(std::min<std::uint64_t>(width, 16384)) / making * 1000.;  // values/s, one core
  const double packing = milliseconds([&] {
    reports::pack(written ? *written : report, circuit, shapes, reports::nodes_of(circuit), {}, path, {},
                  console.progress());
  });

  const std::uint64_t peak = peak_bytes();  // from here on the file's own pages would count
  Random random(options.seed, 0, 21);
  const auto any_step = [&] { return random.below(options.steps); };
  std::vector<Code> codes(width);
  Times cold_seek, warm_seek, cold_clamp, warm_clamp, opening;
  double still_cached = 0.;
  for (int i = 0; i < 5; ++i) {  // each after the file was let go: opening alone reads its tables back
    forget(path);
    still_cached = std::max(still_cached, cached(path));
    std::optional<Activity> activity;
    opening.ms.push_back(milliseconds([&] { activity.emplace(Activity::open(path)); }));
    cold_seek.ms.push_back(milliseconds([&] { activity->values(Level::compartment, any_step(), 0, codes); }));
  }
  for (int i = 0; i < 5; ++i) {
    forget(path);
    const Activity activity = Activity::open(path);
    cold_clamp.ms.push_back(milliseconds([&] { activity.history(random.below(std::uint32_t(width))); }));
  }

  const Activity activity = Activity::open(path);
  activity.verify();  // reads all of it
  Times coarse_seek;
  std::vector<Code> branches(activity.width(Level::branch));
  for (std::uint32_t i = 0; i < options.seeks; ++i) {
    warm_seek.ms.push_back(milliseconds([&] { activity.values(Level::compartment, any_step(), 0, codes); }));
    coarse_seek.ms.push_back(milliseconds([&] { activity.values(Level::branch, any_step(), 0, branches); }));
    warm_clamp.ms.push_back(milliseconds([&] { activity.history(random.below(std::uint32_t(width))); }));
  }
  // A picture from near: a hundred neurons whole, all others as one value each.
  std::vector<reports::Wanted> wanted;
  std::uint64_t values = 0;
  for (std::uint32_t i = 0; i < activity.rows().size(); ++i) {
    wanted.push_back({i, i % std::max(1u, options.neurons / 100) ? Level::neuron : Level::compartment});
    values += activity.count(i, wanted.back().level);
  }
  std::vector<Code> near(values);
  Times cut;
  for (std::uint32_t i = 0; i < options.seeks; ++i)
    cut.ms.push_back(milliseconds([&] { activity.gather(wanted, 0, any_step(), near); }));
  std::uint64_t played = 0;
  const auto begin = Clock::now();
  double playing = 0.;
  for (; playing < 2.; playing = seconds_since(begin))
    activity.values(Level::compartment, played++ % options.steps, 0, codes);
  const double raster = milliseconds([&] { activity.raster_picture(0, options.steps, 1200, 800); });
  const double error = worst_error(activity, report, options.seed, 4);
  const double total = double(width) * options.steps;
  console.print({{"made_up", true},
                 {"neurons", options.neurons},
                 {"values_per_step", width},
                 {"steps", options.steps},
                 {"bytes", activity.bytes()},
                 {"bytes_per_value", double(activity.bytes()) / total},
                 {"from", written ? "a SONATA report" : "a formula"},
                 {"writing_seconds", writing / 1000.},
                 {"packing_seconds", packing / 1000.},
                 {"packed_values_per_second", total / packing * 1000.},
                 {"made_values_per_second", making_rate},
                 {"open_ms", opening.json()},
                 {"cached_before_cold", still_cached},
                 {"seek_cold_ms", cold_seek.json()},
                 {"seek_ms", warm_seek.json()},
                 {"seek_branches_ms", coarse_seek.json()},
                 {"gather_ms", cut.json()},
                 {"clamp_cold_ms", cold_clamp.json()},
                 {"clamp_ms", warm_clamp.json()},
                 {"raster_ms", raster},
                 {"steps_per_second", double(played) / playing},
                 {"error", error},
                 {"stated_error", activity.facts().range.error()},
                 {"units", activity.facts().units},
                 {"packing_peak_bytes", peak}});
  console.say(fmt::format(
      "Made up: {} neurons, {} values a step, {} steps; {:.1f} MB, {:.2f} bytes a value, packed in {:.1f} s",
      options.neurons, width, options.steps, double(activity.bytes()) / 1e6, double(activity.bytes()) / total,
      packing / 1000.));
  console.table({"what", "median ms", "worst ms", "times"},
                {opening.row("open, not in memory"), cold_seek.row("seek all values, not in memory"),
                 warm_seek.row("seek all values"), coarse_seek.row("seek a value a branch"),
                 cut.row("1 % of neurons whole, others 1 value"), cold_clamp.row("clamp, not in memory"),
                 warm_clamp.row("clamp")});
  console.say(
      fmt::format("{:.1f} steps/s of all values; raster {:.0f} ms; worst error {:.4f} {} of {:.4f}; packing "
                  "took {:.0f} MB of memory; "
                  "{:.1f} % of the file was still in memory when it should not",
                  double(played) / playing, raster, error, activity.facts().units,
                  activity.facts().range.error(), double(peak) / 1e6, 100. * still_cached));
}

}  // namespace

std::function<void()> bench_activity(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_whole(command, "--neurons", options->neurons, "Neurons reported", 1, 1'000'000);
  add_whole(command, "--compartments", options->compartments,
            "Of each neuron; more where it has more sections", 1, 100'000);
  add_whole(command, "--steps", options->steps, "Steps; 1,000 take some 10 GB of disk at the size given", 64,
            1'000'000);
  add_whole(command, "--seeks", options->seeks, "How often each is measured", 1, 100'000);
  command.add_option("--folder", options->folder, "Where the file is made, and removed")
      ->capture_default_str();
  command.add_option(
      "--report", options->report,
      "Also write what is made up as a SONATA report, leave it there, and pack it from there: 60 MB a step");
  command.add_option("--keep", options->keep, "Make this file instead, and leave it");
  add_seed(command, options->seed, "Of the values");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
