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

namespace {

// VRML and X3D hold the same lists: places, indices with -1 after each line or face, and for each of those an index into
// the colours, which are those of all labels.

std::string places(const Model& model) {
  std::string text;
  for (const auto* list : {&model.lines.positions, &model.mesh.positions})
    for (const Vec3& p : *list) append_vector(text, p), text += '\n';
  return text;
}

std::string indices(const Model& model) {
  std::string text;
  for (std::size_t i = 0; i < model.lines.starts.size(); ++i) {
    for (std::size_t k = 0; k < model.lines.line(i).size(); ++k)
      append_number(text, std::int64_t(model.lines.starts[i] + k)), text += ' ';
    text += "-1\n";
  }
  for (const Triangle& t : model.mesh.triangles) {
    for (const std::uint32_t v : t) append_number(text, std::int64_t(v)), text += ' ';
    text += "-1\n";
  }
  return text;
}

std::string colour_indices(const Model& model) {
  std::string text;
  for (const std::uint8_t label : model.lines.labels) text += fmt::format("{} ", label);
  for (const Triangle& t : model.mesh.triangles) text += fmt::format("{} ", model.mesh.labels[t[0]]);
  return text;
}

std::string colours() {
  std::string text;
  for (std::uint8_t label = 0; label < model_labels; ++label) text += colour_text(label) + ", ";
  text.resize(text.size() - 2);
  return text;
}

/// The name of the neuron within quotation marks of XML or VRML.
std::string quoted(std::string_view name, bool xml) {
  std::string text;
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 0x20)
      text += ' ';
    else if (xml && (c == '&' || c == '<' || c == '"'))
      text += c == '&' ? "&amp;" : c == '<' ? "&lt;" : "&quot;";
    else if (!xml && (c == '"' || c == '\\'))
      (text += '\\') += c;
    else
      text += c;
  return text;
}

constexpr std::string_view smooth = "3.15";  // edges flatter than this angle are shaded as round: all

}  // namespace

std::string write_vrml(const Model& model) {
  const bool sticks = !model.lines.starts.empty();
  return fmt::format(
      "#VRML V2.0 utf8\n# made by Brain Forest, unit micrometre\n"
      "WorldInfo {{ title \"{}\" }}\n"
      "Shape {{\n appearance Appearance {{ material Material {{ }} }}\n geometry {} {{\n"
      "  coord Coordinate {{ point [\n{}  ] }}\n  coordIndex [\n{}  ]\n"
      "  colorPerVertex FALSE\n  color Color {{ color [ {} ] }}\n  colorIndex [ {}]\n{} }}\n}}\n",
      quoted(model.name, false), sticks ? "IndexedLineSet" : "IndexedFaceSet", places(model), indices(model),
      colours(), colour_indices(model), sticks ? "" : fmt::format("  creaseAngle {}\n", smooth));
}

std::string write_x3d(const Model& model) {
  const bool sticks = !model.lines.starts.empty();
  const std::string_view set = sticks ? "IndexedLineSet" : "IndexedFaceSet";
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<!DOCTYPE X3D PUBLIC \"ISO//Web3D//DTD X3D 3.3//EN\" "
      "\"http://www.web3d.org/specifications/x3d-3.3.dtd\">\n"
      "<X3D profile=\"Interchange\" version=\"3.3\">\n<head>\n"
      "<component name=\"Core\" level=\"2\"/>\n"
      "<unit category=\"length\" name=\"micrometre\" conversionFactor=\"0.000001\"/>\n"
      "<meta name=\"title\" content=\"{}\"/>\n<meta name=\"generator\" content=\"Brain Forest\"/>\n</head>\n"
      "<Scene>\n<Shape>\n<Appearance><Material/></Appearance>\n"
      "<{} colorPerVertex=\"false\"{} coordIndex=\"\n{}\" colorIndex=\"{}\">\n"
      "<Coordinate point=\"\n{}\"/>\n<Color color=\"{}\"/>\n</{}>\n</Shape>\n</Scene>\n</X3D>\n",
      quoted(model.name, true), set, sticks ? "" : fmt::format(" creaseAngle=\"{}\"", smooth), indices(model),
      colour_indices(model), places(model), colours(), set);
}

}  // namespace forest::io
