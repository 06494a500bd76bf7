// SPDX-License-Identifier: Apache-2.0
// brainforest cortex: the tissue, from surfaces to finite elements. One row each; longer ones have a file of their own.
#include "apps/cli/cortex.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/bok.h"
#include "forest/cortex/build.h"
#include "forest/cortex/report.h"
#include "forest/cortex/symmetry.h"
#include "forest/io/elements_file.h"
#include "forest/io/surface.h"

#include "apps/cli/borders.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/layer_maps.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {

void must_be_used(const CLI::App& command, std::initializer_list<OptionUse> options) {
  for (const auto& [option, of, used] : options)
    if (!used && command.count(option)) throw Error(fmt::format("{} is {}; leave it out", option, of));
}

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// What is measured beside the report: of the elements alone, or with what else is given.
struct Deeper {
  Borders borders;
  cortex::Symmetry symmetry;
  cortex::Bok bok;
  std::optional<cortex::MeasuredBok> layers;
};

Json json_of(const cortex::Bok& bok) { return {{"l1", bok.l1}, {"l6", bok.l6}}; }

// Layers as they were measured at the vertices of both surfaces.
cortex::MeasuredBok measure_layers(const std::vector<fs::path>& files, const Mesh& outer, const Mesh& inner) {
  if (outer.triangles != inner.triangles)
    throw Error(
        "the outer and the inner surface have other triangles; layers are measured at vertices that "
        "correspond, "
        "give the two surfaces of one reconstruction");
  const auto layers = read_layer_maps(files, outer.positions.size());
  const auto places = [](const Mesh& mesh) {
    std::vector<cortex::Place> result;
    for (const Vec3& p : mesh.positions) result.push_back(p.cast<double>());
    return result;
  };
  cortex::MeasuredBok found = cortex::bok(places(outer), places(inner), outer.triangles, layers);
  if (found.vertices == 0)
    throw InputError(files.front().string(), 0, "measures no layer at any vertex; give maps of thickness");
  return found;
}

// Figures against surfaces that the elements were not made of say nothing of the elements.
void tell_foreign(const cortex::Cortex& cortex, const Mesh& outer, const Mesh& inner, Console& console) {
  constexpr double same = .01;
  const double between = volume(outer) - volume(inner);
  if (between <= 0.) throw Error("the surface that --outer names lies within that of --inner; exchange them");
  if (std::abs(between - cortex.between) > same * cortex.between)
    console.warn(fmt::format(
        "these surfaces enclose {:.1f} mm³ between them and those that the elements were made of {:.1f} "
        "mm³; give the same ones, the outer one by --outer",
        between / 1e9, cortex.between / 1e9));
}

// Their volume alone does not show it: what elements lack in one place those around have more.
void tell_far_faces(const cortex::Elements& elements, const cortex::Report& r, double volume,
                    Console& console) {
  constexpr double far = .2, foreign = 2.;  // of an element's width
  for (const auto& [faces, w, name] : {std::tuple(r.outer, 0., "outer"), std::tuple(r.inner, 1., "inner")})
    if (faces && faces->p99 > foreign * std::cbrt(volume)) {
      console.warn(fmt::format(
          "faces are up to {:.2f} mm from the {} surface: they were made of another; give that one",
          faces->most / 1e3, name));
    } else if (faces && faces->p99 > far * std::cbrt(volume)) {
      const cortex::Place at = elements.hexahedron(faces->farthest).at(.5, .5, w) / 1e3;
      console.warn(fmt::format(
          "one of 100 places of faces is more than {:.2f} mm from the {} surface, the farthest {:.2f} mm, of "
          "element {} at ({:.1f}, {:.1f}, {:.1f}) mm; look at the surfaces there, or give a smaller --volume",
          faces->p99 / 1e3, name, faces->most / 1e3, faces->farthest, at.x(), at.y(), at.z()));
    }
}

double wall_share(const cortex::Cortex& cortex) {
  return cortex.between > 0. ? std::max(0., cortex.wall) / cortex.between : 0.;
}

// A medial wall is some hundredths of a surface, and hardly anything of the volume.
void tell_wall(const cortex::Cortex& cortex, Console& console) {
  constexpr double much = .02;
  if (const double share = wall_share(cortex); share > much)
    console.warn(
        fmt::format("{:.1f} % of what lies between the surfaces, {:.1f} mm³, is too thin for elements and "
                    "has none; where that is "
                    "cortex and no medial wall, give a lower --thinnest to cortex build",
                    100. * share, cortex.wall / 1e9));
}

