// SPDX-License-Identifier: Apache-2.0
// brainforest cortex faces: a level of the elements as a surface that programs show, and one number for each of its elements.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/elements_file.h"
#include "forest/io/surface.h"

#include "apps/cli/console.h"
#include "apps/cli/cortex.h"
#include "apps/cli/files.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;

struct Measure {
  const char* name;
  const char* what;
  double (*of)(const cortex::Hexahedron&);
};

double worst_depth(const cortex::Hexahedron& h) {
  const double all = h.volume();
  double worst = 0.;
  for (const double w : {1. / 6., 1. / 3., .5, 2. / 3., 5. / 6.})
    worst = std::max(worst, std::abs(h.volume(0., w) / all - w));
  return worst;
}

constexpr Measure measures[] = {
    {"volume", "mm³", [](const cortex::Hexahedron& h) { return h.volume() / 1e9; }},
    {"thickness", "mm, from face to face in the middle",
     [](const cortex::Hexahedron& h) { return (h.at(.5, .5, 0.) - h.at(.5, .5, 1.)).norm() / 1e3; }},
    {"jacobian", "scaled Jacobian, the least",
     [](const cortex::Hexahedron& h) { return cortex::scaled_jacobian(h); }},
    {"equivolume", "largest |V(0 → w)/V − w|", worst_depth},
};

struct Options {
  fs::path file, out, values;
  std::string measure = "volume";
  double w = .5;
  bool force = false;
};

void run(const Options& o, Console& console) {
  const io::ElementsFile file = io::read_elements(o.file);
  const cortex::Elements& elements = file.cortex.elements;
  const auto measure = std::ranges::find(measures, o.measure, &Measure::name);
  // Every element has four corners and a middle of its own, so that its number colours it alone.
  Mesh mesh;
  mesh.positions.resize(5 * elements.size()), mesh.triangles.resize(4 * elements.size());
  std::vector<double> values(elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const cortex::Hexahedron h = elements.hexahedron(e);
    values[e] = measure->of(h);
    constexpr double ring[4][2] = {{0., 0.}, {0., 1.}, {1., 1.}, {1., 0.}};  // counter-clockwise from outside
    const auto first = std::uint32_t(5 * e);
    for (std::uint32_t k = 0; k < 4; ++k) {
      mesh.positions[first + k] = h.at(ring[k][0], ring[k][1], o.w).cast<float>();
      mesh.triangles[4 * e + k] = {first + k, first + (k + 1) % 4, first + 4};
    }
    mesh.positions[first + 4] = h.at(.5, .5, o.w).cast<float>();
  });
  mesh.labels.assign(mesh.positions.size(), 0);
  std::string text;
  for (const double value : values)
    for (int k = 0; k < 5; ++k) text += fmt::format("{:.6g}\n", value);
  write_unless_there(o.out, io::write_surface(mesh, o.out.string()), o.force);
  if (!o.values.empty()) write_unless_there(o.values, text, o.force);
  const auto [least, most] = std::ranges::minmax(values);
  console.say(fmt::format("{} at w = {} in {}; {} ({}) from {:.4g} to {:.4g}{}",
                          counted(elements.size(), "element"), o.w, o.out.string(), measure->name,
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
  command.add_option("--values", o->values, "Text, a number a vertex, as render --overlay takes it")
      ->type_name("FILE");
  must_be_within(
      *command.add_option("--w", o->w, "Depth: 0 the outer surface, 1 the inner one")->capture_default_str(),
      0., 1.);
  command.add_option("--measure", o->measure, help)->check(CLI::IsMember(names))->capture_default_str();
  add_force(command, o->force);
  return [o, &console] { run(*o, console); };
}

}  // namespace forest::cli
