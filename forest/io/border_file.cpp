// SPDX-License-Identifier: Apache-2.0
#include "forest/io/border_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <sstream>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/plain_text.h"
#include "forest/io/surface.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

class Reader {
 public:
  explicit Reader(const std::string& name) : name_(name) {}

  [[noreturn]] void refuse(const std::string& sentence) const { throw InputError(name_, 0, sentence); }

  template <class Number>
  std::vector<Number> numbers(std::string_view text, std::string_view what) const {
    std::vector<Number> result;
    for (const std::string_view word : words_of(text)) {
      const auto value = number_of<Number>(word);
      if (!value)
        refuse(fmt::format("{} hold '{}', which is no number; get the whole file", what, printable(word)));
      result.push_back(*value);
    }
    return result;
  }

  Border part(const std::string& border, const pugi::xml_node& node, std::size_t surface_vertices) const {
    const std::string what = fmt::format("the border '{}'", printable(border));
    const auto vertices =
        numbers<std::uint32_t>(node.child("Vertices").child_value(), "the vertices of " + what);
    const auto weights = numbers<double>(node.child("Weights").child_value(), "the weights of " + what);
    if (vertices.empty() || vertices.size() % 3 != 0 || weights.size() != vertices.size())
      refuse(fmt::format(
          "{} has {} vertices and {} weights, which should be three each a point; get the whole file", what,
          vertices.size(), weights.size()));
    Border result{border, {}};
    result.closed = std::string_view(node.attribute("Closed").value()) == "True";
    for (std::size_t i = 0; i < vertices.size(); i += 3) {
      BorderPoint point;
      double sum = 0.;
      for (std::size_t k = 0; k < 3; ++k) {
        if (vertices[i + k] >= surface_vertices)
          refuse(fmt::format("{} names vertex {}, but its surface has {}", what, vertices[i + k],
                             surface_vertices));
        if (!(weights[i + k] >= 0.) || !std::isfinite(weights[i + k]))
          refuse(fmt::format("{} has a weight that is not 0 or more", what));
        point.vertices[k] = vertices[i + k], point.weights[k] = weights[i + k], sum += weights[i + k];
      }
      if (!(sum > 0.) || !std::isfinite(sum))
        refuse(fmt::format("{} has a point whose weights are all 0", what));
      for (double& w : point.weights) w /= sum;
      result.points.push_back(point);
    }
    return result;
  }

 private:
  std::string name_;
};

}  // namespace

Borders read_borders(std::string_view bytes, const std::string& name) {
  const Reader reader(name);
  const std::string_view text = plain_text(bytes, name).text;
  pugi::xml_document document;
  const auto parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    const auto at = std::clamp<std::ptrdiff_t>(parsed.offset, 0, std::ptrdiff_t(text.size()));
    throw InputError(name, 1 + std::size_t(std::count(text.begin(), text.begin() + at, '\n')),
                     fmt::format("the XML is broken ({}); get the whole file", parsed.description()));
  }
  const pugi::xml_node root = document.document_element();
  if (std::string_view(root.name()) != "BorderFile")
    reader.refuse("has no <BorderFile> element; give borders as Connectome Workbench writes them");
  Borders result;
  const auto vertices = reader.numbers<std::uint32_t>(root.attribute("SurfaceNumberOfVertices").value(),
                                                      "the attribute SurfaceNumberOfVertices");
  if (vertices.size() != 1 || vertices[0] == 0)
    reader.refuse("does not say of how many vertices its surface is; write it anew with Workbench");
  result.surface_vertices = vertices[0];
  if (const auto structure = root.attribute("Structure")) result.structure = structure.value();
  for (const pugi::xml_node& group : root.children("Class"))
    for (const pugi::xml_node& border : group.children("Border"))
      for (const pugi::xml_node& part : border.children("BorderPart")) {
        result.borders.push_back(
            reader.part(border.attribute("Name").value(), part, result.surface_vertices));
        result.borders.back().group = group.attribute("Name").value();
        for (const auto& [k, channel] : {std::pair{0, "Red"}, {1, "Green"}, {2, "Blue"}})
          result.borders.back().colour[k] = border.attribute(channel).as_float();
      }
  if (result.borders.empty()) reader.refuse("has no borders; give a file with one or more");
  return result;
}

std::string write_borders(const Borders& borders) {
  pugi::xml_document document;
  auto declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0", declaration.append_attribute("encoding") = "UTF-8";
  auto root = document.append_child("BorderFile");
  root.append_attribute("Version") = "3";
  root.append_attribute("Structure") = borders.structure.c_str();
  root.append_attribute("SurfaceNumberOfVertices") = std::uint64_t(borders.surface_vertices);
  const auto paint = [](pugi::xml_node node, const Vec3& colour) {
    node.append_attribute("Red") = colour.x(), node.append_attribute("Green") = colour.y();
    node.append_attribute("Blue") = colour.z();
  };
  std::map<std::string, pugi::xml_node> groups;  // Workbench takes each name once
  for (const Border& border : borders.borders) {
    pugi::xml_node& group = groups[border.group];
    if (!group) {
      group = root.append_child("Class");
      group.append_attribute("Name") = border.group.c_str();
      paint(group, border.colour);
    }
    auto node = group.append_child("Border");
    node.append_attribute("Name") = border.name.c_str();
    paint(node, border.colour);
    auto part = node.append_child("BorderPart");
    part.append_attribute("Closed") = border.closed ? "True" : "False";
    std::string vertices, weights;
    for (const BorderPoint& p : border.points) {
      vertices += fmt::format("{}\n", fmt::join(p.vertices, " "));
      weights += fmt::format("{:.7g} {:.7g} {:.7g}\n", p.weights[0], p.weights[1], p.weights[2]);
    }
    part.append_child("Vertices").text() = vertices.c_str();
    part.append_child("Weights").text() = weights.c_str();
  }
  std::ostringstream out;
  document.save(out, " ");
  return out.str();
}

}  // namespace forest::io