std::vector<Figure> figures_of(const cortex::Cortex& cortex, const cortex::Report& r, double volume) {
  using Faces = std::optional<cortex::FaceDistance>;
  const auto in_mm = [](const Faces& faces, double cortex::FaceDistance::*which) {
    return faces ? Json((*faces).*which / 1e3) : Json();
  };
  const auto shown = [](const Faces& faces) {
    return faces ? fmt::format("{:.3f} ({:.2f})", faces->p99 / 1e3, faces->most / 1e3) : std::string("-");
  };
  return {
      {"elements", r.elements, "elements", std::to_string(r.elements)},
      {"uncertified", r.uncertified, "uncertified", std::to_string(r.uncertified),
       "not proven to have a positive Jacobian everywhere"},
      {"volume_error", r.volume_error, "volume error", fmt::format("{:.5f}", r.volume_error),
       "of elements and wall, as a share of what lies between the surfaces"},
      {"wall", wall_share(cortex), "wall", fmt::format("{:.5f}", wall_share(cortex)),
       "share of what lies between the surfaces that is too thin for elements, as under the medial wall"},
      {"volume_mean", r.volume_mean / 1e9, "volume mean", fmt::format("{:.4f}", r.volume_mean / 1e9), "mm³"},
      {"volume_within", r.volume_within, "volume within", fmt::format("{:.4f}", r.volume_within),
       fmt::format("share of elements of {:.2f}–{:.2f} mm³", cortex::least_volume * volume / 1e9,
                   cortex::most_volume * volume / 1e9)},
      {"w_angle",
       {{"median", cortex.w_angle.median}, {"p99", cortex.w_angle.p99}},
       "w angle",
       fmt::format("{:.2f} / {:.2f}", cortex.w_angle.median, cortex.w_angle.p99),
       "degrees from the normals of both surfaces, median / 99th percentile"},
      {"w_reached", cortex.w_reached, "w reached", fmt::format("{:.6f}", cortex.w_reached),
       "share of curves that reach the inner surface"},
      {"equivolume_error", r.equivolume_error, "equivolume error",
       fmt::format("{:.4f} / {:.4f}", r.equivolume_p99, r.equivolume_error),
       "|V(0 → w) / V − w|, 99th percentile / largest"},
      {"equivolume_p99", r.equivolume_p99},
      {"layer_bulge",
       {{"p99", r.bulge_p99 / 1e3}, {"most", r.bulge_most / 1e3}},
       "layers bulge",
       fmt::format("{:.3f} / {:.2f}", r.bulge_p99 / 1e3, r.bulge_most / 1e3),
       "mm in the middle of an element, 99th percentile / most"},
      {"scaled_jacobian",
       {{"min", r.jacobian_least}, {"p1", r.jacobian_p1}},
       "scaled Jacobian",
       fmt::format("{:.3f} / {:.3f}", r.jacobian_least, r.jacobian_p1),
       "least / 1st percentile"},
      {"crest_angle",
       {{"median", r.crest_angle ? Json(r.crest_angle->median) : Json()},
        {"p99", r.crest_angle ? Json(r.crest_angle->p99) : Json()}},
       "crest angle",
       r.crest_angle ? fmt::format("{:.2f} / {:.1f}", r.crest_angle->median, r.crest_angle->p99) : "-",
       "degrees between v-isolines and the right angle to crests, median / 99th percentile"},
      {"face_distance_p99",
       {{"outer", in_mm(r.outer, &cortex::FaceDistance::p99)},
        {"inner", in_mm(r.inner, &cortex::FaceDistance::p99)}},
       "faces",
       fmt::format("{} / {}", shown(r.outer), shown(r.inner)),
       "mm from the outer / inner surface, 99th percentile (and most); - where it is not given"},
      {"face_distance_most",
       {{"outer", in_mm(r.outer, &cortex::FaceDistance::most)},
        {"inner", in_mm(r.inner, &cortex::FaceDistance::most)}}},
      lengths_of(cortex.lines)};
}

std::vector<Figure> figures_of(const Deeper& deeper) {
  const cortex::Symmetry& s = deeper.symmetry;
  std::vector<Figure> all;
  for (Figure& f : figures_of(deeper.borders)) all.push_back(std::move(f));
  all.push_back({"symmetry",
                 {{"elements", s.stretches ? Json(s.elements) : Json()},
                  {"best_planar", s.stretches ? Json(s.best_planar) : Json()},
                  {"stretches", s.stretches}},
                 "symmetry",
                 s.stretches ? fmt::format("{:.3f} / {:.3f}", s.elements, s.best_planar) : "-",
                 fmt::format("difference of successive v-sections / of the best planar ones, over {} "
                             "stretches",
                             s.stretches)});
  const auto ratios = [](const cortex::Bok& bok) { return fmt::format("{:.2f} / {:.2f}", bok.l1, bok.l6); };
  Json bok = json_of(deeper.bok);
  if (deeper.layers)
    bok["measured"] = json_of(deeper.layers->measured), bok["of_volume"] = json_of(deeper.layers->of_volume);
  all.push_back({"bok", bok, "Bok", ratios(deeper.bok),
                 "share of thickness on crowns over that in fundi, layer 1 / layer 6, of the elements"});
  if (deeper.layers) {
    all.push_back({nullptr,
                   {},
                   "Bok, measured",
                   ratios(deeper.layers->measured),
                   fmt::format("of the layers given, at {} vertices", deeper.layers->vertices)});
    all.push_back({nullptr,
                   {},
                   "Bok, by volume",
                   ratios(deeper.layers->of_volume),
                   "of layers of constant volume there, folds seen at 6 mm"});
  }
  return all;
}

