// SPDX-License-Identifier: Apache-2.0
// brainforest bench measure: how many neurons a second have all their metrics measured, on one core, how long Sholl's analysis
// takes and how many barcodes a second are made. Lengths, crossings and bars are compared with those that plain loops find.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/random.h"
#include "forest/io/format.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/barcode.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/sholl.h"
#include "forest/statistics/summary.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace statistics;
constexpr double seconds_per_figure = 3.;

/// A binary tree from each stem whose sections are random walks of steps of about a micrometre.
Morphology walk(std::uint64_t index, std::uint32_t stems, std::uint32_t sections, std::uint32_t points) {
  Random random(1, index, 11);
  const auto anywhere = [&] {
    return Vec3(float(random.normal()), float(random.normal()), float(random.normal())).normalized();
  };
  MorphologyBuilder builder;
  builder.set_soma({.kind = SomaKind::sphere, .points = {{0, 0, 0, 8}}, .parents = {}, .contour_starts = {}});
  std::vector<Point> ends;
  for (std::uint32_t i = 0; i < sections; ++i) {
    const std::uint32_t parent = i < stems ? 0 : (i - stems) / 2;
    Vec3 direction = anywhere();
    Point at = i < stems ? Point{8 * direction.x(), 8 * direction.y(), 8 * direction.z(), 2} : ends[parent];
    std::vector<Point> line{at};
    for (std::uint32_t k = 0, count = 1 + random.below(2 * points); k < count; ++k) {
      direction = (direction + 0.3f * anywhere()).normalized();
      const Vec3 next = at.position() + float(random.uniform(.3, 2.)) * direction;
      at = {next.x(), next.y(), next.z(), std::max(at.radius * float(random.uniform(.99, 1.005)), .1f)};
      line.push_back(at);
    }
    builder.add_section(i < stems ? SectionId() : SectionId(parent),
                        i % stems == 0 ? SectionKind::axon : SectionKind::basal, line);
    ends.push_back(at);
  }
  return builder.build();
}

/// How long `body` takes: the median of as many runs as fit into some seconds.
double seconds(Progress& progress, std::string_view stage, const std::function<void()>& body) {
  std::vector<double> times;
  progress.begin(stage, 0);
  for (double total = 0.; total < seconds_per_figure || times.size() < 3;) {
    const auto begin = Clock::now();
    body();
    times.push_back(seconds_since(begin));
    total += times.back();
    progress.advance();
  }
  progress.end();
  std::ranges::nth_element(times, times.begin() + std::ptrdiff_t(times.size() / 2));
  return times[times.size() / 2];
}

/// Sphere by sphere, segment by segment: falls to the point of the segment that is nearest and rises from there.
std::vector<double> plain_crossings(const Arbors& a) {
  std::vector<double> counts;
  const Eigen::Vector3d centre = a.origin().position().cast<double>();
  while (true) {
    const double radius = double(counts.size() + 1) * sholl_step;
    double count = 0., outside = 0.;
    for (const Branch& b : a.sections()) {
      const auto points = a.points(b);
      for (std::size_t i = 1; i < points.size(); ++i) {
        const Eigen::Vector3d from = points[i - 1].position().cast<double>() - centre,
                              to = points[i].position().cast<double>() - centre, way = to - from;
        const double t = std::clamp(-from.dot(way) / std::max(way.squaredNorm(), 1e-300), 0., 1.);
        const double nearest = (from + t * way).norm();
        count += (nearest < radius && radius <= from.norm()) + (nearest < radius && radius <= to.norm());
        outside += std::max(from.norm(), to.norm()) >= radius;
      }
    }
    if (outside == 0.) break;
    counts.push_back(count);
  }
  return counts;
}

/// Each tip's way to the start of its arbor, up to where a tip further out comes in.
std::vector<Bar> plain_bars(const Arbors& a) {
  const auto sections = a.sections();
  std::vector<double> furthest(sections.size(), 0.);
  const auto start = [&](const Branch& b) {
    const Branch& stem = a.section(a.stems()[b.arbor]);
    return stem.path_distance - stem.length;
  };
  for (const Branch& tip : sections)
    if (tip.daughters == 0)
      for (auto i = std::int32_t(&tip - sections.data()); i >= 0; i = sections[std::size_t(i)].parent)
        furthest[std::size_t(i)] = std::max(furthest[std::size_t(i)], tip.path_distance - start(tip));
  std::vector<Bar> bars;
  for (const Branch& tip : sections) {
    if (tip.daughters != 0) continue;
    const double birth = tip.path_distance - start(tip);
    auto i = std::size_t(&tip - sections.data());
    bool goes_on = true;
    while (goes_on && sections[i].parent >= 0) {
      const auto parent = std::size_t(sections[i].parent);
      for (std::size_t k = 0; k < sections.size() && goes_on; ++k)
        goes_on = k == i || sections[k].parent != std::int32_t(parent) || furthest[k] < birth ||
                  (furthest[k] == birth && k > i);
      i = parent;
    }
    bars.push_back({birth, goes_on ? 0. : sections[i].path_distance - start(tip)});
  }
  return bars;
}

[[noreturn]] void wrong(std::string_view what) {
  throw Error(fmt::format(
      "{} differ from those that a plain loop finds; this is an error of the program, please report it",
      what));
}

