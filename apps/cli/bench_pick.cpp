// SPDX-License-Identifier: Apache-2.0
// brainforest bench pick: random pixels of pictures from outside the column to within it. Is what lies under each what a
// plain loop over all segments finds, and how many picks are made in a second? What "under" means: forest/scene/pick.h.
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/random.h"
#include "forest/scene/path.h"
#include "forest/scene/pick.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::uint32_t neurons = 1000, pixels = 10000;
  std::uint64_t seed = 1;
  std::string size = "1280x720";
};

void run(const Options& options, Console& console) {
  const auto [width, height] = parse_size(options.size);
  const frame::Viewport viewport{float(width), float(height)};
  const scene::Forest forest = grown_column(options.neurons, options.seed, console);
  const scene::CameraPath path = scene::walk(forest);
  Random random(options.seed);
  constexpr std::uint32_t views = 8;  // from outside to within; every other one orthographic
  std::uint64_t right = 0, wrong = 0, something = 0;
  double picking = 0., plain = 0.;
  std::string first_wrong;
  console.progress().begin("picking", views);
  for (std::uint32_t v = 0; v < views; ++v) {
    frame::Camera camera = path.at(float(v / 2) / float(views / 2 - 1)).camera;
    if (v % 2) camera.projection = frame::Projection::orthographic;
    std::vector<Vec2> places;
    for (std::uint32_t i = options.pixels * v / views; i < options.pixels * (v + 1) / views; ++i)
      places.emplace_back(float(random.below(width)) + .5f, float(random.below(height)) + .5f);
    auto start = Clock::now();
    std::vector<std::optional<scene::Pick>> found;
    for (const Vec2& place : places) found.push_back(scene::pick(forest, camera, viewport, place));
    picking += seconds_since(start);
    start = Clock::now();
    const auto expected = scene::plain_picks(forest, camera, viewport, places);
    plain += seconds_since(start);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto &a = found[i], &b = expected[i];
      const bool same = a && b ? a->instance == b->instance && a->segment == b->segment : !a && !b;
      ++(same ? right : wrong);
      something += b.has_value();
      const auto told = [](const auto& pick) {
        return pick ? fmt::format("neuron {} segment {} at {:.9g} µm", pick->instance, pick->segment,
                                  pick->distance)
                    : std::string("nothing");
      };
      if (!same && first_wrong.empty())
        first_wrong = fmt::format("view {}, pixel {:g}, {:g}: {}, where the plain loop finds {}", v,
                                  places[i].x(), places[i].y(), told(a), told(b));
    }
    console.progress().advance();
  }
  console.progress().end();
  if (!something) throw Error("no pixel shows a branch: nothing was measured; give more --pixels");
  const double total = double(right + wrong);
  console.print({{"right", double(right) / total},
                 {"picks_per_second", total / picking},
                 {"pixels", right + wrong},
                 {"wrong", wrong},
                 {"first_wrong", first_wrong},
                 {"something", double(something) / total},
                 {"plain_seconds", plain},
                 {"neurons", forest.instances().size()},
                 {"segments", forest.segment_total()},
                 {"size", options.size}});
  console.say(fmt::format("{} neurons, {} segments, {}", forest.instances().size(), forest.segment_total(),
                          options.size));
  console.table({"pixels", "right", "that show something", "picks/s, one thread", "plain loop"},
                {{fmt::format("{}", right + wrong), fmt::format("{:.2f} %", 100. * double(right) / total),
                  fmt::format("{:.0f} %", 100. * double(something) / total),
                  fmt::format("{:.0f}", total / picking), fmt::format("{:.1f} s", plain)}});
  if (wrong)
    throw Error(fmt::format("{} of {:.0f} picks are wrong; the first: {}", wrong, total, first_wrong));
}

}  // namespace

std::function<void()> bench_pick(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--pixels", options->pixels, "Random pixels, of eight pictures in equal parts", 8,
            10'000'000);
  add_size(command, options->size);
  add_seed(command, options->seed, "Of the neurons, their places and the pixels");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