void tell(const cortex::Cortex& cortex, const cortex::Report& r, const Deeper& deeper, double volume,
          double seconds, Console& console) {
  std::vector<Figure> figures = figures_of(cortex, r, volume);
  std::ranges::move(figures_of(deeper), std::back_inserter(figures));
  figures.push_back({"seconds", seconds});
  figures.push_back({"peak_bytes", peak_bytes()});
  print(std::move(figures), console);
}

std::function<void()> build(CLI::App& command, Console& console) {
  struct Options {
    fs::path outer, inner, out;
    double volume = 1., spacing = .3, scale = 3., thinnest = .5;
    bool force = false;
  };
  const auto o = std::make_shared<Options>();
  command.add_option("outer", o->outer, "Outer surface (pia): GIFTI, FreeSurfer, PLY, STL or OBJ, in mm")
      ->required()
      ->type_name("OUTER");
  command.add_option("inner", o->inner, "Inner surface (white matter)")->required()->type_name("INNER");
  command.add_option("-o,--out", o->out, "The file of elements to make")->required()->type_name("FILE.h5");
  must_be_within(*command.add_option("--volume", o->volume, "Of an element, mm³")->capture_default_str(), .05,
                 1e3);
  must_be_within(
      *command.add_option("--spacing", o->spacing, "Of the nodes of the field between the surfaces, mm")
           ->capture_default_str(),
      .05, 2.);
  must_be_within(*command.add_option("--scale", o->scale, "What is smaller is no crest and no valley, mm")
                      ->capture_default_str(),
                 .1, 20.);
  must_be_within(*command
                      .add_option("--thinnest", o->thinnest,
                                  "What is thinner over 1 cm² is no cortex but its medial wall, mm")
                      ->capture_default_str(),
                 0., 5.);
  add_force(command, o->force);
  return [o, &console] {
    if (extension_of(o->out) != ".h5")
      throw Error(o->out.string() + ": elements are kept as HDF5; give a name that ends in .h5");
    must_take_files({o->out}, o->force);
    const auto begin = Clock::now();
    const Mesh outer = read_mesh(o->outer), inner = read_mesh(o->inner);
    const cortex::Cortex built = cortex::build_cortex(outer, inner,
                                                      {.volume = o->volume * 1e9,
                                                       .spacing = o->spacing * 1e3,
                                                       .line_scale = o->scale * 1e3,
                                                       .thinnest = o->thinnest * 1e3},
                                                      console.progress());
    for (const std::string& oddity : built.oddities) console.warn(oddity);
    io::write_elements(o->out, built, o->volume * 1e9);
    const TriangleTree outer_tree(outer), inner_tree(inner);
    const cortex::Report r =
        cortex::report(built, o->volume * 1e9, &outer_tree, &inner_tree, console.progress());
    Deeper deeper;
    deeper.symmetry = cortex::symmetry(built.elements, built.lines);
    deeper.bok = cortex::bok(built.elements);
    constexpr double hardly_any = .5;
    if (r.volume_within < hardly_any)
      console.warn(fmt::format(
          "only {:.1f} % of the elements have about the wanted volume; look at them by 'brainforest "
          "cortex faces --measure volume', and at the surfaces",
          100. * r.volume_within));
    tell_wall(built, console);
    tell_far_faces(built.elements, r, o->volume * 1e9, console);
    tell(built, r, deeper, o->volume * 1e9, seconds_since(begin), console);
  };
}

