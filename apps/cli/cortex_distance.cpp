// SPDX-License-Identifier: Apache-2.0
// brainforest cortex distance: how far two surfaces are from one another.
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/bounds.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/contours.h"
#include "forest/geometry/surface_distance.h"
#include "forest/io/surface.h"

#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path first, second, values;
  bool force = false;
};

Mesh read(const fs::path& path) {
  Mesh mesh = io::read_surface(MappedFile(path).text(), path.string());
  if (mesh.triangles.empty())
    throw InputError(path.string(), 0, "has no triangles, so nothing is near to it; name a surface");
  return mesh;
}

// What is a hundred times as large as the other, or as no brain is, is in other units.
void must_be_alike(const Options& o, const Mesh (&meshes)[2]) {
  constexpr double most = 100.;
  double size[2];
  for (const std::size_t i : {0u, 1u}) {
    Bounds bounds;
    for (const Vec3& p : meshes[i].positions) bounds.add(p);
    size[i] = double(bounds.extent().norm()) / 1e3;
    if (size[i] > cortex::largest_brain / 1e3)
      throw Error(fmt::format("{} reaches over {:.4g} m, as no brain does; give it in mm",
                              (i == 0 ? o.first : o.second).string(), size[i] / 1e3));
  }
  if (!(size[0] <= most * size[1] && size[1] <= most * size[0]))
    throw Error(fmt::format("{} reaches over {:.3g} mm and {} over {:.3g} mm; check that both are in mm",
                            o.first.string(), size[0], o.second.string(), size[1]));
}

void run(const Options& o, Console& console) {
  if (!o.values.empty()) must_take_files({o.values}, o.force);
  must_not_be_read("--values", o.values, {o.first, o.second});
  const Mesh meshes[] = {read(o.first), read(o.second)};
  must_be_alike(o, meshes);
  const TriangleTree trees[] = {TriangleTree(meshes[0]), TriangleTree(meshes[1])};
  const std::string names[] = {o.first.filename().string(), o.second.filename().string()};
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> table;
  for (const bool vertices : {false, true})
    for (const std::size_t from : {0u, 1u}) {
      const std::size_t to = 1 - from;
      const double share = area_each(meshes[from]);
      const auto places = vertices ? at_vertices(meshes[from]) : evenly_on(meshes[from], share);
      const Distances d = distances(places, trees[to]);
      if (vertices && from == 0 && !o.values.empty()) {
        std::vector<double> mm;
        for (const double each : d.each) mm.push_back(each / 1e3);
        write_file(o.values, io::write_surface_values("distance (mm)", mm));
      }
      const auto mm = [](double um) { return fmt::format("{:.3f}", um / 1e3); };
      out.push_back({{"from", names[from]},
                     {"to", names[to]},
                     {"places", vertices ? "vertices" : "evenly"},
                     {"each", vertices ? NAN : share / 1e6},
                     {"count", places.size()},
                     {"mean", d.mean / 1e3},
                     {"median", d.median / 1e3},
                     {"p95", d.p95 / 1e3},
                     {"greatest", d.greatest / 1e3},
                     {"farthest", {d.farthest.x() / 1e3, d.farthest.y() / 1e3, d.farthest.z() / 1e3}}});
      table.push_back({fmt::format("{} → {}", names[from], names[to]),
                       vertices ? "at its vertices"
                       : share == usual_area_each
                           ? "evenly, a place each .25 mm²"
                           : fmt::format("evenly, a place each {:.3g} mm²", share / 1e6),
                       fmt::format("{}", places.size()), mm(d.mean), mm(d.median), mm(d.p95), mm(d.greatest),
                       fmt::format("{:.1f} {:.1f} {:.1f}", d.farthest.x() / 1e3, d.farthest.y() / 1e3,
                                   d.farthest.z() / 1e3)});
    }
  console.print(out);
  console.table(
      {"from → to", "places", "count", "mean mm", "median mm", "p95 mm", "greatest mm", "there, mm"}, table);
}

}  // namespace

std::function<void()> cortex_distance(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  command.add_option("first", o->first, "A surface: GIFTI, FreeSurfer, PLY, STL or OBJ")
      ->required()
      ->type_name("A");
  command.add_option("second", o->second, "Another, in the same coordinates")->required()->type_name("B");
  command
      .add_option("--values", o->values,
                  "Text, the distance of each vertex of A from B in mm, as render --overlay takes it")
      ->type_name("FILE");
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
