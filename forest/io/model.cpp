// SPDX-License-Identifier: Apache-2.0
#include "forest/io/model.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/model_writers.h"
#include "forest/morphology/surface.h"

namespace forest::io {
namespace {

constexpr std::array<std::string_view, 3> geometries{"stick", "cylinder", "surface"};

constexpr std::array<std::string_view, 1> gltf_extensions{".glb"}, obj_extensions{".obj"},
    ply_extensions{".ply"}, stl_extensions{".stl"};

constexpr std::array table{
    ModelFormat{"gltf", "glTF 2.0, binary", gltf_extensions, true, write_gltf},
    ModelFormat{"obj", "Wavefront OBJ", obj_extensions, true, write_obj},
    ModelFormat{"ply", "Stanford PLY, binary", ply_extensions, true, write_ply},
    ModelFormat{"stl", "STL, binary", stl_extensions, false, write_stl},
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
  (void)losses;
  if (options.geometry == Geometry::stick)
    model.lines = sticks(m);
  else
    model.mesh = tubes(m, {.sides = options.sides});
  return model;
}

std::span<const ModelFormat> model_formats() { return table; }

const ModelFormat* find_model_format(std::string_view name) {
  const auto row = std::ranges::find(table, name, &ModelFormat::name);
  return row == table.end() ? nullptr : &*row;
}

const ModelFormat* model_format_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
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
