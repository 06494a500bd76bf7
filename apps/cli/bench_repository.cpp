// SPDX-License-Identifier: Apache-2.0
// brainforest bench repository: neurons in memory into a repository and back. What is read is compared with what was stored.
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <thread>
#include <unistd.h>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/repository/repository.h"
#include "forest/repository/stored_metrics.h"
#include "forest/statistics/metric.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace repository;
struct Options {
  std::uint32_t neurons = 4000, sections = 300, points = 6;
  std::filesystem::path folder = std::filesystem::temp_directory_path();
};

/// Five binary trees of sections of `points` points each, as a grown cell has them.
Morphology synthetic_neuron(const Options& options, std::uint64_t index) {
  Random random(1, index, 10);
  MorphologyBuilder builder;
  builder.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 8}}, .parents = {}, .contour_starts = {}});
  std::vector<Point> ends;
  for (std::uint32_t i = 0; i < options.sections; ++i) {
    const std::uint32_t parent = i < 5 ? 0 : (i - 5) / 2;
    Point at = i < 5 ? Point{0, 0, 0, 2} : ends[parent];
    std::vector<Point> points;
    for (std::uint32_t p = 0; p < options.points; ++p) {
      points.push_back(at);
      at = {at.x + float(random.normal()), at.y + float(random.normal()), at.z + float(random.normal()),
            at.radius * .99f};
    }
    builder.add_section(i < 5 ? SectionId() : SectionId(parent), SectionKind::basal, points);
    ends.push_back(points.back());
  }
  return builder.build();
}

template <class Body>
double seconds(Body&& body) {
  const auto begin = Clock::now();
  body();
  return seconds_since(begin);
}

/// Reads neuron after neuron for as long as it lives, as another program would while this one stores.
class Reader {
 public:
  Reader(const std::string& place, const std::vector<Morphology>& cells)
      : thread_([this, place, &cells] { read(place, cells); }) {}
  ~Reader() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void check() const {
    if (!error_.empty()) throw Error("a neuron could not be read while others were stored: " + error_);
  }
  std::size_t neurons() const { return neurons_; }
  double longest_wait() const { return longest_wait_; }  // s

 private:
  void read(const std::string& place, const std::vector<Morphology>& cells) try {
    const Repository repository = Repository::open(place, Access::read);
    for (std::uint32_t last = 1; !stop_;) {
      longest_wait_ = std::max(longest_wait_, seconds([&] {
                                 const auto row = repository.neuron(NeuronId(last));
                                 if (!row) {
                                   last = 1;
                                   return;
                                 }
                                 if (repository.morphology(row->id) !=
                                     cells[std::get<Grown>(row->provenance).index % cells.size()])
                                   throw Error("it is not the one that was stored");
                                 ++neurons_;
                                 last += 97;
                               }));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));  // as a person, not as a load
    }
  } catch (const std::exception& error) {
    error_ = error.what();
  }

  std::atomic<bool> stop_ = false;
  std::size_t neurons_ = 0;
  double longest_wait_ = 0.;
  std::string error_;
  std::thread thread_;  // after what it uses
};

