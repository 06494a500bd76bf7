// SPDX-License-Identifier: Apache-2.0
// brainforest cortex faces: a level of the elements as a surface that programs show, and one number for each of its elements.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/elements_file.h"
#include "forest/io/surface.h"

#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"
#include "apps/cli/planting_elements.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

struct Measure {
  const char* name;
  const char* what;
  const char* title;  // above colours
  double (*of)(const cortex::Elements&, std::size_t element);
};

using cortex::Elements;

constexpr Measure measures[] = {
    {"volume", "mm³", "volume (mm³)",
     [](const Elements& all, std::size_t e) { return all.hexahedron(e).volume() / 1e9; }},
    {"thickness", "mm, from face to face in the middle", "thickness (mm)",
     [](const Elements& all, std::size_t e) {
       const cortex::Hexahedron h = all.hexahedron(e);
       return (h.at(.5, .5, 0.) - h.at(.5, .5, 1.)).norm() / 1e3;
     }},
    {"jacobian", "scaled Jacobian, the least", "scaled Jacobian",
     [](const Elements& all, std::size_t e) { return cortex::scaled_jacobian(all.hexahedron(e)); }},
    {"equivolume", "largest |V(0 → depth)/V − depth|", "equivolume error", cortex::depth_error},
    {"bulge", "mm that layers bulge in the middle, at most", "bulge of layers (mm)",
     [](const Elements& all, std::size_t e) { return cortex::layer_bulge(all, e) / 1e3; }},
};

// Of each element where its middle is, µm, as `plant --near` takes it, and all that is measured.
std::string table_of(const Elements& elements) {
  std::string text = "element,x,y,z";
  for (const Measure& m : measures) text += fmt::format(",{}", m.name);
  text += '\n';
  std::vector<std::string> lines(elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const cortex::Place at = elements.hexahedron(e).at(.5, .5, .5);
    lines[e] = fmt::format("{},{:.0f},{:.0f},{:.0f}", e, at.x(), at.y(), at.z());
    for (const Measure& m : measures) lines[e] += fmt::format(",{:.5g}", m.of(elements, e));
  });
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

struct Options {
  fs::path file, out, values, table;
  std::string measure = "volume";
  double depth = .5;
  std::string edges;   // of which elements
  double radius = 4.;  // of edges, µm
  bool force = false;
};

// The twelve edges of elements as tubes: a cage, through which one sees what is within.
Mesh edges_of(const cortex::Elements& elements, std::span<const std::uint32_t> of, double radius) {
  constexpr std::uint32_t steps = 24, sides = 6;
  constexpr std::size_t an_element = 12 * steps * sides * 2, most = 30'000'000;  // triangles
  if (of.size() > most / an_element)
    throw Error(fmt::format("the edges of {} would be {:.0f} million triangles; name no more than {} at once",
                            counted(of.size(), "element"), double(of.size() * an_element) / 1e6,
                            most / an_element));
  Mesh mesh;
  mesh.positions.reserve(of.size() * 12 * (steps + 1) * sides),
      mesh.triangles.reserve(of.size() * an_element);
  for (const std::uint32_t e : of) {
    const cortex::Hexahedron h = elements.hexahedron(e);
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < 4; ++corner) {
        Eigen::Vector3d at = Eigen::Vector3d::Zero();
        at[(axis + 1) % 3] = corner & 1, at[(axis + 2) % 3] = corner >> 1;
        const auto first = std::uint32_t(mesh.positions.size());
        for (std::uint32_t i = 0; i <= steps; ++i) {
          at[axis] = double(i) / steps;
          const cortex::Linear here = cortex::linear(h, at);
          const Eigen::Vector3d along = here.jacobian.col(axis).normalized(),
                                other = here.jacobian.col((axis + 1) % 3);
          const Eigen::Vector3d x = along.cross(other).normalized(), y = along.cross(x);
          for (std::uint32_t k = 0; k < sides; ++k) {
            const double turn = 2. * std::numbers::pi * k / sides;
            mesh.positions.push_back(
                (here.at + radius * (std::cos(turn) * x + std::sin(turn) * y)).cast<float>());
            if (i == steps) continue;
            const std::uint32_t a = first + i * sides + k, b = first + i * sides + (k + 1) % sides;
            mesh.triangles.push_back({a, b, b + sides}), mesh.triangles.push_back({a, b + sides, a + sides});
          }
        }
      }
  }
  mesh.labels.assign(mesh.positions.size(), 0);
  return mesh;
}

