// SPDX-License-Identifier: Apache-2.0
// brainforest bench gaze: pictures for an eye that looks at one place, with a moving camera, a moving gaze or both. How many
// primitives fewer than without a gaze, is the fovea's part of the picture the same, and how fast? docs/scene/gaze.md.
#include <algorithm>
#include <cmath>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/frame/soften.h"
#include "forest/io/png.h"
#include "forest/scene/scanpath.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"
#include "apps/foveated.h"

namespace forest::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::uint32_t neurons = 10000, frames = 60, compared = 6;
  std::uint64_t seed = 1;
  double slope = 1.5, fovea = 2.5, screen = 0., budget = scene::Budget::with_gaze;
  std::string size = "1920x1080";
  std::filesystem::path scanpath, out;
  Drawer drawer = Drawer::automatic;
};

/// Fixations of a quarter to half a second, anywhere in the picture but its rim; what people do before pictures.
scene::Scanpath looking_about(double milliseconds, std::uint64_t seed) {
  Random random(seed);
  std::vector<scene::Fixation> fixations;
  for (double time = 0.; time <= milliseconds; time += random.uniform(250., 450.))
    fixations.push_back({time, {float(random.uniform(.15, .85)), float(random.uniform(.15, .85))}});
  return scene::Scanpath(std::move(fixations));
}

struct Part {
  std::string name;
  double frames = 0., seconds = 0., cull = 0., draw = 0., unite = 0., covered = 0.;
  std::uint64_t segments = 0,
                whole_segments = 0;          // chosen for the pictures compared, with and without a gaze
  std::uint64_t drawn = 0, whole_drawn = 0;  // of them, neither hidden nor beside what is wanted
  std::uint64_t fovea_pixels = 0, fovea_differ = 0, compared = 0;
  std::vector<double> took;           // ms
  std::vector<std::uint64_t> layers;  // segments of each, of the last picture compared
  // The same within the budget, which moves the error.
  double budget_seconds = 0., budget_error = 0., budget_pixel = 0., budget_samples = 0.;

  double per_second_of_budget() const { return frames / budget_seconds; }
  double per_second() const { return frames / seconds; }
  double ratio() const { return double(whole_drawn) / double(std::max<std::uint64_t>(1, drawn)); }
  double ratio_chosen() const {
    return double(whole_segments) / double(std::max<std::uint64_t>(1, segments));
  }
  double slowest() const { return *std::ranges::max_element(took); }
};

class Bench {
 public:
  Bench(const Options& options, Console& console)
      : options_(options),
        console_(console),
        size_(parse_size(options.size)),
        forest_(grown_column(options.neurons, options.seed, console)),
        foveated_(forest_, [this] { return make_renderer(options_.drawer); }),
        artist_(forest_, options.drawer),
        gaze_(options.scanpath.empty()
                  ? looking_about(1000. * options.frames / 60., options.seed)
                  : scene::parse_scanpath(MappedFile(options.scanpath).text(), options.scanpath.string())) {}

  const scene::Forest& forest() const { return forest_; }
  std::string renderer() const { return artist_.renderer(); }

  /// @param view_at  of shares of the part's time
  Part measure(const std::string& name, const std::function<scene::View(float)>& view_at) {
    Part part;
    part.name = name;
    const scene::Colouring colouring = scene::colour(forest_, scene::ColourBy::type, scene::Background::dark);
    console_.progress().begin(name, options_.frames);
    const std::uint32_t every = std::max(1u, options_.frames / options_.compared);
    const auto view_of = [&](std::uint32_t frame) {
      scene::View view = view_at(float(frame) / float(options_.frames));
      view.samples = 1;
      return view;
    };
    const auto gazed = [&](std::uint32_t frame) {
      scene::View view = view_of(frame);
      view.detail.acuity_slope = float(options_.slope);
      view.detail.fovea = float(options_.fovea), view.detail.screen = float(options_.screen);
      view.detail.gaze = gaze_.at(1000. * frame / 60.);
      return view;
    };
    for (std::uint32_t i = 0; i < options_.frames; ++i) {
      const scene::View view = gazed(i);
      const auto start = Clock::now();
      const frame::Image& image = foveated_.draw(view, size_.first, size_.second, colouring);
      const double seconds = seconds_since(start);
      if (i > 0) {  // the first has nothing to go by
        const Foveated::Figures& f = foveated_.figures();
        part.frames += 1, part.seconds += seconds, part.took.push_back(1000. * seconds);
        part.cull += f.cull, part.draw += f.draw, part.unite += f.unite;
        part.covered += image.covered;
      }
      if (i % every == every - 1) {
        artist_.draw(view_of(i - std::min(i, 1u)), size_.first,
                     size_.second);  // what a moving picture goes by
        compare(view, image, part, artist_.draw(view_of(i), size_.first, size_.second));
      }
      console_.progress().advance();
    }
    console_.progress().end();
    for (double* sum : {&part.cull, &part.draw, &part.unite, &part.covered}) *sum /= part.frames;
    draw_within_budget(gazed, part);
    if (part.covered < .005)
      throw Error(fmt::format("{}: the pictures show nothing; nothing was measured", name));
    return part;
  }

