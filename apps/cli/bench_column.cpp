// SPDX-License-Identifier: Apache-2.0
// brainforest bench column: the whole column drawn with a moving camera. How fast, in how much memory?
#include <chrono>
#include <cmath>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "forest/core/error.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::uint32_t neurons = 10000, frames = 60;
  std::uint64_t seed = 1;
  double budget = 85.;  // milliseconds a picture
  std::string size = "1280x720";
  Drawer drawer = Drawer::automatic;
};

/// Once around the column, at the distance from which all of it is seen, rising and sinking a little.
scene::View around(const scene::Forest& forest, float turn) {
  scene::View view = scene::overview(forest);
  const Vec3 from = view.camera.eye - view.camera.target;
  view.camera.eye = view.camera.target + Eigen::AngleAxisf(2.f * pi * turn, Vec3::UnitY()) * from +
                    Vec3(0.f, .15f * from.norm() * std::sin(4.f * pi * turn), 0.f);
  return view;
}

struct Part {
  double frames = 0., seconds = 0., cull = 0., draw = 0., resolve = 0., covered = 0., error = 0.;
  double per_second() const { return frames / seconds; }
};

/// Draws `frames` pictures of a moving camera; the acceptable error follows the budget.
Part measure(Artist& artist, const Options& options, const std::function<scene::View(float)>& view_at,
             Console& console) {
  const auto [width, height] = parse_size(options.size);
  scene::Budget budget(options.budget);
  Part part;
  console.progress().begin("drawing", options.frames);
  for (std::uint32_t i = 0; i < options.frames; ++i) {
    const auto start = Clock::now();
    scene::View view = view_at(float(i) / float(options.frames));
    view.samples = 1;
    view.detail.error = budget.error();
    const Drawn drawn = artist.draw(view, width, height);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (drawn.image.covered < .02)
      throw Error(fmt::format("picture {} covers {:.2f} % of its pixels: nothing was measured", i,
                              100. * drawn.image.covered));
    part.frames += 1, part.seconds += seconds;
    part.cull += drawn.cull / options.frames, part.draw += drawn.draw / options.frames;
    part.resolve += drawn.resolve / options.frames, part.covered += drawn.image.covered / options.frames;
    part.error += double(budget.error()) / options.frames;
    budget.took(1000. * seconds);
    console.progress().advance();
  }
  console.progress().end();
  return part;
}

void run(const Options& options, Console& console) {
  const scene::Forest forest = grown_column(options.neurons, options.seed, console);
  const auto start = Clock::now();
  Artist artist(forest, options.drawer);
  const auto [width, height] = parse_size(options.size);
  scene::View first = around(forest, 0.f);
  first.samples = 1;
  artist.draw(first, width, height);
  const double first_picture = std::chrono::duration<double>(Clock::now() - start).count();

  const Part outside = measure(
      artist, options, [&](float t) { return around(forest, t); }, console);
  const scene::CameraPath path = scene::walk(forest);
  const Part inside = measure(
      artist, options, [&](float t) { return path.at(.5f + .5f * t); }, console);
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const std::uint64_t peak = std::uint64_t(usage.ru_maxrss) * 1024;

  const auto json_of = [](const Part& p) {
    return nlohmann::ordered_json{
        {"frames_per_second", p.per_second()},
        {"milliseconds", {{"cull", p.cull}, {"draw", p.draw}, {"resolve", p.resolve}}},
        {"covered", p.covered},
        {"error_pixels", p.error}};
  };
  nlohmann::ordered_json json{{"neurons", forest.instances().size()}, {"segments", forest.segment_total()}};
  json.update(json_of(outside));
  json.update({{"peak_bytes", peak},
               {"first_picture_seconds", first_picture},
               {"forest_bytes", forest.bytes()},
               {"inside", json_of(inside)},
               {"size", options.size},
               {"renderer", artist.renderer()}});
  console.print(json);
  const auto row = [](const char* name, const Part& p) {
    return std::vector<std::string>{name,
                                    fmt::format("{:.1f}", p.per_second()),
                                    fmt::format("{:.1f}", p.cull),
                                    fmt::format("{:.1f}", p.draw),
                                    fmt::format("{:.1f}", p.resolve),
                                    fmt::format("{:.0f} %", 100. * p.covered),
                                    fmt::format("{:.1f}", p.error)};
  };
  console.say(fmt::format("{} neurons, {} segments, {}, {}", forest.instances().size(),
                          forest.segment_total(), options.size, artist.renderer()));
  console.table({"camera", "frames/s", "cull ms", "draw ms", "resolve ms", "covered", "error px"},
                {row("around the column", outside), row("inside it", inside)});
  console.say(fmt::format("first picture after {:.2f} s; peak memory {:.0f} MB; forest file {:.1f} MB",
                          first_picture, double(peak) / 1e6, double(forest.bytes()) / 1e6));
}

}  // namespace

std::function<void()> bench_column(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command
      .add_option("--neurons", options->neurons, "Neurons planted, at the density of the recipe column-10000")
      ->check(CLI::Range(10, 10'000'000))
      ->capture_default_str();
  command.add_option("--frames", options->frames, "Pictures drawn outside, and as many inside")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command
      .add_option("--budget", options->budget, "Milliseconds a picture may take before less detail is chosen")
      ->check(CLI::Range(1., 10000.))
      ->capture_default_str();
  add_size(command, options->size);
  add_renderer(command, options->drawer);
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
