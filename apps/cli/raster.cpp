// SPDX-License-Identifier: Apache-2.0
// brainforest raster: time × neuron in colours of the voltage at the soma, as figure 2 of de Heras Ciechomski & Mange 2007.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/round_numbers.h"
#include "forest/io/png.h"
#include "forest/reports/activity.h"
#include "forest/scene/colour_bar.h"

#include "apps/cli/artist.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::filesystem::path file, out;
  std::string size = "1200x800";
  double from = -INFINITY, to = INFINITY;  // ms
  std::vector<float> range;                // empty: as a picture of the forest would show
  std::string map = scene::colour_maps().front().name;
  bool plain = false;
};

using Colour = std::array<std::uint8_t, 3>;

Colour colour_of(const scene::ColourMap& map, float value, float low, float high) {
  if (std::isnan(value)) return {128, 128, 128};
  const Vec3 screen = 255.f * map.screen((value - low) / (high - low));
  return {std::uint8_t(std::lround(screen.x())), std::uint8_t(std::lround(screen.y())),
          std::uint8_t(std::lround(screen.z()))};
}

// Ticks at round numbers, at least so many pixels apart.
float tick_step(double units_a_pixel, float apart) {
  return float(round_below(2.5 * units_a_pixel * double(apart)));
}

// What lies around a raster: neurons down its left side, ms below, and what its colours mean.
class Axes {
 public:
  Axes(std::uint32_t width, std::uint32_t height, std::span<const reports::Row> neurons)
      : image_{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 4, 255), 0.},
        neurons_(neurons) {
    std::uint32_t last = 0;
    for (const reports::Row& neuron : neurons) last = std::max(last, neuron.instance);
    const float h = letters_.height =
        std::max(7.f, std::round(std::min(float(height) / 60.f, float(width) / 40.f)));
    left_ = std::uint32_t(std::ceil(letters_.width(std::to_string(last)) + 3.f * h));
    top_ = std::uint32_t(3.f * h), right_ = std::uint32_t(2.f * h), bottom_ = std::uint32_t(8.f * h);
    if (width < left_ + right_ + std::uint32_t(24.f * h) || height < top_ + bottom_ + 16)
      throw Error(fmt::format("a picture of {}x{} leaves no room for axes; give a larger --size, or --plain",
                              width, height));
  }
  std::uint32_t width() const { return image_.width - left_ - right_; }  // of the raster
  std::uint32_t height() const { return image_.height - top_ - bottom_; }

  const frame::Image& around(std::span<const std::uint8_t> raster, double from, double to,
                             const scene::ColourBar& bar) {
    for (std::uint32_t y = 0; y < height(); ++y)
      std::ranges::copy(raster.subspan(std::size_t(4) * y * width(), std::size_t(4) * width()),
                        &image_.pixels[4 * (std::size_t(top_ + y) * image_.width + left_)]);
    const float h = letters_.height, thin = std::max(1.f, std::round(.12f * h)), x0 = float(left_),
                y0 = float(top_), y1 = y0 + float(height());
    letters_.write(image_, "neuron", x0, y0 - h);
    const double each = double(height()) / double(neurons_.size());  // pixels
    for (float n = 0.f, step = std::max(1.f, tick_step(1. / each, 2.5f * h)); n < float(neurons_.size());
         n += step) {
      const float y = y0 + float((double(n) + .5) * each);
      const std::string label = std::to_string(neurons_[std::size_t(n)].instance);
      scene::fill(image_, {x0 - .7f * h, y - .5f * thin, x0, y + .5f * thin}, letters_.colour);
      letters_.write(image_, label, x0 - h - letters_.width(label), std::max(y, y0 + .4f * h) + .5f * h);
    }
    const double ms = (to - from) / double(width());  // a pixel
    const double step = double(tick_step(ms, 9.f * h));
    for (double i = std::ceil(from / step - 1e-9); i * step <= to * (1. + 1e-12); i += 1.) {
      const float x = x0 + float((i * step - from) / ms);
      const std::string label = fmt::format("{:.6g}", i == 0. ? 0. : i * step);
      scene::fill(image_, {x - .5f * thin, y1, x + .5f * thin, y1 + .7f * h}, letters_.colour);
      letters_.write(image_, label, x - .5f * letters_.width(label), y1 + 2.2f * h);
    }
    const float base = y1 + 5.4f * h, end = x0 + float(width());
    letters_.write(image_, "time, ms", x0, base);
    const float units = end - letters_.width(bar.units);
    letters_.write(image_, bar.units, units, base);
    const float last = units - h;
    paint(image_, bar, {std::max(x0 + 10.f * h, last - 24.f * h), base - 1.1f * h, last, base + .1f * h},
          letters_);
    return image_;
  }

 private:
  frame::Image image_;
  std::span<const reports::Row> neurons_;  // from the top
  scene::Lettering letters_{.colour = {.13f, .16f, .20f}};
  std::uint32_t left_ = 0, top_ = 0, right_ = 0, bottom_ = 0;
};

