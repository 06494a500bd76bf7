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
};

// viridis (Smith & van der Walt 2015), perceptually even; what has no value is grey, which it never is.
constexpr std::array<std::uint32_t, 10> ramp{0x440154, 0x482878, 0x3E4A89, 0x31688E, 0x26828E,
                                             0x1F9E89, 0x35B779, 0x6DCD59, 0xB4DE2C, 0xFDE725};
constexpr std::uint32_t nothing = 0x808080;

using Colour = std::array<std::uint8_t, 3>;
Colour bytes_of(std::uint32_t rgb) {
  return {std::uint8_t(rgb >> 16), std::uint8_t(rgb >> 8), std::uint8_t(rgb)};
}

Colour colour_of(float value, float low, float high) {
  if (std::isnan(value)) return bytes_of(nothing);
  const float at = std::clamp((value - low) / (high - low), 0.f, 1.f) * float(ramp.size() - 1);
  const std::size_t i = std::min<std::size_t>(std::size_t(at), ramp.size() - 2);
  const Colour a = bytes_of(ramp[i]), b = bytes_of(ramp[i + 1]);
  Colour mixed;
  for (std::size_t c = 0; c < 3; ++c)
    mixed[c] = std::uint8_t(std::lround(float(a[c]) + (at - float(i)) * (float(b[c]) - float(a[c]))));
  return mixed;
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
  std::array<Colour, 256> colours;
  for (std::size_t code = 0; code < colours.size(); ++code)
    colours[code] = colour_of(facts.range.value(reports::Code(code)), options.range[0], options.range[1]);
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
                 {"units", facts.units}});
  console.table(
      {"picture", "neurons (down)", "ms (to the right)", "colours"},
      {{options.out.string(), std::to_string(activity.rows().size()),
        fmt::format("{:g} to {:g}", first, last),
        fmt::format("{:g} to {:g} {}, purple to yellow", options.range[0], options.range[1], facts.units)}});
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
  command.add_option("-o,--out", options->out, "The picture, a PNG file")->required();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
