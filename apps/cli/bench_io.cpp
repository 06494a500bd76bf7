// SPDX-License-Identifier: Apache-2.0
// brainforest bench io: how fast neuron files are read, bytes in memory to Morphology, on one core.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/format.h"

#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

constexpr double seconds_per_format = 2.;
constexpr std::size_t neurons_grown = 64;

/// A neuron of about 5,000 points with numbers like a tracing program's: two decimals, steps of about a micrometre.
Morphology synthetic_neuron(std::uint64_t index) {
  Random random(1, index, 9);
  const auto hundredths = [](float value) { return std::round(value * 100.f) / 100.f; };
  MorphologyBuilder builder;
  builder.set_soma(
      {.kind = SomaKind::sphere, .points = {{0, 0, 0, 8.25f}}, .parents = {}, .contour_starts = {}});
  std::vector<Point> ends;
  constexpr std::uint32_t sections = 121, stems = 5;
  for (std::uint32_t i = 0; i < sections; ++i) {
    const std::uint32_t parent = i < stems ? 0 : (i - stems) / 2;
    Point at = i < stems ? Point{0, 0, 0, 2.f} : ends[parent];
    Vec3 direction =
        Vec3(float(random.normal()), float(random.normal()), float(random.normal())).normalized();
    std::vector<Point> points;
    for (std::uint32_t k = 0, count = 20 + random.below(45); k < count; ++k) {
      direction =
          (direction + 0.3f * Vec3(float(random.normal()), float(random.normal()), float(random.normal())))
              .normalized();
      const Vec3 next = at.position() + float(random.uniform(.3, 2.)) * direction;
      at = {hundredths(next.x()), hundredths(next.y()), hundredths(next.z()),
            std::max(hundredths(at.radius * .999f), .1f)};
      points.push_back(at);
    }
    const auto kind = i % stems == 0 ? SectionKind::axon : SectionKind::basal;
    builder.add_section(i < stems ? SectionId() : SectionId(parent), kind, points, std::int32_t(kind),
                        i < stems ? 0 : -1);
    ends.push_back(at);
  }
  return builder.build();
}

struct Work {
  std::vector<std::string> names, files;  // the bytes of each
  std::vector<std::size_t> points;        // that reading must give; empty: what the first reading gave
};
using WorkByFormat = std::map<const io::Format*, Work>;

WorkByFormat grown() {
  WorkByFormat all;
  for (std::size_t i = 0; i < neurons_grown; ++i) {
    const Morphology neuron = synthetic_neuron(i);
    for (const io::Format& format : io::formats()) {
      if (!format.write || !format.read) continue;
      Work& work = all[&format];
      work.names.push_back(fmt::format("neuron {}", i));
      work.files.push_back(format.write(neuron));
      work.points.push_back(io::as_kept(neuron, format.keeps).points().size());
    }
  }
  return all;
}

WorkByFormat collected(const std::vector<std::filesystem::path>& places) {
  WorkByFormat all;
  const auto add = [&](const std::filesystem::path& path) {
    const MappedFile file(path);
    Work& work = all[&io::format_of(path, file.text())];
    work.names.push_back(path.string());
    work.files.emplace_back(file.text());
  };
  const auto known = [](const std::filesystem::path& path) {
    return std::ranges::any_of(io::formats(), [&](const io::Format& format) {
      return format.read &&
             std::ranges::find(format.extensions, path.extension().string()) != format.extensions.end();
    });
  };
  for (const auto& place : places) {
    if (!std::filesystem::is_directory(place)) {
      add(place);
      continue;
    }
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place))
      if (entry.is_regular_file() && known(entry.path())) files.push_back(entry.path());
    if (files.empty())
      throw Error(fmt::format("{} holds no neuron file; name another folder or a file", place.string()));
    std::ranges::sort(files);
    std::ranges::for_each(files, add);
  }
  return all;
}

struct Result {
  std::size_t files = 0, points = 0, passes = 0;
  double megabytes = 0., median_rate = 0., best_rate = 0.;  // MB and MB/s; 1 MB is 10^6 bytes
};

Result measure(const io::Format& format, Work& work, Progress& progress) {
  Result result{.files = work.files.size()};
  for (const std::string& bytes : work.files) result.megabytes += double(bytes.size()) * 1e-6;
  const bool known = !work.points.empty();
  work.points.resize(work.files.size());
  std::vector<double> rates;
  progress.begin("reading", 0);
  for (double total = 0.; total < seconds_per_format || rates.size() < 3;) {
    double seconds = 0.;
    result.points = 0;
    for (std::size_t i = 0; i < work.files.size(); ++i) {
      const auto begin = Clock::now();
      const Morphology neuron = format.read(work.files[i], work.names[i]).morphology;
      seconds += seconds_since(begin);
      const std::size_t points = neuron.points().size();
      result.points += points;
      if (!known && rates.empty()) work.points[i] = points;
      if (points != work.points[i])
        throw Error(
            fmt::format("{}: {} points were read, not {}; this is an error of the program, please report it",
                        work.names[i], points, work.points[i]));
      progress.advance();
    }
    rates.push_back(result.megabytes / seconds);
    total += seconds;
  }
  progress.end();
  std::ranges::sort(rates);
  result.passes = rates.size();
  result.median_rate = rates[rates.size() / 2];
  result.best_rate = rates.back();
  return result;
}

}  // namespace

std::function<void()> bench_io(CLI::App& command, Console& console) {
  const auto places = std::make_shared<std::vector<std::filesystem::path>>();
  command
      .add_option("files", *places,
                  "Files or folders to read; by default neurons that are grown and written in memory")
      ->check(CLI::ExistingPath);
  return [places, &console] {
    WorkByFormat all = places->empty() ? grown() : collected(*places);
    nlohmann::ordered_json rates = nlohmann::ordered_json::object(),
                           details = nlohmann::ordered_json::object();
    std::vector<std::vector<std::string>> rows;
    for (const io::Format& format : io::formats()) {
      const auto work = all.find(&format);
      if (work == all.end()) continue;
      const Result r = measure(format, work->second, console.progress());
      const std::string name(format.name);
      rates[name] = r.median_rate;
      details[name] = {{"files", r.files},
                       {"megabytes", r.megabytes},
                       {"points", r.points},
                       {"passes", r.passes},
                       {"best", r.best_rate}};
      rows.push_back({name, fmt::format("{}", r.files), fmt::format("{:.1f}", r.megabytes),
                      fmt::format("{}", r.points), fmt::format("{:.0f}", r.median_rate),
                      fmt::format("{:.0f}", r.best_rate), fmt::format("{}", r.passes)});
    }
    console.table({"format", "files", "MB", "points", "MB/s (median)", "MB/s (best)", "passes"}, rows);
    console.print({{"megabytes_per_second", rates}, {"reading", details}});
  };
}

}  // namespace forest::cli