 private:
  // As the studio does; the pictures before the first are for the budget to settle.
  void draw_within_budget(const std::function<scene::View(std::uint32_t)>& view_of, Part& part) {
    constexpr std::uint32_t settling = 20;
    const scene::Colouring colouring = scene::colour(forest_, scene::ColourBy::type, scene::Background::dark);
    scene::Budget budget(options_.budget);
    frame::Image image;
    for (std::uint32_t i = 0; i < settling + std::uint32_t(part.frames); ++i) {
      const scene::View view =
          scene::within(view_of(i < settling ? i % options_.frames : i - settling), budget);
      const auto start = Clock::now();
      frame::soften(foveated_.draw(view, size_.first, size_.second, colouring), budget.softness(), image);
      const double seconds = seconds_since(start);
      if (i >= settling)
        part.budget_seconds += seconds, part.budget_error += double(budget.error()) / part.frames,
            part.budget_pixel += double(budget.pixel()) / part.frames,
            part.budget_samples += double(budget.samples()) / part.frames;
      budget.took(1000. * seconds, foveated_.figures().segments);
    }
  }

  void compare(const scene::View& view, const frame::Image& image, Part& part, const Drawn& whole) {
    ++part.compared;
    part.segments += foveated_.figures().segments;
    part.drawn += foveated_.figures().drawn, part.whole_drawn += whole.reached;
    part.layers = foveated_.figures().layer_segments;
    part.whole_segments += whole.segments;
    const frame::Viewport viewport{float(size_.first), float(size_.second)};
    const scene::Gaze gaze(view.camera, viewport, scene::detail_for(view, size_.first, size_.second));
    for (std::uint32_t y = 0; y < size_.second; ++y)
      for (std::uint32_t x = 0; x < size_.first; ++x) {
        if (gaze.eccentricity({float(x) + .5f, float(y) + .5f}) > view.detail.fovea) continue;
        const std::size_t at = 4 * (std::size_t(y) * size_.first + x);
        ++part.fovea_pixels;
        part.fovea_differ += !std::equal(&image.pixels[at], &image.pixels[at] + 3, &whole.image.pixels[at]);
      }
    if (options_.out.empty()) return;
    std::filesystem::create_directories(options_.out);
    const std::string name = fmt::format("{}_{}", part.name.substr(0, part.name.find(',')), int(part.frames));
    frame::Image opaque = image;
    for (std::size_t i = 3; i < opaque.pixels.size(); i += 4) opaque.pixels[i] = 255;
    io::write_png(options_.out / (name + "_gaze.png"), size_.first, size_.second, opaque.pixels);
    io::write_png(options_.out / (name + ".png"), size_.first, size_.second, whole.image.pixels);
  }

  const Options& options_;
  Console& console_;
  std::pair<std::uint32_t, std::uint32_t> size_;
  scene::Forest forest_;
  Foveated foveated_;
  Artist artist_;
  scene::Scanpath gaze_;
};

