// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/surface_options.h"

#include <cmath>
#include <cstdlib>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/error.h"
#include "forest/core/number.h"

#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/surface_files.h"

namespace forest::cli {
namespace {

std::string map_names() {
  std::string names;
  for (const scene::ColourMap& map : scene::colour_maps())
    names += (names.empty() ? "" : ", ") + std::string(map.name);
  return names;
}

// "low:high"
std::pair<float, float> parse_range(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto number = [](std::string_view part) { return number_of<float>(part).value_or(NAN); };
  const float low = number(std::string_view(text).substr(0, colon)),
              high = colon == text.npos ? NAN : number(std::string_view(text).substr(colon + 1));
  if (!(std::isfinite(low) && std::isfinite(high) && low < high))
    throw Error(
        fmt::format("'{}' is no range; give the values at both ends of the colour map, the lower one "
                    "first, for example --range 1.5:4",
                    text));
  return {low, high};
}

}  // namespace

void add_surfaces(CLI::App& command, SurfaceOptions& options) {
  const auto each = [](CLI::Option* option) {  // one at a time
    return option->allow_extra_args(false)->option_text(option->get_type_name() + ", again for each");
  };
  each(command.add_option(
      "--surface", options.files,
      "Surface of a cortex to show, too: GIFTI (.surf.gii), FreeSurfer (lh.pial), PLY, STL or OBJ, in mm"));
  must_be_within(*each(command.add_option(
                     "--surface-opacity", options.opacities,
                     "How opaque surfaces are, 0 to 1, in their order; the last holds for all that follow")),
                 0., 1.);
  each(command.add_option(
      "--overlay", options.overlays,
      "Values or areas that colour the surfaces, in their order: GIFTI (.shape.gii, .func.gii, .label.gii), "
      "FreeSurfer (lh.thickness, lh.curv, lh.aparc.annot), or text of a value a line"));
  command.add_option("--colour-map", options.map, "Of the values: " + map_names());
  command.add_option("--range", options.range,
                     "Values at the ends of the colour map, LOW:HIGH; by default nearly all are within");
}

scene::Surfaces read_surfaces(const SurfaceOptions& options, Console& console) {
  scene::Surfaces surfaces;
  if (!options.map.empty()) {
    surfaces.map = scene::find_colour_map(options.map);
    if (!surfaces.map)
      throw Error(fmt::format("there is no colour map '{}'; give one of {}", options.map, map_names()));
  }
  if (!options.range.empty()) surfaces.range = parse_range(options.range);
  if (options.overlays.empty() && !(options.map.empty() && options.range.empty()))
    console.warn("--colour-map and --range are of the values of --overlay, and none is given");
  if (const auto quantities =
          forest::add_surfaces(surfaces, {options.files, options.overlays, options.opacities});
      quantities.size() > 1)
    console.warn(
        fmt::format("the overlays are of {}, and share one colour bar with one range; draw a picture of each",
                    fmt::join(quantities, " and ")));
  if (options.opacities.size() > options.files.size())
    console.warn(fmt::format("{} of the opacities belong to no surface",
                             options.opacities.size() - options.files.size()));
  return surfaces;
}

}  // namespace forest::cli
