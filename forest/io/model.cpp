// SPDX-License-Identifier: Apache-2.0
#include "forest/io/model.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/io/model_writers.h"
#include "forest/morphology/surface.h"

namespace forest::io {
namespace {

constexpr std::array<std::string_view, 3> geometries{"stick", "cylinder", "surface"};

using Extension = std::array<std::string_view, 1>;
constexpr Extension gltf_extensions{".glb"}, obj_extensions{".obj"}, ply_extensions{".ply"},
    stl_extensions{".stl"}, vrml_extensions{".wrl"}, x3d_extensions{".x3d"};

constexpr std::array table{
    ModelFormat{"gltf", "glTF 2.0, binary", gltf_extensions, true, write_gltf},
    ModelFormat{"obj", "Wavefront OBJ", obj_extensions, true, write_obj},
    ModelFormat{"ply", "Stanford PLY, binary", ply_extensions, true, write_ply},
    ModelFormat{"stl", "STL, binary", stl_extensions, false, write_stl},
    ModelFormat{"vrml", "VRML97", vrml_extensions, true, write_vrml},
    ModelFormat{"x3d", "X3D 3.3 (XML)", x3d_extensions, true, write_x3d},
};

}  // namespace

std::optional<Geometry> geometry(std::string_view name) {
  const auto at = std::ranges::find(geometries, name);
  return at == geometries.end() ? std::nullopt : std::optional(Geometry(at - geometries.begin()));
}

std::span<const std::string_view> geometry_names() { return geometries; }

Model make_model(const Morphology& m, std::string name, const ModelOptions& options,
                 std::vector<Warning>& losses) {
  Model model{.name = std::move(name), .lines = {}, .mesh = {}};
  const auto lose = [&](std::string_view code, std::string sentence) {
    losses.push_back({.line = 0, .code = code, .sentence = std::move(sentence)});
  };
  if (options.geometry == Geometry::stick) {
    model.lines = sticks(m);
  } else if (options.geometry == Geometry::cylinder) {
    const TubeOptions tube{.sides = options.sides};
    model.mesh = tubes(m, tube);
    const auto thin =
        std::ranges::count_if(m.points(), [&](const Point& p) { return p.radius < tube.thinnest; });
    if (thin > 0)
      lose("thickened",
           fmt::format("{} points are thinner than {} µm or have no radius; they are shown as thick as that",
                       thin, tube.thinnest));
  } else {
    Surface made = surface(m, {.voxel = options.detail});
    model.mesh = std::move(made.mesh);
    if (made.thickened > 0)
      lose("thickened",
           fmt::format("{} points are thinner than the grid of {:.3g} µm can hold; they are shown {:.3g} µm "
                       "thick in radius (a finer --detail shows them as they are)",
                       made.thickened, made.voxel, .75f * made.voxel));
  }
  if (!m.spines().empty()) lose("spines", fmt::format("{} spines are not shown", m.spines().size()));
  return model;
}

std::span<const ModelFormat> model_formats() { return table; }

const ModelFormat* find_model_format(std::string_view name) {
  const auto row = std::ranges::find(table, name, &ModelFormat::name);
  return row == table.end() ? nullptr : &*row;
}

const ModelFormat* model_format_of(const std::filesystem::path& path) {
  const std::string extension = lower(path.extension().string());
  for (const ModelFormat& format : table)
    if (std::ranges::find(format.extensions, extension) != format.extensions.end()) return &format;
  return nullptr;
}

void check(const ModelFormat& format, Geometry geometry) {
  if (geometry == Geometry::stick && !format.holds_lines)
    throw Error(
        fmt::format("{} holds triangles only; write sticks as another format, or choose the geometry "
                    "cylinder or surface",
                    format.title));
}

std::array<std::uint8_t, 3> model_colour(std::uint8_t label) {
  constexpr std::array<std::array<std::uint8_t, 3>, model_labels> colours{{{0x99, 0x99, 0x99},
                                                                           {0xF0, 0xE4, 0x42},
                                                                           {0x00, 0x72, 0xB2},
                                                                           {0xD5, 0x5E, 0x00},
                                                                           {0xCC, 0x79, 0xA7},
                                                                           {0x00, 0x9E, 0x73},
                                                                           {0x56, 0xB4, 0xE9},
                                                                           {0xE6, 0x9F, 0x00}}};
  return colours[label % model_labels];
}

std::string_view model_label_name(std::uint8_t label) {
  return label == soma_label ? "soma" : name_of(SectionKind(label % model_labels));
}

}  // namespace forest::io
