// SPDX-License-Identifier: Apache-2.0
// brainforest bench column: the whole column drawn with a moving camera. How fast, in how much memory?
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <unistd.h>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/frame/soften.h"
#include "forest/io/png.h"
#include "forest/reports/synthetic.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::uint32_t neurons = 10000, shapes = usual_shapes, frames = 60;
  std::uint64_t seed = 1;
  std::optional<std::uint32_t> samples;
  double budget = scene::Budget::usual;
  std::string size = "1280x720";
  Drawer drawer = Drawer::automatic;
  bool activity = false;
  std::uint32_t compartments = 1500, steps = 64;
  std::filesystem::path folder = std::filesystem::temp_directory_path();
  std::filesystem::path out;  // none: no picture is kept
};

/// Once around what a view looks at, rising and sinking a little.
scene::View around(scene::View view, float turn) {
  const Vec3 from = view.camera.eye - view.camera.target;
  view.camera.eye = view.camera.target + Eigen::AngleAxisf(2.f * pi * turn, Vec3::UnitY()) * from +
                    Vec3(0.f, .15f * from.norm() * std::sin(4.f * pi * turn), 0.f);
  return view;
}

struct Part {
  double values = 0., segments = 0., gather = 0., paint = 0., touched = 0.;  // of activity, means a picture
  double frames = 0., seconds = 0., cull = 0., draw = 0., resolve = 0., covered = 0., error = 0.,
         samples = 0., pixel = 0.;
  double per_second() const { return frames / seconds; }
};

/// Draws `frames` pictures of a moving camera as the studio does, and all but shows them: a card's stay on it. The acceptable error
/// follows the budget.
Part measure(Artist& artist, const Options& options, const std::function<scene::View(float)>& view_at,
             const char* name, Console& console) {
  const auto [width, height] = parse_size(options.size);
  scene::Budget budget(options.budget);
  Part part;
  frame::Image image;
  console.progress().begin("drawing", options.frames);
  for (std::uint32_t i = 0; i < options.frames; ++i) {
    const auto start = Clock::now();
    scene::View view = scene::within(view_at(float(i) / float(options.frames)), budget);
    view.samples = options.samples.value_or(view.samples);
    std::uint64_t touched = 0;
    if (const scene::Playback* playback = artist.playback()) {
      view.activity = playback->view();
      view.activity->time = playback->activity().facts().time(i % options.steps);
      touched = playback->activity().touched();
    }
    Drawn drawn = artist.draw(view, width, height, {.pixels = !artist.on_card()});
    if (artist.on_card())
      image = std::move(drawn.image);
    else
      frame::soften(drawn.image, budget.softness(), image);
    const double seconds = seconds_since(start);
    if (image.covered < .02)
      throw Error(fmt::format("picture {} covers {:.2f} % of its pixels: nothing was measured", i,
                              100. * image.covered));
    part.frames += 1, part.seconds += seconds;
    part.cull += drawn.cull / options.frames, part.draw += drawn.draw / options.frames;
    part.resolve += drawn.resolve / options.frames, part.covered += image.covered / options.frames;
    if (artist.playback()) {
      part.values += double(drawn.activity.values) / options.frames;
      part.segments += double(drawn.segments) / options.frames;
      part.gather += drawn.activity.gather / options.frames,
          part.paint += drawn.activity.paint / options.frames;
      part.touched += double(artist.playback()->activity().touched() - touched) / options.frames;
    }
    part.error += double(budget.error()) / options.frames,
        part.samples += double(view.samples) / options.frames,
        part.pixel += double(view.detail.pixel) / options.frames;
    budget.took(1000. * seconds, drawn.segments);
    if (!options.out.empty() && i + 1 == options.frames)
      io::write_png(options.out / fmt::format("{}.png", name), width, height,
                    artist.on_card() ? artist.read().pixels : image.pixels);
    console.progress().advance();
  }
  console.progress().end();
  return part;
}

/// Makes up a simulation of the column and lets the artist play it; the file is gone when the program ends.
void make_up(Artist& artist, const GrownColumn& column, const Options& options, Console& console) {
  std::string name = (options.folder / "bench.activity.XXXXXX").string();
  const int file = ::mkstemp(name.data());
  if (file < 0)
    throw Error(options.folder.string() + ": nothing can be written there; name another --folder");
  ::close(file);
  const std::shared_ptr<void> cleaner(nullptr, [&](void*) { std::filesystem::remove(name); });
  const auto report = reports::synthetic_report(
      column.circuit, column.neurons,
      {.compartments = options.compartments, .steps = options.steps, .step = .1, .seed = options.seed});
  reports::pack(report, column.circuit, column.neurons, reports::nodes_of(column.circuit), {}, name, {},
                console.progress());
  artist.play(scene::Playback::open(artist.forest(), name));  // stays mapped
}

/// The share of covered pixels that change from one step to another, the eye standing still.
double changing(Artist& artist, const Options& options, scene::View view) {
  const auto [width, height] = parse_size(options.size);
  view.samples = 1;
  view.activity = artist.playback()->view();
  std::vector<std::uint8_t> before;
  double changed = 0., covered = 0.;
  for (const std::uint32_t step : {options.steps / 4, options.steps / 2}) {
    view.activity->time = artist.playback()->activity().facts().time(step);
    const Drawn drawn = artist.draw(view, width, height);
    covered = drawn.image.covered * width * height;
    for (std::size_t i = 0; i < before.size(); i += 4)
      changed += !std::equal(&before[i], &before[i] + 3, &drawn.image.pixels[i]);
    before = drawn.image.pixels;
  }
  if (!(changed > .02 * covered))
    throw Error(fmt::format("{:.2f} % of the pixels change from step to step: nothing was played",
                            100. * changed / covered));
  return changed / covered;
}