void run(const Options& options, Console& console) {
  std::vector<Morphology> cells;  // distinct ones; they are stored again and again under other indices
  for (std::uint64_t i = 0; i < 64; ++i) cells.push_back(synthetic_neuron(options, i));
  const auto path = options.folder / fmt::format("bench-{}.db", ::getpid());
  struct Remove {
    std::filesystem::path path;
    ~Remove() { std::filesystem::remove(path); }
  } const remove{path};

  Repository repository = Repository::open(path.string(), Access::write);
  const std::string hash = repository.add_grammar("bench", "bench");
  const auto called = [&](std::uint64_t seed, std::uint64_t i) {
    return NewNeuron{.name = fmt::format("{}-{}", seed, i), .provenance = Grown{"bench", hash, seed, i}};
  };
  const auto add = [&](std::uint64_t seed, std::uint64_t i) {
    repository.add(cells[i % cells.size()], called(seed, i));
  };
  const std::uint32_t some = std::min(options.neurons, 4000u), alone = some / 10;

  Reader reader(path.string(), cells);
  const double parallel = seconds([&] {  // as grow does: made ready on all cores, some at a time
    std::optional<Repository::Transaction> transaction;
    parallel_in_order(
        options.neurons, [&](std::size_t i) { return Prepared(cells[i % cells.size()]); },
        [&](std::size_t i, Prepared&& ready) {
          if (!transaction) transaction.emplace(repository.begin());
          repository.add(std::move(ready), called(1, i));
          if (i % 500 == 499 || i + 1 == options.neurons) transaction->commit(), transaction.reset();
        });
  });
  reader.stop();
  reader.check();
  const double batch = seconds([&] {
    auto transaction = repository.begin();
    for (std::uint64_t i = 0; i < some; ++i) add(2, i);
    transaction.commit();
  });
  const double single = seconds([&] {
    for (std::uint64_t i = 0; i < alone; ++i) add(3, i);
  });

  std::vector<NeuronRow> rows;
  const double list = seconds([&] { rows = repository.neurons(); });
  if (rows.size() != options.neurons + some + alone) throw Error("not every neuron was stored");
  std::vector<Morphology> back;
  const double read = seconds([&] {
    for (std::uint32_t i = 0; i < some; ++i) back.push_back(repository.morphology(rows[i].id));
  });
  for (std::size_t i = 0; i < back.size(); ++i)
    if (back[i] != cells[std::get<Grown>(rows[i].provenance).index % cells.size()])
      throw Error(
          "a neuron did not come back as it was stored; this is an error of the program, please report it");

  // The middle two percent of every metric. Where nearly all neurons have the same value all of them are found, and the time
  // is that of listing them: such ranges are told apart.
  struct Ranges {
    std::size_t count = 0, most = 0;  // ranges; neurons found by one of them
    double slowest = 0.;              // s
  } narrow, wide;
  for (const statistics::Metric* metric : repository::stored_metrics()) {
    const auto at = [&](double part) {
      const std::string number = fmt::format("(select id from metrics where name = '{}')", metric->name);
      const Answer value =
          repository.query(fmt::format("select value from neuron_metrics where metric = {0} order by value "
                                       "limit 1 offset (select cast(count(*) * {1} "
                                       "as integer) from neuron_metrics where metric = {0})",
                                       number, part));
      return value.rows.empty() ? std::nan("") : std::get<double>(value.rows[0][0]);
    };
    const double low = at(.49), high = at(.51);
    if (std::isnan(low)) continue;  // not defined for such neurons
    std::vector<NeuronRow> found;
    const double time = seconds([&] {
      found = repository.neurons_where(fmt::format("{0} >= {1} and {0} <= {2}", metric->name, low, high));
    });
    Ranges& of = found.size() > rows.size() / 10 ? wide : narrow;
    of = {of.count + 1, std::max(of.most, found.size()), std::max(of.slowest, time)};
    if (found.empty()) throw Error(fmt::format("no neuron was found by its {}", metric->name));
  }

  const double bytes = double(std::filesystem::file_size(path)) / double(rows.size());
  console.table({"neurons of " + std::to_string(options.sections) + " sections", "per second"},
                {{"stored, made ready on all cores", fmt::format("{:.0f}", options.neurons / parallel)},
                 {"the same on one core, in one transaction", fmt::format("{:.0f}", some / batch)},
                 {"stored, each in a transaction of its own", fmt::format("{:.0f}", alone / single)},
                 {"read", fmt::format("{:.0f}", some / read)},
                 {"listed", fmt::format("{:.0f}", double(rows.size()) / list)}});
  console.say(fmt::format(
      "{:.0f} bytes a neuron of {} points; another reader got {} neurons meanwhile and waited {:.0f} ms "
      "at most; the slowest of {} range queries that found up to {} neurons took {:.0f} ms, of {} that found "
      "up to {} "
      "{:.0f} ms",
      bytes, rows[0].points, reader.neurons(), 1e3 * reader.longest_wait(), narrow.count, narrow.most,
      1e3 * narrow.slowest, wide.count, wide.most, 1e3 * wide.slowest));
  console.print({{"sections_per_neuron", options.sections},
                 {"points_per_neuron", rows[0].points},
                 {"neurons", rows.size()},
                 {"stored_per_second", options.neurons / parallel},
                 {"stored_on_one_core_per_second", some / batch},
                 {"stored_singly_per_second", alone / single},
                 {"read_per_second", some / read},
                 {"listed_per_second", double(rows.size()) / list},
                 {"range_query_milliseconds", 1e3 * narrow.slowest},
                 {"range_queries", narrow.count},
                 {"range_found", narrow.most},
                 {"wide_query_milliseconds", 1e3 * wide.slowest},
                 {"wide_queries", wide.count},
                 {"wide_found", wide.most},
                 {"read_meanwhile", reader.neurons()},
                 {"longest_wait_milliseconds", 1e3 * reader.longest_wait()},
                 {"bytes_per_neuron", bytes}});
}

}  // namespace

std::function<void()> bench_repository(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_whole(command, "--neurons", options->neurons, "Neurons to store", 10, 10'000'000);
  add_whole(command, "--sections", options->sections, "Sections of each", 5, 1'000'000);
  command.add_option("--folder", options->folder, "Where the repository is made, and removed again")
      ->check(CLI::ExistingDirectory);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
