// SPDX-License-Identifier: Apache-2.0
// brainforest cortex surfaces: contours of sections become the outer and the inner surface.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/surfaces.h"
#include "forest/geometry/isosurface.h"
#include "forest/io/surface.h"

#include "apps/cli/console.h"
#include "apps/cli/contour_files.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

// A stack may end before the tissue does: then what lies within its last section is about what lies within the one before.
void tell_flat_ends(const cortex::ContourStack& stack, const std::string& name, Console& console) {
  constexpr double alike = .75, some = .05;
  const auto object = std::uint32_t(std::ranges::find(stack.objects, name) - stack.objects.begin());
  std::vector<double> areas;
  for (const cortex::Section& section : stack.sections) {
    double& sum = areas.emplace_back(0.);
    for (const cortex::Contour& contour : section.contours)
      if (contour.object == object) sum += area(contour.curve);
  }
  const double most = *std::ranges::max_element(areas);
  const std::size_t last = areas.size() - 1;
  for (const auto& [end, next] : {std::pair(std::size_t(0), std::size_t(1)), std::pair(last, last - 1)})
    if (areas[end] > some * most && areas[end] > alike * areas[next])
      console.warn(fmt::format(
          "the {} section ({:.6g} mm) still has {:.3g} mm² within '{}', and the surfaces are closed flat "
          "behind it; if tissue goes on there, bring its sections in",
          end == 0 ? "first" : "last", stack.sections[end].at / 1e3, areas[end] / 1e6, name));
}

// What is wrong with a stack is told with its file.
cortex::Surfaces surfaces_of(const cortex::ContourStack& stack, const std::filesystem::path& file,
                             const cortex::SurfaceOptions& options, Progress& progress) {
  try {
    return cortex::surfaces_from(stack, options, progress);
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", file.string(), error.what()));
  }
}

}  // namespace

std::function<void()> cortex_surfaces(CLI::App& command, Console& console) {
  namespace fs = std::filesystem;
  struct Options {
    fs::path file;
    std::vector<fs::path> out;
    std::string outer = "outer", inner = "inner";
    double voxel = 0., margin = .02, error = .02, unit = 1.;
    std::uint32_t between = 2;
    bool force = false;
  };
  const auto o = std::make_shared<Options>();
  command.add_option("file", o->file, "Contours: .contours, .jser, .slc, or a folder of .svg")
      ->required()
      ->type_name("FILE");
  command
      .add_option("-o,--out", o->out, "The outer and the inner surface: GIFTI (.gii) or FreeSurfer's format")
      ->required()
      ->expected(2)
      ->type_name("OUTER INNER");
  command.add_option("--outer", o->outer, "The object that is the outer boundary")
      ->capture_default_str()
      ->type_name("NAME");
  command.add_option("--inner", o->inner, "The object that is the inner one")
      ->capture_default_str()
      ->type_name("NAME");
  must_be_within(
      *command.add_option("--voxel", o->voxel, "In the sections, mm; 0: a quarter of their distance")
           ->capture_default_str(),
      0., 100.);
  add_whole(command, "--between", o->between, "Layers of voxels from a section to the next", 1, 16);
  must_be_within(
      *command.add_option("--margin", o->margin, "What the outer surface keeps from the inner one, mm")
           ->capture_default_str(),
      1e-4, 1.);
  must_be_within(*command
                      .add_option("--error", o->error,
                                  "Triangles are made fewer, by no more than this off; mm; 0 keeps them all")
                      ->capture_default_str(),
                 0., 10.);
  must_be_within(*command.add_option("--unit", o->unit, "Of an .slc file, mm")->capture_default_str(), 1e-6,
                 1e3);
  add_force(command, o->force);
  return [o, &command, &console] {
    must_take_surfaces(o->out, o->force);
    for (const fs::path& out : o->out) must_not_be_read("--out", out, {o->file});
    if (o->outer == o->inner)
      throw Error(fmt::format(
          "'{}' is to be both boundaries; name the outer one by --outer, the inner one by --inner",
          o->outer));
    must_be_used(command,
                 {{"--unit", "of an .slc file, and none is given", extension_of(o->file) == ".slc"}});
    const cortex::ContourStack stack = read_contour_files(o->file, 1e3 * o->unit, console);
    // Coarser than the sections are apart, what they show is lost.
    if (const std::size_t sections = stack.sections.size(); sections > 1) {
      const double apart =
          std::abs(stack.sections.back().at - stack.sections.front().at) / double(sections - 1) / 1e3;
      if (o->voxel > 1.001 * apart)
        throw Error(
            fmt::format("--voxel {:g} mm is coarser than the sections, which are {:.3g} mm apart; give no "
                        "more than that, or leave it out",
                        o->voxel, apart));
    }
    const cortex::Surfaces made = surfaces_of(stack, o->file,
                                              {.voxel = 1e3 * o->voxel,
                                               .between = int(o->between),
                                               .margin = 1e3 * o->margin,
                                               .error = 1e3 * o->error,
                                               .outer = o->outer,
                                               .inner = o->inner},
                                              console.progress());
    write_unless_there({{o->out[0], io::write_surface(made.outer, o->out[0].string())},
                        {o->out[1], io::write_surface(made.inner, o->out[1].string())}},
                       true);
    tell_flat_ends(stack, o->outer, console);
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    std::vector<std::vector<std::string>> table;
    const auto tell = [&](const fs::path& path, const Mesh& mesh, std::size_t cut,
                          const cortex::Unjoined& unjoined, const std::string& object) {
      constexpr double much = .01;
      if (unjoined.share > much)
        console.warn(
            fmt::format("section {} ({:.6g} mm): {:.3g} mm² within '{}' hang together with nothing and are "
                        "not in {}; look at "
                        "the contours there, or for one that is missing before or behind",
                        unjoined.section + 1, stack.sections[unjoined.section].at / 1e3, unjoined.area / 1e6,
                        object, path.string()));
      rows.push_back({{"file", path.string()},
                      {"vertices", mesh.positions.size()},
                      {"triangles", mesh.triangles.size()},
                      {"euler", euler_number(mesh)},
                      {"volume", volume(mesh) / 1e9},
                      {"area", area(mesh) / 1e6},
                      {"cut_voxels", cut},
                      {"unjoined",
                       {{"section", unjoined.section + 1},
                        {"at", stack.sections[unjoined.section].at / 1e3},
                        {"area", unjoined.area / 1e6}}}});
      table.push_back({path.string(), std::to_string(mesh.positions.size()),
                       std::to_string(mesh.triangles.size()), std::to_string(1 - euler_number(mesh) / 2),
                       fmt::format("{:.1f}", volume(mesh) / 1e9), fmt::format("{:.1f}", area(mesh) / 1e6),
                       std::to_string(cut)});
    };
    tell(o->out[0], made.outer, made.outer_cut, made.outer_unjoined, o->outer);
    tell(o->out[1], made.inner, made.inner_cut, made.inner_unjoined, o->inner);
    console.print({{"surfaces", rows},
                   {"pushed_voxels", made.pushed},
                   {"opened_voxels", made.opened},
                   {"triangles_before", made.triangles}});
    console.table({"file", "vertices", "triangles", "genus", "volume mm³", "area mm²", "voxels cut"}, table);
  };
}

}  // namespace forest::cli