void run(const Options& options, Console& console) {
  Bench bench(options, console);
  const scene::View outside = scene::overview(bench.forest());
  const scene::CameraPath path = scene::walk(bench.forest());
  const auto around = [&](float turn) {
    scene::View view = outside;
    view.camera.eye = view.camera.target + Eigen::AngleAxisf(2.f * pi * turn, Vec3::UnitY()) *
                                               Vec3(outside.camera.eye - outside.camera.target);
    return view;
  };
  const std::vector<Part> parts{
      bench.measure("outside, the gaze moves", [&](float) { return outside; }),
      bench.measure("around, camera and gaze move", around),
      bench.measure("inside, camera and gaze move", [&](float t) { return path.at(.5f + .5f * t); })};

  Json json{{"neurons", bench.forest().instances().size()},
            {"segments", bench.forest().segment_total()},
            {"size", options.size},
            {"acuity_slope", options.slope},
            {"fovea", options.fovea},
            {"screen", options.screen},
            {"budget_ms", options.budget},
            {"renderer", bench.renderer()}};
  std::vector<std::vector<std::string>> rows;
  double least_ratio = INFINITY, least_rate = INFINITY;
  std::uint64_t differ = 0;
  for (const Part& p : parts) {
    least_ratio = std::min(least_ratio, p.ratio()),
    least_rate = std::min(least_rate, p.per_second_of_budget());
    differ += p.fovea_differ;
    json["parts"].push_back({{"part", p.name},
                             {"ratio", p.ratio()},
                             {"ratio_chosen", p.ratio_chosen()},
                             {"drawn", p.drawn / p.compared},
                             {"drawn_without", p.whole_drawn / p.compared},
                             {"frames_per_second", p.per_second()},
                             {"slowest_ms", p.slowest()},
                             {"within_budget",
                              {{"frames_per_second", p.per_second_of_budget()},
                               {"error_pixels", p.budget_error},
                               {"pixel", p.budget_pixel},
                               {"samples", p.budget_samples}}},
                             {"segments", p.segments / p.compared},
                             {"layers", p.layers},
                             {"segments_without", p.whole_segments / p.compared},
                             {"fovea_pixels", p.fovea_pixels},
                             {"fovea_differ", p.fovea_differ},
                             {"milliseconds", {{"cull", p.cull}, {"draw", p.draw}, {"unite", p.unite}}},
                             {"covered", p.covered}});
    rows.push_back({p.name, fmt::format("{:.1f} at {:.1f}", p.per_second_of_budget(), p.budget_error),
                    fmt::format("{:.1f}", p.per_second()), fmt::format("{:.1f}", p.cull),
                    fmt::format("{:.1f}", p.draw), fmt::format("{:.1f}", p.unite),
                    fmt::format("{}", p.drawn / p.compared), fmt::format("{}", p.whole_drawn / p.compared),
                    fmt::format("{:.1f}", p.ratio()), fmt::format("{:.1f}", p.ratio_chosen()),
                    fmt::format("{} of {}", p.fovea_differ, p.fovea_pixels)});
  }
  json["ratio_min"] = least_ratio, json["frames_per_second_min"] = least_rate, json["fovea_differ"] = differ;
  console.print(json);
  console.say(fmt::format("{} neurons, {} segments, {}, {}", bench.forest().instances().size(),
                          bench.forest().segment_total(), options.size, bench.renderer()));
  console.table(
      {"camera and gaze", "frames/s at pixels of error", "frames/s at 1", "cull ms", "draw ms", "unite ms",
       "segments", "without gaze", "ratio", "of those chosen", "pixels of the fovea that differ"},
      rows);
}

}  // namespace

std::function<void()> bench_gaze(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--frames", options->frames, "Pictures of each part", 2, 100'000);
  add_whole(command, "--compared", options->compared,
            "Of them, how many are compared with those without a gaze", 1, 100'000);
  must_be_within(*command
                      .add_option("--slope", options->slope,
                                  "Arc minutes by which the smallest angle resolved grows a degree")
                      ->capture_default_str(),
                 .1, 60.);
  must_be_within(
      *command.add_option("--fovea", options->fovea, "Degrees around the gaze that are drawn in full")
           ->capture_default_str(),
      0., 90.);
  must_be_within(
      *command
           .add_option("--screen", options->screen,
                       "Degrees that the picture's height takes in the viewer's sight; 0: as many as "
                       "the field of view")
           ->capture_default_str(),
      0., 170.);
  command.add_option("--scanpath", options->scanpath,
                     "A recorded gaze (docs/scene/gaze.md); by default made up");
  command.add_option("--out", options->out, "A folder for the pictures compared");
  add_budget(command, options->budget);
  add_size(command, options->size);
  add_renderer(command, options->drawer);
  add_seed(command, options->seed, "Of the neurons, their places and the gaze made up");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
