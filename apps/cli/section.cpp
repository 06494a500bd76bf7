// SPDX-License-Identifier: Apache-2.0
// brainforest section: what a plane cuts of a forest, as a picture, as contours, as a table of areas, or as a film of the plane
// moving through.
#include <charconv>
#include <cmath>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/film.h"
#include "forest/io/png.h"
#include "forest/io/workbook.h"
#include "forest/morphology/morphology.h"
#include "forest/scene/slice_picture.h"
#include "forest/scene/view.h"

#include "apps/cli/artist.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/target_options.h"
#include "apps/cli/verb.h"
#include "apps/forest_files.h"

namespace forest::cli {
namespace {

struct Options {
  std::filesystem::path forest, out;
  std::string plane, size = "1280x960", centre;
  Look look{.background = scene::Background::light, .colour_by = {}};
  double height = 0.;  // µm; 0: all of it
  double depth = 0., seconds = 5.;
  int rate = 25;
  bool force = false;
  TargetOptions targets;
};

/// Numbers between commas; throws Error.
std::vector<float> numbers_of(const std::string& text, std::size_t count, const char* meant) {
  std::vector<float> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    float number = 0.f;
    const auto [rest, error] = std::from_chars(at, end, number);
    if (error != std::errc() || !std::isfinite(number)) break;
    numbers.push_back(number);
    at = rest;
    if (at == end || *at != ',') break;
    ++at;
  }
  if (at != end || numbers.size() != count) throw Error(fmt::format("'{}' is not {}", text, meant));
  return numbers;
}

Plane plane_of(const std::string& text, const scene::Forest& forest) {
  if (text.empty()) {
    if (forest.soma_bounds().empty())
      throw Error("the forest has no neurons, so there is no middle to cut; give --plane");
    return Plane::through(forest.soma_bounds().centre(), scene::standing(forest).col(2), forest.circuit().up);
  }
  const auto n = numbers_of(text, 6, "x,y,z,nx,ny,nz: a point of the plane in µm and its normal");
  const Vec3 normal(n[3], n[4], n[5]);
  if (!(normal.norm() > 1e-6f * normal.cwiseAbs().sum()) || normal.isZero())
    throw Error(fmt::format("'{}' has no direction: its last three numbers are the normal", text));
  return Plane::through({n[0], n[1], n[2]}, normal, forest.circuit().up);
}

std::string csv_of(const scene::Forest& forest, const std::vector<scene::ProfileArea>& areas) {
  io::TableSheet sheet{
      .name = "section",
      .columns = {{"neuron", ""}, {"type", ""}, {"layer", ""}, {"kind", ""}, {"profiles", ""}, {"area", ""}},
      .rows = {}};
  for (const scene::ProfileArea& a : areas)
    sheet.rows.push_back({std::int64_t(a.instance), forest.circuit().types[forest.types()[a.instance]].name,
                          forest.circuit().layers[forest.layers()[a.instance]].name,
                          std::string(a.kind == 1 ? "soma" : name_of(SectionKind(a.kind))),
                          std::int64_t(a.profiles), a.area});
  return io::csv_of(sheet);
}

void film(const Options& options, const scene::Forest& forest, const Plane& plane,
          const scene::Colouring& colouring, const scene::SlicePicture& picture, Console& console) {
  const int count = std::max(2, int(std::lround(options.seconds * options.rate)));
  io::Film film(options.out, picture.width_pixels, picture.height_pixels, options.rate);
  const auto slice_at = [&](float share) {
    return scene::visible(scene::slice(forest, plane.moved(float(options.depth) * share), picture.sheet()),
                          colouring);
  };
  constexpr int looks = 8;
  scene::Arrangement places;  // of the scale bar, where it hides least in all of the film
  for (int i = 0; i < looks; ++i)
    scene::look_at(slice_at((float(i) + .5f) / float(looks)), colouring, picture, places);
  console.progress().begin("filming", std::size_t(count));
  for (int i = 0; i < count; ++i) {
    film.add(scene::paint(slice_at(float(i) / float(count - 1)), colouring, picture, places).pixels);
    console.progress().advance();
  }
  film.finish();
  console.progress().end();
  console.print({{"file", options.out.string()}, {"pictures", count}, {"codec", film.codec()}});
  console.table({"film", "pictures", "through", "codec"},
                {{options.out.string(), fmt::format("{}", count), fmt::format("{:g} µm", options.depth),
                  film.codec()}});
}

// All that the plane cuts, on its way too, and a margin.
scene::Sheet all_of(const scene::Forest& forest, const Plane& plane, double depth) {
  constexpr double margin = 20.;  // µm
  scene::Sheet all = scene::sheet_of(forest, plane);
  for (const double share : {0., .5, 1.}) {
    if (share > 0. && depth == 0.) break;
    const scene::Sheet cut = scene::bounds_of(scene::slice(forest, plane.moved(float(share * depth))));
    all.low = all.low.cwiseMin(cut.low - Place::Constant(margin));
    all.high = all.high.cwiseMax(cut.high + Place::Constant(margin));
  }
  return all;
}

void run(const Options& options, Console& console) {
  const std::string extension = options.out.extension().string();
  if (extension == ".png") must_take(options.out, png_picture);
  if (extension == ".mp4") must_take(options.out, mp4_film), must_have_ground(*options.look.background);
  must_have_folder(options.out);
  if (extension == ".mp4" && options.depth == 0.)
    throw Error("a film moves the plane; say how far by --through, in µm");
  if (const auto [width, height] = parse_size(options.size); extension == ".mp4" && (width % 2 || height % 2))
    throw Error(fmt::format("{} is no size of a film; width and height must be even", options.size));
  if (extension == ".csv" && (options.height > 0. || !options.centre.empty()))
    throw Error("--height and --centre are of pictures; a table tells of all that the plane cuts");
  const scene::Forest forest = open_forest(options.forest);
  const Plane plane = plane_of(options.plane, forest);
  scene::View view;
  options.look.put_on(view);
  scene::SlicePicture picture{.background = view.background};
  std::tie(picture.width_pixels, picture.height_pixels) = parse_size(options.size);
  const scene::Sheet all =
      options.height > 0. ? scene::sheet_of(forest, plane) : all_of(forest, plane, options.depth);
  const Place extent = all.high - all.low;
  picture.height = options.height > 0.
                       ? options.height
                       : std::max(extent.y(), extent.x() * picture.height_pixels / picture.width_pixels);
  // The plane's own point lies in the middle; of the whole, the forest does.
  picture.centre = options.height > 0. ? Place(0., 0.) : Place(.5 * (all.low + all.high));
  if (!options.centre.empty()) {
    const auto c = numbers_of(options.centre, 2, "two numbers, µm along the section's right and up");
    picture.centre = {double(c[0]), double(c[1])};
  }
  add_appearances(options.targets, view.targets);
  const scene::Targets targets(forest, read_node_sets(forest, options.targets.node_sets, console));
  warn_of_empty(targets, view.targets, console);
  const scene::Colouring colouring = scene::colour(targets, view);
  if (extension == ".mp4") return film(options, forest, plane, colouring, picture, console);
  if (options.depth != 0.) throw Error("--through makes a film; give its name with the ending .mp4");

  // A table tells of all that the plane cuts, a picture of what is in it.
  const bool table = extension == ".csv";
  const scene::Slice slice =
      scene::visible(scene::slice(forest, plane, table ? scene::Sheet{} : picture.sheet()), colouring);
  const auto areas = scene::areas(slice);
  if (table)
    write_unless_there(options.out, csv_of(forest, areas), options.force);
  else if (extension == ".svg")
    write_unless_there(options.out, scene::to_svg(slice, colouring, picture), options.force);
  else
    io::write_png(options.out, picture.width_pixels, picture.height_pixels,
                  scene::paint(slice, colouring, picture).pixels);
  if (slice.profiles.empty())
    console.warn(
        "the plane cuts no neuron where one looks; without --plane, --centre and --height it goes through "
        "the middle of the forest, and --only and --hide leave neurons out");
  double total = 0.;
  std::size_t neurons = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    total += areas[i].area;
    neurons += i == 0 || areas[i].instance != areas[i - 1].instance;
  }
  console.print({{"file", options.out.string()},
                 {"neurons", neurons},
                 {"profiles", slice.profiles.size()},
                 {"area", total},
                 {"micrometres_a_pixel", picture.pixel()}});
  console.table({"section", "neurons cut", "profiles", "their area, µm²"},
                {{options.out.string(), fmt::format("{}", neurons), fmt::format("{}", slice.profiles.size()),
                  fmt::format("{:.2f}", total)}});
}

}  // namespace