void run(const Options& options, Console& console) {
  must_take(options.out, png_picture);
  auto [width, height] = parse_size(options.size);
  if (!options.range.empty() && !(options.range[0] < options.range[1]))
    throw Error(fmt::format("colours from {} to {} show nothing; give the lower end first", options.range[0],
                            options.range[1]));
  const auto activity = reports::Activity::open(options.file);
  const reports::Facts& facts = activity.facts();
  if (facts.not_numbers == activity.width(reports::Level::compartment) * facts.steps)
    throw InputError(options.file.string(), 0,
                     "holds no value that is a number, so a raster would be grey; spikes alone are drawn by "
                     "'brainforest render "
                     "--activity'");
  const auto step_at = [&](double ms) {
    return std::uint64_t(
        std::clamp(std::ceil((ms - facts.start) / facts.step - 1e-6), 0., double(facts.steps)));
  };
  const reports::Range shown =
      options.range.empty() ? facts.shown() : reports::Range{options.range[0], options.range[1]};
  const std::uint64_t begin = step_at(options.from), end = step_at(options.to);
  if (begin >= end)
    throw Error(fmt::format("{:g} to {:g} ms holds no step; the simulation runs from {:g} to {:g} ms",
                            options.from, options.to, facts.start, facts.time(facts.steps)));
  std::optional<Axes> axes;
  if (!options.plain) {
    axes.emplace(width, height, activity.rows());
    width = axes->width(), height = axes->height();
  }
  const auto codes = activity.raster_picture(begin, end, width, height);
  const scene::ColourMap& map = *scene::find_colour_map(options.map);
  std::array<Colour, 256> colours;
  for (std::size_t code = 0; code < colours.size(); ++code)
    colours[code] = colour_of(map, facts.range.value(reports::Code(code)), shown.low, shown.high);
  std::vector<std::uint8_t> pixels;
  pixels.reserve(4 * codes.size());
  for (const reports::Code code : codes) {
    pixels.insert(pixels.end(), colours[code].begin(), colours[code].end());
    pixels.push_back(255);
  }
  const double first = facts.time(begin), last = facts.time(end);
  if (axes) {
    const frame::Image& image = axes->around(
        pixels, first, last, {.map = &map, .low = shown.low, .high = shown.high, .units = facts.units});
    io::write_png(options.out, image.width, image.height, image.pixels);
  } else {
    io::write_png(options.out, width, height, pixels);
  }
  console.print({{"file", options.out.string()},
                 {"neurons", activity.rows().size()},
                 {"from", first},
                 {"to", last},
                 {"steps", end - begin},
                 {"range", {shown.low, shown.high}},
                 {"map", map.name},
                 {"units", facts.units}});
  console.table({"picture", "neurons (down)", "ms (to the right)", "colours"},
                {{options.out.string(), std::to_string(activity.rows().size()),
                  fmt::format("{:g} to {:g}", first, last),
                  fmt::format("{:g} to {:g} {}, {}", shown.low, shown.high, facts.units, map.name)}});
}

}  // namespace

std::function<void()> raster(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("activity", options->file, "Activity file")->required();
  add_size(command, options->size);
  constexpr double furthest = 1e15;  // ms
  must_be_within(
      *command.add_option("--from", options->from, "The first time that is shown, ms; by default all"),
      -furthest, furthest);
  must_be_within(*command.add_option("--to", options->to, "The time before which it ends, ms"), -furthest,
                 furthest);
  command
      .add_option(
          "--range", options->range,
          "Values at the ends of the colours; by default -80 to 20 mV, of other units all that is kept")
      ->expected(2)
      ->type_name("LOW HIGH");
  std::vector<std::string> maps;
  for (const scene::ColourMap& map : scene::colour_maps()) maps.push_back(map.name);
  command.add_option("--map", options->map, "Colour map")->check(CLI::IsMember(maps))->capture_default_str();
  command.add_flag("--plain", options->plain, "The colours alone, without axes");
  command.add_option("-o,--out", options->out, "The picture, a PNG file")->required();
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
