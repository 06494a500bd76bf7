// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/borders.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/cortex/sulci.h"
#include "forest/io/border_file.h"

#include "apps/cli/console.h"

namespace forest::cli {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Borders measure_borders(const std::vector<fs::path>& files, const Mesh& outer, const Mesh& inner,
                        std::span<const cortex::Line> lines) {
  using Kind = cortex::Line::Kind;
  constexpr double near = 2000., thin = 500.;  // µm; where cortex is as thin is the wall
  const TriangleTree floors(cortex::pieces(lines, Kind::sulcus)),
      valleys(cortex::pieces(lines, Kind::valley));
  Borders found;
  std::vector<BorderShare>& result = found.each;
  BorderShare all{"all", 0, 0, 0};
  for (const fs::path& path : files) {
    const io::Borders read = io::read_borders(MappedFile(path).text(), path.string());
    for (const Mesh* mesh : {&outer, &inner})
      if (mesh->positions.size() != read.surface_vertices)
        throw InputError(
            path.string(), 0,
            fmt::format("is drawn on {} vertices and a surface has {}; give the two surfaces of which it is",
                        read.surface_vertices, mesh->positions.size()));
    for (const io::Border& border : read.borders) {
      auto row =
          std::find_if(result.begin(), result.end(), [&](const auto& r) { return r.name == border.name; });
      if (row == result.end()) row = result.insert(result.end(), {border.name, 0, 0, 0});
      for (const io::BorderPoint& point : border.points) {
        cortex::Place out = cortex::Place::Zero(), in = out;
        for (std::size_t k = 0; k < 3; ++k) {
          out += point.weights[k] * outer.positions[point.vertices[k]].cast<double>();
          in += point.weights[k] * inner.positions[point.vertices[k]].cast<double>();
        }
        for (BorderShare* sum : {&*row, &all}) {
          ++sum->points;
          sum->within += floors.nearest(out, near).has_value();
          sum->half_way += valleys.nearest(.5 * (out + in), near).has_value();
        }
      }
    }
  }
  result.push_back(all);
  std::vector<std::uint8_t> wall(outer.positions.size());
  for (std::size_t v = 0; v < wall.size(); ++v)
    wall[v] = double((outer.positions[v] - inner.positions[v]).norm()) < thin;
  found.by_chance = cortex::share_near(outer, wall, floors, near);
  return found;
}

std::vector<Figure> figures_of(const Borders& borders) {
  std::vector<Figure> all;
  if (borders.each.empty()) {
    all.push_back({"border_within_2mm", nullptr});
    return all;
  }
  const BorderShare& together = borders.each.back();
  Json each;
  for (const BorderShare& b : borders.each)
    if (&b != &together) each[b.name] = b.share();
  all.push_back({"border_within_2mm", together.share()});
  all.push_back({"border_half_way", together.share_half_way()});
  all.push_back({"borders", each});
  for (const BorderShare& b : borders.each)
    all.push_back({nullptr,
                   {},
                   "border",
                   fmt::format("{:.2f} / {:.2f}", b.share(), b.share_half_way()),
                   fmt::format("share of the {} points of {} within 2 mm of a sulcus' floor on the outer "
                               "surface / of a valley half way down",
                               b.points, b.name)});
  all.push_back({"border_by_chance", borders.by_chance, "by chance", fmt::format("{:.2f}", borders.by_chance),
                 "share of the outer surface within 2 mm of a sulcus' floor"});
  return all;
}

Figure lengths_of(std::span<const cortex::Line> lines) {
  using Kind = cortex::Line::Kind;
  Json lengths;
  for (const auto& [name, kind] :
       {std::pair{"crests", Kind::crest}, {"valleys", Kind::valley}, {"sulci", Kind::sulcus}}) {
    double sum = 0.;
    for (const cortex::Line& line : lines)
      if (line.kind == kind) sum += line.length();
    lengths[name] = sum / 1e3;
  }
  return {"lines_mm", lengths, "lines",
          fmt::format("{:.0f} / {:.0f} / {:.0f}", lengths["crests"].get<double>(),
                      lengths["valleys"].get<double>(), lengths["sulci"].get<double>()),
          "mm of crests / valleys / floors of sulci"};
}

}  // namespace forest::cli
