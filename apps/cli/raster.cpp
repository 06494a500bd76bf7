// SPDX-License-Identifier: Apache-2.0
// brainforest raster: time × neuron in colours of the voltage at the soma, as figure 2 of de Heras Ciechomski & Mange 2007.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/io/png.h"
#include "forest/reports/activity.h"
#include "forest/scene/colour_map.h"

#include "apps/cli/artist.h"
#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::filesystem::path file, out;
  std::string size = "1200x800";
  double from = -INFINITY, to = INFINITY;  // ms
  std::vector<float> range{-80.f, 20.f};
  std::string map = "viridis";
};

using Colour = std::array<std::uint8_t, 3>;

Colour colour_of(const scene::ColourMap& map, float value, float low, float high) {
  if (std::isnan(value)) return {128, 128, 128};
  const Vec3 screen = 255.f * map.screen((value - low) / (high - low));
  return {std::uint8_t(std::lround(screen.x())), std::uint8_t(std::lround(screen.y())),
          std::uint8_t(std::lround(screen.z()))};
}

void run(const Options& options, Console& console) {
  const auto [width, height] = parse_size(options.size);
  if (!(options.range[0] < options.range[1]))
    throw Error(fmt::format("colours from {} to {} show nothing; give the lower end first", options.range[0],
                            options.range[1]));
  const auto activity = reports::Activity::open(options.file);
  const reports::Facts& facts = activity.facts();
  const auto step_at = [&](double ms) {
    return std::uint64_t(
        std::clamp(std::ceil((ms - facts.start) / facts.step - 1e-6), 0., double(facts.steps)));
  };
  const std::uint64_t begin = step_at(options.from), end = step_at(options.to);
  if (begin >= end)
    throw Error(fmt::format("{} to {} ms holds no step; the simulation runs from {} to {} ms", options.from,
                            options.to, facts.start, facts.time(facts.steps)));
  const auto codes = activity.raster_picture(begin, end, width, height);
  const scene::ColourMap& map = *scene::find_colour_map(options.map);
  std::array<Colour, 256> colours;
  for (std::size_t code = 0; code < colours.size(); ++code)
    colours[code] =
        colour_of(map, facts.range.value(reports::Code(code)), options.range[0], options.range[1]);
  std::vector<std::uint8_t> pixels;
  pixels.reserve(4 * codes.size());
  for (const reports::Code code : codes) {
    pixels.insert(pixels.end(), colours[code].begin(), colours[code].end());
    pixels.push_back(255);
  }
  io::write_png(options.out, width, height, pixels);
  const double first = facts.time(begin), last = facts.time(end);
  console.print({{"file", options.out.string()},
                 {"neurons", activity.rows().size()},
                 {"from", first},
                 {"to", last},
                 {"steps", end - begin},
                 {"range", options.range},
                 {"map", map.name},
                 {"units", facts.units}});
  console.table(
      {"picture", "neurons (down)", "ms (to the right)", "colours"},
      {{options.out.string(), std::to_string(activity.rows().size()),
        fmt::format("{:g} to {:g}", first, last),
        fmt::format("{:g} to {:g} {}, {}", options.range[0], options.range[1], facts.units, map.name)}});
}

}  // namespace

std::function<void()> raster(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("activity", options->file, "Activity file")->required();
  add_size(command, options->size);
  command.add_option("--from", options->from, "The first time that is shown, ms; by default all");
  command.add_option("--to", options->to, "The time before which it ends, ms");
  command.add_option("--range", options->range, "Values at the ends of the colours")
      ->expected(2)
      ->capture_default_str()
      ->type_name("LOW HIGH");
  std::vector<std::string> maps;
  for (const scene::ColourMap& map : scene::colour_maps()) maps.push_back(map.name);
  command.add_option("--map", options->map, "Colour map")->check(CLI::IsMember(maps))->capture_default_str();
  command.add_option("-o,--out", options->out, "The picture, a PNG file")->required();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