void run(const Options& o, Console& console) {
  must_take_surfaces({o.out}, true);
  std::vector<fs::path> all{o.out};
  for (const fs::path& other : {o.values, o.table})
    if (!other.empty()) all.push_back(other);
  must_take_files(all, true);
  must_not_be_read("--out", o.out, {o.file});
  must_not_be_read("--values", o.values, {o.file});
  must_not_be_read("--table", o.table, {o.file});
  const io::ElementsFile file = io::read_elements(o.file);
  const cortex::Elements& elements = file.cortex.elements;
  if (!o.edges.empty()) {
    const auto of = parse_elements(o.edges, o.file, elements.size());
    write_unless_there(o.out, io::write_surface(edges_of(elements, of, o.radius), o.out.string()), o.force);
    console.say(fmt::format("the edges of {} in {}", counted(of.size(), "element"), o.out.string()));
    return console.print({{"elements", of.size()}});
  }
  const auto measure = std::ranges::find(measures, o.measure, &Measure::name);
  // Every element has four corners and a middle of its own, so that its number colours it alone.
  Mesh mesh;
  mesh.positions.resize(5 * elements.size()), mesh.triangles.resize(4 * elements.size());
  std::vector<double> values(elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const cortex::Hexahedron h = elements.hexahedron(e);
    values[e] = measure->of(elements, e);
    const cortex::Layers layers(elements, e);
    const auto at = [&](double u, double v) -> Vec3 {
      return h.at(u, v, layers.w(u, v, o.depth)).cast<float>();
    };
    constexpr double ring[4][2] = {{0., 0.}, {0., 1.}, {1., 1.}, {1., 0.}};  // counter-clockwise from outside
    const auto first = std::uint32_t(5 * e);
    for (std::uint32_t k = 0; k < 4; ++k) {
      mesh.positions[first + k] = at(ring[k][0], ring[k][1]);
      mesh.triangles[4 * e + k] = {first + k, first + (k + 1) % 4, first + 4};
    }
    mesh.positions[first + 4] = at(.5, .5);
  });
  mesh.labels.assign(mesh.positions.size(), 0);
  std::vector<std::pair<fs::path, std::string>> files{{o.out, io::write_surface(mesh, o.out.string())}};
  if (!o.values.empty()) {
    std::vector<double> each;  // vertex
    for (const double value : values) each.insert(each.end(), 5, value);
    files.emplace_back(o.values, io::write_surface_values(measure->title, each));
  }
  if (!o.table.empty()) files.emplace_back(o.table, table_of(elements));
  write_unless_there(files, o.force);
  const auto [least, most] = std::ranges::minmax(values);
  console.say(fmt::format("{} at depth {} in {}; {} ({}) from {:.4g} to {:.4g}{}",
                          counted(elements.size(), "element"), o.depth, o.out.string(), measure->name,
                          measure->what, least, most,
                          o.values.empty() ? std::string() : " in " + o.values.string()));
  console.print(
      {{"elements", elements.size()}, {"measure", measure->name}, {"least", least}, {"most", most}});
}

}  // namespace

std::function<void()> cortex_faces(CLI::App& command, Console& console) {
  const auto o = std::make_shared<Options>();
  std::vector<std::string> names;
  std::string help = "What is told of each element:";
  for (const Measure& m : measures) {
    help += fmt::format("{} {} ({})", names.empty() ? "" : ",", m.name, m.what);
    names.emplace_back(m.name);
  }
  command.add_option("file", o->file, "A file of elements")->required()->type_name("FILE.h5");
  command.add_option("-o,--out", o->out, "The surface to write: .gii, or FreeSurfer's by any other name")
      ->required()
      ->type_name("FILE");
  CLI::Option* const values =
      command.add_option("--values", o->values, "Text, a number a vertex, as render --overlay takes it")
          ->type_name("FILE");
  CLI::Option* const table = command
                                 .add_option("--table", o->table,
                                             "A row of each element: its number, where its middle is (µm, as "
                                             "plant --near takes it), all that is told")
                                 ->type_name("FILE.csv");
  CLI::Option* const depth =
      command.add_option("--depth", o->depth, "By volume: 0 the outer surface, 1 the inner one")
          ->capture_default_str();
  must_be_within(*depth, 0., 1.);
  CLI::Option* const measure =
      command.add_option("--measure", o->measure, help)->check(CLI::IsMember(names))->capture_default_str();
  CLI::Option* const edges =
      command
          .add_option("--edges", o->edges,
                      "Instead of a level the edges of these elements, as tubes: 7,12,20-29 or all")
          ->type_name("LIST")
          ->excludes(values)
          ->excludes(table)
          ->excludes(depth)
          ->excludes(measure);
  must_be_within(
      *command.add_option("--radius", o->radius, "Of the tubes, µm")->needs(edges)->capture_default_str(), .1,
      1000.);
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