void run(const Options& options, Console& console) {
  if (!options.out.empty()) std::filesystem::create_directories(options.out);
  const GrownColumn column = planted_column(options.neurons, options.seed, console, options.shapes);
  const scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(column.circuit, column.neurons, console.progress()));
  const auto start = Clock::now();
  Artist artist(forest, options.drawer);
  const auto [width, height] = parse_size(options.size);
  const scene::View overview = scene::overview(forest);
  scene::View first = around(overview, 0.f);
  first.samples = 1;
  artist.draw(first, width, height);
  const double first_picture = seconds_since(start);

  double changes = 0.;
  if (options.activity) {
    make_up(artist, column, options, console);
    changes = changing(artist, options, first);
  }
  const Part outside = measure(
      artist, options, [&](float t) { return around(overview, t); }, "around", console);
  const scene::CameraPath path = scene::walk(forest);
  const Part inside = measure(
      artist, options, [&](float t) { return path.at(.5f + .5f * t); }, "inside", console);
  const std::uint64_t peak = peak_bytes();

  const auto json_of = [&](const Part& p) {
    nlohmann::ordered_json of{{"frames_per_second", p.per_second()},
                              {"milliseconds", {{"cull", p.cull}, {"draw", p.draw}, {"resolve", p.resolve}}},
                              {"covered", p.covered},
                              {"samples", p.samples},
                              {"error_pixels", p.error},
                              {"pixel", p.pixel}};
    if (options.activity)
      of["activity"] = {{"segments", p.segments}, {"values", p.values},   {"bytes_touched", p.touched},
                        {"gather_ms", p.gather},  {"colour_ms", p.paint}, {"made_up", true}};
    return of;
  };
  nlohmann::ordered_json json{{"neurons", forest.instances().size()},
                              {"shapes", forest.neurons().size()},
                              {"segments", forest.segment_total()}};
  json.update(json_of(outside));
  json.update({{"peak_bytes", peak},
               {"first_picture_seconds", first_picture},
               {"forest_bytes", forest.bytes()},
               {"inside", json_of(inside)},
               {"size", options.size},
               {"renderer", artist.renderer()}});
  if (options.activity) {
    json["pixels_changing"] = changes;
    json["values_per_step"] = artist.playback()->activity().width(reports::Level::compartment);
  }
  console.print(json);
  const auto row = [](const char* name, const Part& p) {
    return std::vector<std::string>{name,
                                    fmt::format("{:.1f}", p.per_second()),
                                    fmt::format("{:.1f}", p.cull),
                                    fmt::format("{:.1f}", p.draw),
                                    fmt::format("{:.1f}", p.resolve),
                                    fmt::format("{:.0f} %", 100. * p.covered),
                                    fmt::format("{:.0f}", p.samples),
                                    fmt::format("{:.1f}", p.error),
                                    fmt::format("{:.2f}", p.pixel)};
  };
  console.say(fmt::format("{} neurons of {} shapes, {} segments, {}, {}", forest.instances().size(),
                          forest.neurons().size(), forest.segment_total(), options.size, artist.renderer()));
  console.table(
      {"camera", "frames/s", "cull ms", "draw ms", "resolve ms", "covered", "samples", "error px", "pixel"},
      {row("around the column", outside), row("inside it", inside)});
  if (options.activity) {
    const auto of = [](const char* name, const Part& p) {
      return std::vector<std::string>{name,
                                      fmt::format("{:.0f}", p.segments),
                                      fmt::format("{:.0f}", p.values),
                                      fmt::format("{:.2f}", p.touched / 1e6),
                                      fmt::format("{:.1f}", p.gather),
                                      fmt::format("{:.1f}", p.paint)};
    };
    console.say(fmt::format(
        "\na made-up simulation plays, a step a picture, {} values a step; {:.0f} % of the covered pixels "
        "change in "
        "{} steps",
        artist.playback()->activity().width(reports::Level::compartment), 100. * changes, options.steps / 4));
    console.table({"activity", "segments", "values read", "MB touched", "gather ms", "colour ms"},
                  {of("around the column", outside), of("inside it", inside)});
  }
  console.say(fmt::format("first picture after {:.2f} s; peak memory {:.0f} MB; forest file {:.1f} MB",
                          first_picture, double(peak) / 1e6, double(forest.bytes()) / 1e6));
}

}  // namespace

std::function<void()> bench_column(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--shapes", options->shapes, "Distinct neurons among them", 5, 100'000);
  add_whole(command, "--frames", options->frames, "Pictures drawn outside, and as many inside", 2, 100'000);
  must_be_whole(
      *command.add_option("--samples", options->samples, "Samples a pixel, instead of what the budget says"),
      1, 1024);
  add_budget(command, options->budget);
  add_size(command, options->size);
  add_renderer(command, options->drawer);
  command.add_flag("--activity", options->activity,
                   "A made-up simulation plays on the branches, one step a picture");
  must_be_whole(*command
                     .add_option("--compartments", options->compartments,
                                 "Of each neuron, with --activity; more where it has more sections")
                     ->capture_default_str(),
                1, 100'000);
  must_be_whole(
      *command
           .add_option("--steps", options->steps, "With --activity; 64 take 0.7 GB of disk at the size given")
           ->capture_default_str(),
      8, 100'000);
  command.add_option("--folder", options->folder, "Where the activity file is made, and removed")
      ->capture_default_str();
  command.add_option("--out", options->out, "Folder for the last picture of each part");
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
