// SPDX-License-Identifier: Apache-2.0
// brainforest bench sections: two surfaces are cut into sections, drawn as curves, and made again from the sections. How few
// curves are there, and how far are the surfaces that come back from those that were cut?
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/file.h"
#include "forest/cortex/surfaces.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/self_intersection.h"
#include "forest/geometry/surface_distance.h"
#include "forest/io/surface.h"

#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::filesystem::path outer, inner;
  double spacing = 1., voxel = 0., error = .02;
  bool curves = false;
};

void run(const Options& options, Console& console) {
  const auto read = [](const std::filesystem::path& path) {
    return io::read_surface(MappedFile(path).text(), path.string());
  };
  const Mesh given[] = {read(options.outer), read(options.inner)};
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Vec3& p : given[0].positions)
    low = std::min(low, double(p.y())), high = std::max(high, double(p.y()));
  const auto planes = cortex::planes_between(low, high, 1e3 * options.spacing);
  const cortex::ContourStack stacks[] = {cortex::cut(given[0], "outer", cortex::Axis::y, planes),
                                         cortex::cut(given[1], "inner", cortex::Axis::y, planes)};
  nlohmann::ordered_json out{{"sections", planes.size()}};
  std::vector<std::vector<std::string>> table;
  for (const cortex::ContourStack& stack : stacks) {
    if (!options.curves) break;
    cortex::FitSummary fit;
    (void)cortex::fitted(stack, {}, fit, console.progress());
    const double each = fit.length / 1e3 / double(fit.pieces);
    out["curves"].push_back(
        {{"object", stack.objects[0]}, {"rms", fit.rms / 1e3}, {"length_per_cubic", each}});
    table.push_back({stack.objects[0] + " curves", fmt::format("rms {:.4f} mm", fit.rms / 1e3),
                     fmt::format("{:.2f} mm a cubic", each), ""});
  }
  const auto start = Clock::now();
  const cortex::Surfaces made =
      cortex::surfaces_from(cortex::together(stacks),
                            {.voxel = 1e3 * options.voxel, .error = 1e3 * options.error}, console.progress());
  out["seconds"] = seconds_since(start);
  out["triangles_before"] = made.triangles;
  Mesh both = made.outer;
  append(both, made.inner);
  out["triangles"] = both.triangles.size(), out["triangles_cut"] = count_cut_triangles(both);
  for (const int i : {0, 1}) {
    const Mesh& mesh = i == 0 ? made.outer : made.inner;
    const TriangleTree tree(mesh);
    const Distances to = distances(evenly_on(mesh), TriangleTree(given[i])),
                    from = distances(evenly_on(given[i]), tree),
                    vertices = distances(at_vertices(given[i]), tree);
    const auto figures = [](const Distances& d) {
      return nlohmann::ordered_json{{"mean", d.mean / 1e3}, {"p95", d.p95 / 1e3}};
    };
    const auto text = [](const char* what, const Distances& d) {
      return fmt::format("{} {:.3f} / {:.3f} mm", what, d.mean / 1e3, d.p95 / 1e3);
    };
    out["surfaces"].push_back({{"object", stacks[i].objects[0]},
                               {"euler", euler_number(mesh)},
                               {"made_to_given", figures(to)},
                               {"given_to_made", figures(from)},
                               {"vertices_to_made", figures(vertices)}});
    table.push_back({stacks[i].objects[0] + " surface", text("made → given", to), text("given → made", from),
                     text("its vertices → made", vertices)});
  }
  console.print(out);
  console.table({"of", "mean / 95th percentile", "", ""}, table);
}

}  // namespace

std::function<void()> bench_sections(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  command.add_option("outer", o->outer, "Outer surface of a hemisphere")->required()->type_name("OUTER");
  command.add_option("inner", o->inner, "Inner surface")->required()->type_name("INNER");
  must_be_within(
      *command.add_option("--spacing", o->spacing, "Of the coronal sections, mm")->capture_default_str(),
      1e-2, 1e2);
  must_be_within(*command.add_option("--voxel", o->voxel, "As of cortex surfaces, mm")->capture_default_str(),
                 0., 1e2);
  must_be_within(*command.add_option("--error", o->error, "As of cortex surfaces, mm")->capture_default_str(),
                 0., 10.);
  command.add_flag("--curves", o->curves, "Fit curves to the contours, too");
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
