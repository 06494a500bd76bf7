// SPDX-License-Identifier: Apache-2.0
// brainforest cortex curves: a w-curve from every vertex of the outer surface, what is measured along it, and where it is at a depth.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/check_surfaces.h"
#include "forest/cortex/w_curve.h"
#include "forest/io/surface.h"
#include "forest/statistics/two_samples.h"

#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

// What is known of a curve.
struct Dropped {
  cortex::Place at = cortex::Place::Zero();  // its depth
  double length = 0., straight = 0.;         // mm
  cortex::EndAngles angles;
  bool arrived = false;

  bool there() const { return !std::isnan(length); }
};

struct Measure {
  const char* name;
  const char* what;
  const char* title;  // above colours
  double (*of)(const Dropped&);
};

constexpr Measure measures[] = {
    {"thickness", "along the curve, mm", "thickness (mm)", [](const Dropped& d) { return d.length; }},
    {"straight", "to the nearest place of the inner surface, mm", "distance (mm)",
     [](const Dropped& d) { return d.straight; }},
    {"outer-angle", "to the outer surface's normal, degrees", "angle to the normal (°)",
     [](const Dropped& d) { return d.angles.outer; }},
    {"inner-angle", "to the inner surface's normal, degrees", "angle to the normal (°)",
     [](const Dropped& d) { return d.angles.inner; }},
};

struct Options {
  fs::path outer, inner, out, values;
  std::string measure = "thickness", by = "volume";
  double depth = .5, spacing = .3, thinnest = .5;
  bool force = false;
};

// A vertex of no triangle lies on no surface: it stays where it is and nothing is known of it.
Dropped none_at(const cortex::Place& place) {
  return {.at = place, .length = NAN, .straight = NAN, .angles = {NAN, NAN}, .arrived = false};
}

std::vector<Dropped> drop_all(const Options& o, const Mesh& outer, const Mesh& inner, Progress& progress) {
  const cortex::Laplace field(outer, inner, {.spacing = o.spacing * 1e3}, progress);
  const cortex::Boundary above(outer, progress), below(inner, progress);
  const cortex::WCurves curves(field, above, below);
  const std::vector<Vec3> normals = vertex_normals(outer);
  std::vector<std::uint8_t> used(outer.positions.size(), 0);
  for (const Triangle& t : outer.triangles)
    for (const std::uint32_t v : t) used[v] = 1;
  std::vector<Dropped> all(outer.positions.size());
  progress.begin("dropping w-curves", all.size());
  parallel_ranges(all.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const cortex::Place start = outer.positions[v].cast<double>();
      if (!used[v]) {
        all[v] = none_at(start);
        continue;
      }
      const cortex::WCurve curve = curves.drop(start, -normals[v].cast<double>());
      all[v] = {o.by == "volume" ? curve.at(o.depth) : curve.at_length(o.depth), curve.length() / 1e3,
                curves.straight_way(start) / 1e3, end_angles(curve, {above.tree(), below.tree()}),
                curve.arrived};
    }
    progress.advance(end - begin);
  });
  progress.end();
  return all;
}

