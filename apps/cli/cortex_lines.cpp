// SPDX-License-Identifier: Apache-2.0
// brainforest cortex lines: crests, valleys and the floors of sulci of two surfaces, without elements.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/check_surfaces.h"
#include "forest/cortex/folds.h"
#include "forest/io/border_file.h"
#include "forest/io/surface.h"

#include "apps/cli/borders.h"
#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using cortex::Line, cortex::Place, cortex::Ribbon;

struct Kind {
  Line::Kind kind;
  const char *one, *all;
  double value;  // of --values
  Vec3 colour;   // 0–1
};
constexpr const char* values_title = "crests 1, valleys -1";
const Kind kinds[] = {{Line::Kind::crest, "crest", "crests", 1., {.80f, .15f, .15f}},
                      {Line::Kind::valley, "valley", "valleys", -1., {.15f, .25f, .80f}},
                      {Line::Kind::sulcus, "sulcus", "sulci", -.7, {.10f, .55f, .75f}}};
const Kind& kind_of(const Line& line) { return *std::ranges::find(kinds, line.kind, &Kind::kind); }

struct Level {
  const char* name;
  std::vector<Place> Ribbon::*places;
};
constexpr Level levels[] = {
    {"outer", &Ribbon::outer}, {"middle", &Ribbon::middle}, {"inner", &Ribbon::inner}};

struct Options {
  fs::path outer, inner, out, sheet, values;
  std::vector<fs::path> borders;
  std::vector<std::string> show{"crests", "valleys", "sulci"};
  std::string level = "outer";
  double scale = 3., spacing = .3;
  bool force = false;
};

// A line on the level asked for, µm.
struct Carried {
  const Line& line;
  std::vector<Place> points;
};

std::string as_csv(std::span<const Carried> lines) {
  std::string text = "line,kind,closed,length,x,y,z\n";
  for (std::size_t i = 0; i < lines.size(); ++i)
    for (const Place& p : lines[i].points)
      text += fmt::format("{},{},{},{:.3f},{:.4f},{:.4f},{:.4f}\n", i, kind_of(lines[i].line).one,
                          int(lines[i].line.closed), lines[i].line.length() / 1e3, p[0] / 1e3, p[1] / 1e3,
                          p[2] / 1e3);
  return text;
}

std::string as_obj(std::span<const Carried> lines) {
  std::string text = "# lines of a cortex, mm\n";
  std::size_t next = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += fmt::format("o {}_{}\n", kind_of(lines[i].line).one, i);
    for (const Place& p : lines[i].points)
      text += fmt::format("v {:.4f} {:.4f} {:.4f}\n", p[0] / 1e3, p[1] / 1e3, p[2] / 1e3);
    text += "l";
    for (std::size_t k = 0; k < lines[i].points.size(); ++k) text += fmt::format(" {}", next++);
    text += "\n";
  }
  return text;
}

