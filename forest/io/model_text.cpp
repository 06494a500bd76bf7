// SPDX-License-Identifier: Apache-2.0
// Models as text: Wavefront OBJ, VRML97 (ISO/IEC 14772-1:1997), X3D 3.3 in XML (ISO/IEC 19776-1).
#include <utility>

#include <fmt/format.h>

#include "forest/io/model_writers.h"
#include "forest/io/numbers.h"

namespace forest::io {
namespace {

void append_vector(std::string& text, const Vec3& v) {
  append_number(text, v.x());
  append_number(text += ' ', v.y());
  append_number(text += ' ', v.z());
}

/// "0.941 0.894 0.259"
std::string colour_text(std::uint8_t label) {
  const auto [r, g, b] = model_colour(label);
  return fmt::format("{:.3f} {:.3f} {:.3f}", r / 255., g / 255., b / 255.);
}

}  // namespace

std::string write_obj(const Model& model) {
  std::string text = "# made by Brain Forest, unit micrometre; vertices are x y z red green blue\n";
  const auto vertex = [&](const Vec3& p, std::uint8_t label) {
    append_vector(text += "v ", p);
    text += ' ' + colour_text(label) + '\n';
  };
  // Indices count from 1. Groups are the kinds; a triangle between two kinds is of that of its first vertex.
  if (!model.lines.starts.empty()) {
    for (std::size_t i = 0; i < model.lines.starts.size(); ++i)
      for (const Vec3& p : model.lines.line(i)) vertex(p, model.lines.labels[i]);
    for (std::uint8_t label = 0; label < model_labels; ++label) {
      bool begun = false;
      for (std::size_t i = 0; i < model.lines.starts.size(); ++i) {
        if (model.lines.labels[i] != label) continue;
        if (!std::exchange(begun, true)) text += fmt::format("g {}\n", model_label_name(label));
        text += 'l';
        for (std::size_t k = 0; k < model.lines.line(i).size(); ++k)
          append_number(text += ' ', std::int64_t(model.lines.starts[i] + k + 1));
        text += '\n';
      }
    }
    return text;
  }
  for (std::size_t i = 0; i < model.mesh.positions.size(); ++i)
    vertex(model.mesh.positions[i], model.mesh.labels[i]);
  for (std::uint8_t label = 0; label < model_labels; ++label) {
    bool begun = false;
    for (const Triangle& t : model.mesh.triangles) {
      if (model.mesh.labels[t[0]] != label) continue;
      if (!std::exchange(begun, true)) text += fmt::format("g {}\n", model_label_name(label));
      text += 'f';
      for (const std::uint32_t v : t) append_number(text += ' ', std::int64_t(v) + 1);
      text += '\n';
    }
  }
  return text;
}

}  // namespace forest::io