std::function<void()> report(CLI::App& command, Console& console) {
  struct Options {
    fs::path file, outer, inner;
    std::vector<fs::path> borders, layers;
  };
  const auto o = std::make_shared<Options>();
  command.add_option("file", o->file, "A file of elements")->required()->type_name("FILE.h5");
  command.add_option("--outer", o->outer, "The outer surface, to measure how far the faces are from it")
      ->type_name("OUTER");
  CLI::Option* inner_option = command.add_option("--inner", o->inner, "The inner one")->type_name("INNER");
  command
      .add_option("--borders", o->borders,
                  "Sulci drawn on both surfaces (Connectome Workbench): how much of them lies by the floor "
                  "of a sulcus, and by chance")
      ->type_name("FILE.border...")
      ->needs("--outer")
      ->needs(inner_option);
  command
      .add_option(
          "--layers", o->layers,
          "Thickness of each layer at the vertices of both surfaces, from the pia inwards, six files: "
          "how they differ between crowns and fundi")
      ->type_name("FILE...")
      ->expected(6)
      ->needs("--outer")
      ->needs(inner_option);
  return [o, &console] {
    const auto begin = Clock::now();
    const io::ElementsFile file = io::read_elements(o->file);
    std::optional<TriangleTree> outer, inner;
    Mesh outer_mesh, inner_mesh;
    if (!o->outer.empty()) outer_mesh = read_mesh(o->outer), outer.emplace(outer_mesh);
    if (!o->inner.empty()) inner_mesh = read_mesh(o->inner), inner.emplace(inner_mesh);
    Deeper deeper;
    if (!o->borders.empty())
      deeper.borders = measure_borders(o->borders, outer_mesh, inner_mesh, file.cortex.lines);
    if (!o->layers.empty()) deeper.layers = measure_layers(o->layers, outer_mesh, inner_mesh);
    if (const std::string doubt = doubt_of_order(o->layers); !doubt.empty()) console.warn(doubt);
    if (outer && inner) tell_foreign(file.cortex, outer_mesh, inner_mesh, console);
    const cortex::Report r = cortex::report(file.cortex, file.volume, outer ? &*outer : nullptr,
                                            inner ? &*inner : nullptr, console.progress());
    tell_wall(file.cortex, console);
    tell_far_faces(file.cortex.elements, r, file.volume, console);
    deeper.symmetry = cortex::symmetry(file.cortex.elements, file.cortex.lines);
    deeper.bok = cortex::bok(file.cortex.elements);
    tell(file.cortex, r, deeper, file.volume, seconds_since(begin), console);
  };
}

constexpr Verb actions[] = {
    {"contours", "Cut surfaces, volumes or pictures into sections, whose boundaries become curves",
     "brainforest cortex contours lh.pial lh.white -o lh.contours --axis y --spacing 1", cortex_contours},
    {"compare", "Lay consecutive contours over one another and tell how far apart they are",
     "brainforest cortex compare lh.contours --svg overlays", cortex_compare},
    {"surfaces", "Make the outer and the inner surface of contours",
     "brainforest cortex surfaces lh.contours -o outer.surf.gii inner.surf.gii", cortex_surfaces},
    {"distance", "Tell how far two surfaces are from one another",
     "brainforest cortex distance lh.pial outer.surf.gii --values away.txt\n"
     "  brainforest render lh.pial --overlay away.txt -o away.png",
     cortex_distance},
    {"curves", "Drop w-curves between two surfaces: thickness along them, and a surface at a depth",
     "brainforest cortex curves lh.pial lh.white -o lh.middle --depth .5 --values thickness.txt\n"
     "  brainforest render lh.middle --overlay thickness.txt -o thickness.png",
     cortex_curves},
    {"lines", "Find crests, valleys and the floors of sulci",
     "brainforest cortex lines lh.pial lh.white -o lh.lines.csv\n"
     "  brainforest cortex lines lh.pial lh.white -o lh.border --sheet middle.gii --values lines.txt\n"
     "  brainforest render middle.gii --overlay lines.txt -o lines.png",
     cortex_lines},
    {"build", "Fill the space between two surfaces with certified elements",
     "brainforest cortex build lh.pial lh.white -o elements.h5", build},
    {"report", "Measure a file of elements",
     "brainforest cortex report elements.h5 --outer lh.pial --inner lh.white --json", report},
    {"faces", "Write the elements at a depth as a surface, and what is measured of each as its colours",
     "brainforest cortex faces elements.h5 -o middle.gii --measure jacobian --values jacobian.txt\n"
     "  brainforest render middle.gii --overlay jacobian.txt -o elements.png",
     cortex_faces},
    {"grid", "Fill blocks with curvilinear grids, and compare what fills them",
     "brainforest cortex grid swan --generator winslow -o swan.svg", cortex_grid},
};

}  // namespace

Mesh read_mesh(const fs::path& path) { return io::read_surface(MappedFile(path).text(), path.string()); }

std::function<void()> cortex(CLI::App& command, Console& console) {
  command.require_subcommand(1);
  const auto chosen = std::make_shared<std::function<void()>>();
  for (const Verb& action : actions) {
    CLI::App* sub = command.add_subcommand(action.name, action.summary);
    sub->footer(fmt::format("Example:\n  {}", action.example));
    add_common(*sub, console);
    sub->callback([chosen, run = action.setup(*sub, console)] { *chosen = run; });
  }
  return [chosen] { (*chosen)(); };
}

}  // namespace forest::cli