void check(const Morphology& cell) {
  const Arbors arbors(cell);
  const double length = find_metric("total_length")->values(arbors)[0];
  if (std::abs(length - total_length(cell)) > 1e-9 * length) wrong("lengths");
  if (sholl_crossings(arbors) != plain_crossings(arbors)) wrong("crossings");
  const Barcodes barcodes(arbors, Filtration::path);
  std::vector<Bar> found(barcodes.bars().begin(), barcodes.bars().end()), expected = plain_bars(arbors);
  for (auto* bars : {&found, &expected})
    std::ranges::sort(*bars, {}, [](const Bar& b) { return std::pair(b.birth, b.death); });
  for (std::size_t i = 0; i < found.size(); ++i)
    if (found.size() != expected.size() || std::abs(found[i].birth - expected[i].birth) > 1e-6 ||
        std::abs(found[i].death - expected[i].death) > 1e-6)
      wrong("bars");
}

void run(const std::vector<std::string>& places, bool details, Console& console) {
  std::vector<Morphology> cells, trees;
  if (places.empty())
    for (std::uint64_t i = 0; i < 64; ++i) cells.push_back(walk(i, 5, 121, 42));
  else
    for (const auto& file : neuron_files(places, console)) cells.push_back(io::read(file).morphology);
  for (std::uint64_t i = 0; i < 64; ++i) trees.push_back(walk(i, 1, 199, 5));
  std::ranges::for_each(cells, check), std::ranges::for_each(trees, check);
  double points = 0.;
  for (const Morphology& cell : cells) points += double(cell.points().size()) / double(cells.size());

  double sum = 0.;  // so that nothing is left out as unused
  const auto every = metrics();
  const std::size_t hundred = std::min<std::size_t>(100, every.size());
  const auto all = [&](std::size_t number, auto&& reduce) {  // so many, evenly from the table
    for (const Morphology& cell : cells) {
      const Arbors arbors(cell);
      for (std::size_t i = 0; i < number; ++i) sum += reduce(every[i * every.size() / number].values(arbors));
    }
  };
  const double count = double(cells.size());
  const double means = seconds(console.progress(), "measuring",
                               [&] { all(every.size(), [](const auto& v) { return mean(v); }); });
  const double means_of_hundred = seconds(console.progress(), "measuring a hundred",
                                          [&] { all(hundred, [](const auto& v) { return mean(v); }); });
  const double summaries = seconds(console.progress(), "measuring and summing up", [&] {
    all(every.size(), [](const auto& v) { return summarize(v).median; });
  });
  const double sholl = seconds(console.progress(), "counting crossings", [&] {
    for (const Morphology& cell : cells) sum += double(sholl_crossings(Arbors(cell)).size());
  });
  std::vector<Arbors> arbors(trees.begin(), trees.end());
  std::size_t tips = 0;
  const double bars = seconds(console.progress(), "making barcodes", [&] {
    tips = 0;
    for (const Arbors& tree : arbors)
      for (const Filtration filtration : {Filtration::radial, Filtration::path})
        tips += Barcodes(tree, filtration).bars().size();
  });
  const double barcodes = 2. * double(trees.size());

  console.table({"of neurons of " + fmt::format("{:.0f} points, on one core", points), ""},
                {{fmt::format("{} metrics and their means, neurons a second", metrics().size()),
                  fmt::format("{:.0f}", count / means)},
                 {fmt::format("{} of them, evenly from the table", hundred),
                  fmt::format("{:.0f}", count / means_of_hundred)},
                 {"all with spread, median and range", fmt::format("{:.0f}", count / summaries)},
                 {"Sholl's analysis of one, µs", fmt::format("{:.1f}", 1e6 * sholl / count)},
                 {fmt::format("barcodes of {:.0f} bars a second", double(tips) / barcodes),
                  fmt::format("{:.0f}", barcodes / bars)}});
  nlohmann::ordered_json out{{"metrics", metrics().size()},
                             {"neurons", cells.size()},
                             {"points_per_neuron", points},
                             {"neurons_per_second", count / means},
                             {"neurons_per_second_of_a_hundred", count / means_of_hundred},
                             {"neurons_summarized_per_second", count / summaries},
                             {"sholl_microseconds", 1e6 * sholl / count},
                             {"barcodes_per_second", barcodes / bars},
                             {"bars_per_barcode", double(tips) / barcodes}};
  if (details) {
    std::vector<std::vector<std::string>> rows;
    auto each = nlohmann::ordered_json::object();
    for (const Metric& metric : metrics()) {
      double time = 0.;
      for (const Morphology& cell : cells) {
        const Arbors fresh(cell);
        const auto begin = Clock::now();
        sum += mean(metric.values(fresh));
        time += seconds_since(begin);
      }
      each[std::string(metric.name)] = 1e6 * time / count;
      rows.push_back({std::string(metric.name), fmt::format("{:.1f}", 1e6 * time / count)});
    }
    out["microseconds"] = std::move(each);
    console.table({"metric alone", "µs a neuron"}, rows);
  }
  console.print(out);
}

}  // namespace

std::function<void()> bench_measure(CLI::App& command, Console& console) {
  const auto places = std::make_shared<std::vector<std::string>>();
  const auto details = std::make_shared<bool>(false);
  command
      .add_option("files", *places,
                  "Neurons to measure, files or folders; by default made-up ones of 5,000 points")
      ->type_name("FILES");
  command.add_flag("--each", *details, "How long each metric takes alone, too");
  return [places, details, &console] { run(*places, *details, console); };
}

}  // namespace forest::cli
