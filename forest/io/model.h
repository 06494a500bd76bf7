// SPDX-License-Identifier: Apache-2.0
// The table of formats for models of neurons: what other programs show, but no reader makes a neuron of again. Coordinates
// are µm as in the neuron, y up; colours tell soma, axon and dendrites apart. A format is a writer and a row.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/geometry/mesh.h"
#include "forest/io/oddity.h"
#include "forest/morphology/morphology.h"

namespace forest::io {

enum class Geometry : std::uint8_t { stick, cylinder, surface };

/// "stick", "cylinder", "surface"; none for other words.
std::optional<Geometry> geometry(std::string_view name);
std::span<const std::string_view> geometry_names();

/// Lines (of sticks) or triangles; the other is empty.
struct Model {
  std::string name;  // of the neuron
  Lines lines;
  Mesh mesh;
};

struct ModelOptions {
  Geometry geometry = Geometry::cylinder;
  int sides = 12;      // of a cylinder, 3 to 64
  float detail = 0.f;  // µm: spacing of the grid a surface is made on; 0: from the thinnest branch
};

/// The model of a neuron, and what it does not show. Throws LimitError when a surface would be too fine.
Model make_model(const Morphology& m, std::string name, const ModelOptions& options,
                 std::vector<Warning>& losses);

struct ModelFormat {
  std::string_view name;                         // "gltf"
  std::string_view title;                        // "glTF 2.0, binary"
  std::span<const std::string_view> extensions;  // with the dot, lower case; the first one is written
  bool holds_lines;
  /// The same model gives the same bytes.
  std::string (*write)(const Model& model);
};

std::span<const ModelFormat> model_formats();
const ModelFormat* find_model_format(std::string_view name);            // null when unknown
const ModelFormat* model_format_of(const std::filesystem::path& path);  // by extension; null when unknown
void check(const ModelFormat& format, Geometry geometry);  // throws Error when it cannot hold that

/// sRGB, by label: the colours of Okabe & Ito (2008), safe for colour-blind eyes; soma yellow, axon blue, basal
/// dendrites vermilion, apical ones purple.
std::array<std::uint8_t, 3> model_colour(std::uint8_t label);
inline constexpr std::uint8_t model_labels = 8;
std::string_view model_label_name(std::uint8_t label);  // "soma", "axon", …

}  // namespace forest::io