std::function<void()> section(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("forest", options->forest, "Forest file")->required();
  command
      .add_option(
          "--plane", options->plane,
          "A point of the plane and its normal, x,y,z,nx,ny,nz (µm); by default across z through the middle")
      ->type_name("X,Y,Z,NX,NY,NZ");
  add_size(command, options->size);
  must_be_within(
      *command.add_option("--height", options->height,
                          "Height of the picture in µm, its middle the plane's point; by default all "
                          "of the forest is in it"),
      .01, 1e6);
  command
      .add_option("--centre", options->centre,
                  "The middle of the picture, µm along the section's right and up")
      ->type_name("RIGHT,UP");
  add_targets(command, options->targets);
  add_look(command, options->look, "light, as in electron micrographs", "type");
  must_be_within(*command.add_option("--through", options->depth,
                                     "How far the plane moves along its normal in a film, µm"),
                 -1e6, 1e6);
  must_be_within(
      *command.add_option("--seconds", options->seconds, "Length of the film")->capture_default_str(), .04,
      3600.);
  must_be_whole(*command.add_option("--fps", options->rate, "Pictures a second")->capture_default_str(), 1,
                120);
  command
      .add_option("-o,--out", options->out,
                  "A picture (.png), contours (.svg), areas by neuron and kind (.csv) or a film (.mp4)")
      ->required()
      ->check([](const std::string& name) -> std::string {
        const std::string ending = std::filesystem::path(name).extension().string();
        return ending == ".png" || ending == ".svg" || ending == ".csv" || ending == ".mp4"
                   ? ""
                   : "give a file ending in .png, .svg, .csv or .mp4";
      });
  add_force(command, options->force);
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