std::string as_borders(std::span<const Carried> lines, const Mesh& outer, const fs::path& file,
                       Console& console) {
  const TriangleTree tree(outer);
  io::Borders all{outer.positions.size(), {}};
  if (std::string told = io::surface_structure(MappedFile(file).text(), file.string()); !told.empty())
    all.structure = std::move(told);
  else
    console.warn(
        fmt::format("{} does not say which hemisphere it is of, so that Workbench will not draw the borders "
                    "on it; 'wb_command -set-structure' tells it of both",
                    file.string()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Kind& kind = kind_of(lines[i].line);
    io::Border border{fmt::format("{} {}", kind.one, i), {}, kind.all, kind.colour, lines[i].line.closed};
    for (const Place& p : lines[i].points) {
      const auto hit = tree.nearest(p);
      const auto [a, b, c] = tree.corners(hit->triangle);
      const Eigen::Vector3d w = barycentric(a, b, c, hit->at);
      const Triangle& t = outer.triangles[hit->triangle];
      border.points.push_back({{t[0], t[1], t[2]}, {w[0], w[1], w[2]}});
    }
    all.borders.push_back(std::move(border));
  }
  return io::write_borders(all);
}

// By which lines each vertex lies, and how the middle is bent elsewhere: crowns above 0, fundi below.
std::vector<double> values_of(const cortex::Folds& folds, std::span<const Carried> carried,
                              const std::vector<Place>& level) {
  constexpr double near = 350.;  // µm
  std::vector<Line> lines;
  for (const Carried& c : carried) lines.push_back(c.line), lines.back().points = c.points;
  std::vector<double> values;
  for (const cortex::Curvature& bent : folds.bent)
    values.push_back(std::clamp(250. * (bent.most + bent.least), -.5, .5));
  for (const Kind& kind : kinds) {
    const Mesh pieces = cortex::pieces(lines, kind.kind);
    if (pieces.triangles.empty()) continue;
    const TriangleTree tree(pieces);
    for (std::size_t v = 0; v < values.size(); ++v)
      if (tree.nearest(level[v], near)) values[v] = kind.value;
  }
  return values;
}

void run(const Options& o, Console& console) {
  const std::string ending = extension_of(o.out);
  if (ending != ".csv" && ending != ".obj" && ending != ".border")
    throw Error(o.out.string() +
                ": lines are written as .csv, .obj or .border; give a name that ends in one of these");
  if (ending == ".border" && o.level != "outer")
    throw Error("borders are drawn on the vertices of the outer surface; leave --level out");
  must_take_files({o.out, o.sheet, o.values}, o.force);
  if (!o.sheet.empty()) must_take_surfaces({o.sheet}, o.force);
  std::vector<fs::path> read{o.outer, o.inner};
  read.insert(read.end(), o.borders.begin(), o.borders.end());
  for (const auto& [option, path] :
       {std::pair{"--out", o.out}, std::pair{"--sheet", o.sheet}, std::pair{"--values", o.values}})
    must_not_be_read(option, path, read);
  const Mesh outer = read_mesh(o.outer), inner = read_mesh(o.inner);
  for (const std::string& oddity : cortex::check_surfaces(outer, inner)) console.warn(oddity);

  Progress& progress = console.progress();
  const cortex::Laplace field(outer, inner, {.spacing = o.spacing * 1e3}, progress);
  const cortex::Boundary above(outer, progress), below(inner, progress);
  const cortex::WCurves curves(field, above, below);
  constexpr double volume = 1e9;  // µm³: of elements that are laid by these lines
  cortex::Folds folds =
      cortex::find_folds(cortex::make_ribbon(outer, curves, {.edge = cortex::ribbon_edge(volume)}, progress),
                         curves, o.scale * 1e3, progress);
  const Ribbon& ribbon = folds.ribbon;
  std::vector<Line> all = std::move(folds.lines);
  std::ranges::move(folds.sulci, std::back_inserter(all));
  const std::vector<Figure> lengths{cli::lengths_of(all)};
  Borders borders;
  if (!o.borders.empty()) borders = measure_borders(o.borders, outer, inner, all);
  std::erase_if(
      all, [&](const Line& line) { return std::ranges::find(o.show, kind_of(line).all) == o.show.end(); });

  const std::vector<Place>& level =
      ribbon.*std::ranges::find(levels, o.level, [](const Level& l) { return std::string(l.name); })->places;
  const cortex::RibbonLocator on_middle(ribbon), on_outer(ribbon, ribbon.outer);
  std::vector<Carried> lines;
  for (const Line& line : all) {
    lines.push_back({line, {}});
    const auto& locator = line.kind == Line::Kind::sulcus ? on_outer : on_middle;
    for (const Place& p : line.points) lines.back().points.push_back(on(level, ribbon, locator.nearest(p)));
  }
  std::vector<std::pair<fs::path, std::string>> files{
      {o.out, ending == ".csv"   ? as_csv(lines)
              : ending == ".obj" ? as_obj(lines)
                                 : as_borders(lines, outer, o.outer, console)}};
  if (!o.sheet.empty()) {
    Mesh sheet;
    sheet.triangles = ribbon.triangles;
    for (const Place& p : level) sheet.positions.push_back(p.cast<float>());
    files.emplace_back(o.sheet, io::write_surface(sheet, o.sheet.string()));
  }
  if (!o.values.empty())
    files.emplace_back(o.values, io::write_surface_values(values_title, values_of(folds, lines, level)));
  write_unless_there(files, o.force);

  console.say(fmt::format("{} in {}", counted(lines.size(), "line"), o.out.string()));
  std::vector<Figure> figures{{"lines", lines.size()}};
  std::ranges::copy(lengths, std::back_inserter(figures));
  std::ranges::move(figures_of(borders), std::back_inserter(figures));
  print(std::move(figures), console);
}

}  // namespace

std::function<void()> cortex_lines(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  command.add_option("outer", o->outer, "Outer surface (pia): GIFTI, FreeSurfer, PLY, STL or OBJ, in mm")
      ->required()
      ->type_name("OUTER");
  command.add_option("inner", o->inner, "Inner surface (white matter)")->required()->type_name("INNER");
  command
      .add_option(
          "-o,--out", o->out,
          "The lines: .csv (a row a point, mm), .obj (for Blender), or .border (Connectome Workbench, "
          "on the outer surface)")
      ->required()
      ->type_name("FILE");
  std::vector<std::string> names, places;
  for (const Kind& kind : kinds) names.emplace_back(kind.all);
  for (const Level& level : levels) places.emplace_back(level.name);
  command.add_option("--show", o->show, "Which: crests, valleys, sulci (their floors); by default all")
      ->check(CLI::IsMember(names))
      ->delimiter(',')
      ->type_name("KIND,...");
  command
      .add_option("--level", o->level, "Where they are to lie: crests and valleys are found half way down")
      ->check(CLI::IsMember(places))
      ->capture_default_str();
  must_be_within(*command.add_option("--scale", o->scale, "What is smaller is no crest and no valley, mm")
                      ->capture_default_str(),
                 .1, 20.);
  must_be_within(
      *command.add_option("--spacing", o->spacing, "Of the nodes of the field between the surfaces, mm")
           ->capture_default_str(),
      .05, 2.);
  command
      .add_option("--borders", o->borders,
                  "Sulci drawn on both surfaces (Connectome Workbench): how much of them lies by a line")
      ->type_name("FILE.border...");
  command
      .add_option("--sheet", o->sheet,
                  "A surface at --level with triangles fine enough to show lines: .gii, or FreeSurfer's by "
                  "any other name")
      ->type_name("FILE");
  command
      .add_option(
          "--values", o->values,
          "Text, a number a vertex of --sheet: 1 by a crest, -1 by a valley, -0.7 by the floor of a sulcus, "
          "else how it is bent, crowns above 0")
      ->needs("--sheet")
      ->type_name("FILE");
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