void run(const Options& o, Console& console) {
  must_take_surfaces({o.out}, o.force);
  must_take_files({o.out, o.values}, o.force);
  must_not_be_read("--out", o.out, {o.outer, o.inner});
  must_not_be_read("--values", o.values, {o.outer, o.inner});
  Mesh outer = read_mesh(o.outer);
  const Mesh inner = read_mesh(o.inner);
  for (const std::string& oddity : cortex::check_surfaces(outer, inner)) console.warn(oddity);
  const std::vector<Dropped> all = drop_all(o, outer, inner, console.progress());

  const auto measure = std::ranges::find(measures, o.measure, &Measure::name);
  std::vector<double> values, lengths, angles;
  std::size_t arrived = 0, without = 0, thin = 0;
  for (std::size_t v = 0; v < all.size(); ++v) {
    const Dropped& d = all[v];
    outer.positions[v] = d.at.cast<float>();
    values.push_back(measure->of(d));
    arrived += d.arrived, without += !d.there(), thin += d.length < o.thinnest;
    if (d.length >= o.thinnest)
      lengths.push_back(d.length), angles.insert(angles.end(), {d.angles.outer, d.angles.inner});
  }
  std::vector<std::pair<fs::path, std::string>> files{{o.out, io::write_surface(outer, o.out.string())}};
  if (!o.values.empty()) files.emplace_back(o.values, io::write_surface_values(measure->title, values));
  write_unless_there(files, o.force);

  const std::size_t curves = all.size() - without;
  if (without)
    console.warn(fmt::format(
        "{}: {} of no triangle, which {} no curve; {} where {}, with nan as value", o.outer.string(),
        without == 1 ? "a vertex is" : fmt::format("{} vertices are", without), without == 1 ? "has" : "have",
        without == 1 ? "it stays" : "they stay", without == 1 ? "it is" : "they are"));
  if (lengths.empty())
    console.warn(
        fmt::format("no curve is as long as {:g} mm, so that no figures are told; where it is thinner, give "
                    "a lower --thinnest",
                    o.thinnest));
  const auto quantile = [](const std::vector<double>& of, double share) {
    return of.empty() ? NAN : statistics::quantile(of, share);  // null in JSON
  };
  const double thickness = quantile(lengths, .5), usual = quantile(angles, .5), far = quantile(angles, .99);
  console.say(fmt::format(
      "{} of {} reach the inner surface{}", arrived, counted(curves, "curve"),
      lengths.empty() ? std::string()
                      : fmt::format("; {:.2f} mm long in the median; {:.2f}° off right angles in the "
                                    "median, {:.1f}° at the 99th percentile{}",
                                    thickness, usual, far,
                                    thin ? fmt::format("; {} shorter than {:g} mm left out", thin, o.thinnest)
                                         : std::string())));
  console.say(fmt::format(
      "depth {} by {} in {}{}", o.depth, o.by, o.out.string(),
      o.values.empty() ? std::string()
                       : fmt::format("; {} ({}) in {}", measure->name, measure->what, o.values.string())));
  console.print({{"curves", curves},
                 {"reached", arrived},
                 {"thin", thin},
                 {"thickness", thickness},
                 {"w_angle", {{"median", usual}, {"p99", far}}}});
}

}  // namespace

std::function<void()> cortex_curves(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  std::vector<std::string> names;
  std::string help = "What is told of each curve:";
  for (const Measure& m : measures) {
    help += fmt::format("{} {} ({})", names.empty() ? "" : ",", m.name, m.what);
    names.emplace_back(m.name);
  }
  command.add_option("outer", o->outer, "Outer surface (pia): GIFTI, FreeSurfer, PLY, STL or OBJ, in mm")
      ->required()
      ->type_name("OUTER");
  command.add_option("inner", o->inner, "Inner surface (white matter)")->required()->type_name("INNER");
  command
      .add_option("-o,--out", o->out,
                  "The outer surface's triangles at --depth: .gii, or FreeSurfer's by any other name")
      ->required()
      ->type_name("FILE");
  must_be_within(
      *command.add_option("--depth", o->depth, "Of that surface: 0 the outer one, 1 the inner one")
           ->capture_default_str(),
      0., 1.);
  command
      .add_option("--by", o->by,
                  "Whether depth is a share of volume, as layers keep it over crowns and in fundi, or of the "
                  "curve's length")
      ->check(CLI::IsMember({"volume", "length"}))
      ->capture_default_str();
  CLI::Option* const values =
      command.add_option("--values", o->values, "Text, a number a vertex, as render --overlay takes it")
          ->type_name("FILE");
  command.add_option("--measure", o->measure, help)
      ->check(CLI::IsMember(names))
      ->needs(values)
      ->capture_default_str();
  must_be_within(
      *command.add_option("--spacing", o->spacing, "Of the nodes of the field between the surfaces, mm")
           ->capture_default_str(),
      .05, 2.);
  must_be_within(*command
                      .add_option("--thinnest", o->thinnest,
                                  "Shorter curves, as of the medial wall, are left out of what is told, mm")
                      ->capture_default_str(),
                 0., 5.);
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
